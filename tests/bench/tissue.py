"""Compare Dice of the tissue classes on the head phantom with multi-Otsu on the same voxels.

Parameters were tuned on the first three rows only. The other rows have other seeds, shapes, noises
and biases.
"""

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skimage.filters import threshold_multiotsu

from stereocell.samples.head import make_head
from stereocell.tissue.classify import TissueOptions, learn_tissue

NAMES = ("CSF", "grey", "white")
FULL = (112, 96, 96)
CASES = (
    *((FULL, 0.05, 0.4, seed) for seed in (1, 2, 3)),
    (FULL, 0.05, 0.6, 12),
    (FULL, 0.05, 0.2, 13),
    (FULL, 0.08, 0.4, 14),
    ((128, 110, 80), 0.05, 0.4, 15),
    ((75, 96, 96), 0.05, 0.3, 16),
    ((80, 72, 72), 0.05, 0.4, 17),
)


def dice(found: NDArray[np.bool_], truth: NDArray[np.bool_]) -> float:
    """Return the Dice coefficient: twice the intersection over the sum of both sizes."""
    return float(2 * (found & truth).sum() / (found.sum() + truth.sum()))


def by_otsu(values: NDArray[Any], classes: int) -> NDArray[np.int64]:
    return np.asarray(np.digitize(values, threshold_multiotsu(values, classes)), np.int64)


def main() -> None:
    print("| shape | noise | bias | seed | method | " + " | ".join(NAMES) + " | s |")
    print("|---" * 9 + "|")
    for shape, noise, bias, seed in CASES:
        head = make_head(shape=shape, noise=noise, bias=bias, seed=seed)
        start = time.perf_counter()
        tissue = learn_tissue(
            head.voxels, head.spacing_um, options=TissueOptions(classes=3, brain=True)
        )
        seconds = time.perf_counter() - start
        inside = np.zeros(head.voxels.shape, np.int64)
        inside[tissue.mask] = 1 + by_otsu(head.voxels[tissue.mask], 3)
        rows = {
            "ours": np.where(tissue.mask, tissue.probabilities.argmax(axis=0) + 1, 0),
            "multi-Otsu": by_otsu(head.voxels, 4),
            "multi-Otsu in our mask": inside,
        }
        case = f"{' x '.join(map(str, shape))} | {noise:g} | {bias:g} | {seed}"
        for name, labels in rows.items():
            scores = " | ".join(f"{dice(labels == k, head.labels == k):.3f}" for k in (1, 2, 3))
            shown = f"{seconds:.1f}" if name == "ours" else ""
            print(f"| {case} | {name} | {scores} | {shown} |", flush=True)


if __name__ == "__main__":
    main()
