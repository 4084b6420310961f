"""Compare Dice of the tissue classes on the head phantom with multi-Otsu on the same voxels.

Parameters were tuned on the first three rows only. The other rows have other seeds, shapes, noises
and biases.
"""

import argparse
from typing import Any

import numpy as np
from machine import stated, timed, typical
from numpy.typing import NDArray
from published import publish
from skimage.filters import threshold_multiotsu

from stereocell.samples.head import HeadPhantom, make_head
from stereocell.tissue.classify import TissueOptions, learn_tissue

COLUMNS = (
    *("shape", "noise", "bias", "seed", "CSF", "grey", "white"),
    *("multi-Otsu", "multi-Otsu in our mask"),
)
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


def scores_of(labels: NDArray[np.int64], head: HeadPhantom) -> list[str]:
    """Return Dice of CSF, grey and white matter, which have the labels 1, 2 and 3."""
    return [f"{dice(labels == k, head.labels == k):.3f}" for k in (1, 2, 3)]


def main() -> None:
    """Print a row for each case. With `--publish` the rows replace those of docs/benchmarks.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--publish", action="store_true", help="put the table into the docs")
    given = parser.parse_args()
    print(f"| {' | '.join(COLUMNS)} | cost |")
    print("|---" * (len(COLUMNS) + 1) + "|")
    rows = []
    for shape, noise, bias, seed in CASES:
        head = make_head(shape=shape, noise=noise, bias=bias, seed=seed)
        with timed() as spent:
            tissue = learn_tissue(
                head.voxels, head.spacing_um, options=TissueOptions(classes=3, brain=True)
            )
        inside = np.zeros(head.voxels.shape, np.int64)
        inside[tissue.mask] = 1 + by_otsu(head.voxels[tissue.mask], 3)
        ours = np.where(tissue.mask, tissue.probabilities.argmax(axis=0) + 1, 0)
        scores = [scores_of(labels, head) for labels in (ours, by_otsu(head.voxels, 4), inside)]
        case = [" x ".join(map(str, shape)), f"{noise:g}", f"{bias:g}", str(seed)]
        rows.append([*case, *scores[0], *(" ".join(each) for each in scores[1:])])
        print(f"| {' | '.join(rows[-1])} | {typical(spent)} |", flush=True)
    if given.publish:
        publish("tissue", "Dice by shape, noise and bias", COLUMNS, rows)


if __name__ == "__main__":
    with stated():
        main()
