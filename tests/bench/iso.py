"""Criteria for an iso-value on the family of tiles whose solids are known: a table of figures.

Peers are thresholds of scikit-image, on the voxels after the same Gaussian, and once more after the
same median and with the same background subtracted.
"""

import os
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from skimage import filters

sys.path.insert(0, str(Path(__file__).parents[1]))

from stereocell.filters.background import find_background
from stereocell.filters.denoise import denoise, smooth
from stereocell.isosurface.isovalue import find_iso_value
from stereocell.isosurface.options import BY_TILE, IsoValueOptions
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from support.iso_value_family import SPACING, Mask, Member, boundary_distance_um, dice, family, make

SIGMA_UM = 0.14  # as `auto` has it: the finest spacing
BLOCK_UM = 64 * 0.14
PEERS: dict[str, Callable[[NDArray[np.float32]], float]] = {
    "Otsu": filters.threshold_otsu,
    "Li": filters.threshold_li,
    "isodata": filters.threshold_isodata,
}
Figures = dict[str, tuple[float, float]]  # Dice, mean distance of the boundaries in um


def fields(counts: NDArray[np.uint16]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the smoothed voxels, and those that our criteria see: denoised, above background."""
    volume = Volume(counts, SPACING)
    region = Box((0, 0, 0), counts.shape)  # type: ignore[arg-type]
    under = find_background(
        counts.astype(np.float32), region, spacing_um=SPACING, block_um=BLOCK_UM
    )
    return smooth(volume, SIGMA_UM), denoise(volume, SIGMA_UM) - under.at(region)


def find_solids(member: Member) -> tuple[Mask, dict[str, Mask]]:
    """Return the solids of one member, and what every criterion and peer finds of them."""
    truth, counts = make(member, seed=0)
    plain, ours = fields(counts)
    found = {name: plain > peer(plain) for name, peer in PEERS.items()}
    found |= {f"{name}, background subtracted": ours > peer(ours) for name, peer in PEERS.items()}
    for criterion in BY_TILE:
        options = IsoValueOptions(criterion=criterion)
        found[f"stereocell {criterion}"] = ours > find_iso_value(ours, SPACING, options).value
    return truth, found


def measure(member: Member) -> Figures:
    """Return the figures of every criterion and peer on one member."""
    truth, found = find_solids(member)
    return {name: (dice(s, truth), boundary_distance_um(s, truth)) for name, s in found.items()}


def main() -> None:
    members = list(family())
    with ProcessPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        figures = list(pool.map(measure, members))
    print("| criterion | Dice, mean | min | boundary, median um | " + " | ".join(_SPLITS) + " |")
    print("|---" * (4 + len(_SPLITS)) + "|")
    for name in figures[0]:
        scores = np.array([f[name][0] for f in figures])
        away = np.median([f[name][1] for f in figures])
        parts = [
            np.mean([s for s, m in zip(scores, members, strict=True) if chosen(m)])
            for chosen in _SPLITS.values()
        ]
        cells = [f"{scores.mean():.3f}", f"{scores.min():.2f}", f"{away:.2f}"]
        print(f"| {name} | " + " | ".join(cells + [f"{part:.2f}" for part in parts]) + " |")


_SPLITS: dict[str, Callable[[Member], bool]] = {
    "balls": lambda m: m.kind == "balls",
    "tubes": lambda m: m.kind == "tubes",
    "membranes": lambda m: m.kind == "membranes",
    "alike": lambda m: m.brightest == 1,
    "x 1 to 8": lambda m: m.brightest > 1,
    "even": lambda m: m.background == 0,
    "uneven": lambda m: m.background > 0,
    "1 %": lambda m: m.share == 0.01,
    "40 %": lambda m: m.share == 0.4,
    "10 photons": lambda m: m.photons == 10,
    "200": lambda m: m.photons == 200,
}

if __name__ == "__main__":
    main()
