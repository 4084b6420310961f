"""The geometry of the synthetic block: nuclei, tumour cells and vessels, without voxels.

Vessels grow first, as trees that fork. Nuclei are then placed at random, and accepted if they touch
nothing (random sequential packing). Positions are (z, y, x) in um.

References: Murray, "The physiological principle of minimum work", Proceedings of the National
Academy of Sciences 12(3), 1926, https://doi.org/10.1073/pnas.12.3.207
"""

from collections import defaultdict
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from stereocell.samples.bodies import Nucleus, Triple, Tube, rotation_of

MARGIN_UM = 4.0  # um, margin around the block that also holds bodies, so that the block cuts some
NUCLEUS_GAP_UM = 1.0  # um, smallest distance between the surfaces of two nuclei
STROMA_GAP_UM = 5.0  # um, smallest distance between nuclei outside the tumour
VESSEL_GAP_UM = 1.0  # um, smallest distance between a nucleus and a vessel
CELL_RIM_UM = 1.4  # um, thickness of the cytoplasm around a tumour nucleus
TUMOR_SHARE = 0.58  # share of the block's width that is tumour
_THROW_UM3 = 5.0  # um3 per random placement; with more placements the packing hardly gets denser
_STEP_UM = 1.5  # um, length of a vessel's segment
_FORK_UM = (14.0, 26.0)  # um, smallest and largest length of a branch before it forks
_SHRINK = 0.794  # factor of the radius at a fork: Murray's law for two equal branches, 2^(-1/3)


@dataclass(frozen=True, slots=True)
class Tissue:
    """The nuclei and vessels of the block. `size_um` is (z, y, x)."""

    size_um: Triple
    nuclei: tuple[Nucleus, ...]
    vessels: tuple[Tube, ...]


def grow_tissue(size_um: Triple, seed: int, brightness_spread: float) -> Tissue:
    """Return the tissue that fills a block of `size_um` (z, y, x).

    Brightness is log-uniform from 1 to 1 + `brightness_spread`; 0 makes all cells equally bright.
    """
    rng = np.random.default_rng([seed, 0])
    vessels = _grow_vessels(size_um, rng)
    nuclei = _place_nuclei(size_um, vessels, rng, brightness_spread)
    return Tissue(size_um, nuclei, vessels)


def _grow_vessels(size_um: Triple, rng: np.random.Generator) -> tuple[Tube, ...]:
    depth, height, width = size_um
    trees = max(1, round(height * width / 2500.0))
    tubes: list[Tube] = []
    for tree in range(trees):
        # The trees enter at the lower or upper edge, spread along x.
        x = width * (tree + rng.uniform(0.3, 0.7)) / trees
        from_top = bool(rng.random() < 0.5)
        y = -MARGIN_UM if from_top else height + MARGIN_UM
        start = np.array([depth * rng.uniform(0.35, 0.65), y, x])
        heading = np.array([0.0, 1.0 if from_top else -1.0, rng.normal(0.0, 0.4)])
        _grow_tree(start, heading, size_um, rng, tubes)
    return tuple(tubes)


def _grow_tree(
    start: NDArray[np.float64],
    heading: NDArray[np.float64],
    size_um: Triple,
    rng: np.random.Generator,
    tubes: list[Tube],
) -> None:
    low = np.array([-MARGIN_UM] * 3) - 1.0
    high = np.asarray(size_um) - low
    tips = [(start, heading, float(rng.uniform(2.6, 3.2)))]
    while tips:
        at, heading, radius = tips.pop()
        length = rng.uniform(*_FORK_UM)
        while length > 0.0 and np.all(at > low) and np.all(at < high):
            # This pull towards the middle of z keeps the vessel inside the section.
            pull = np.array([0.08 * (0.5 - at[0] / size_um[0]), 0.0, 0.0])
            heading = heading / np.linalg.norm(heading) + rng.normal(0.0, 0.11, 3) + pull
            heading = heading / np.linalg.norm(heading) * (0.6, 1.0, 1.0)
            end = at + _STEP_UM * heading / np.linalg.norm(heading)
            tubes.append(Tube(_triple(at), _triple(end), radius))
            at, length = end, length - _STEP_UM
        if length <= 0.0 and radius * _SHRINK >= 1.1:
            turn = rng.uniform(0.4, 0.75)
            for angle in (turn, -turn):
                tips.append((at, _turned(heading, angle), radius * _SHRINK))
        elif length <= 0.0:
            tips.append((at, heading, radius))  # a capillary continues until it leaves the block


def _turned(heading: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    z, y, x = heading
    return np.array(
        [z, y * np.cos(angle) - x * np.sin(angle), y * np.sin(angle) + x * np.cos(angle)]
    )


def _place_nuclei(
    size_um: Triple,
    vessels: tuple[Tube, ...],
    rng: np.random.Generator,
    brightness_spread: float,
) -> tuple[Nucleus, ...]:
    """Place nuclei: large and round in the tumour, small and elongated in the stroma."""
    low = np.full(3, -MARGIN_UM)
    high = np.asarray(size_um) + MARGIN_UM
    throws = int(np.prod(high - low) / _THROW_UM3)
    centers = rng.uniform(low, high, (throws, 3))
    in_tumor = _in_tumor(centers, size_um, rng)
    longest = np.where(in_tumor, rng.uniform(2.6, 3.3, throws), rng.uniform(2.8, 3.6, throws))
    slim = rng.uniform(0.0, 1.0, (throws, 2))
    ratios = np.where(in_tumor[:, None], 0.82 + 0.18 * slim, 0.5 + 0.12 * slim)
    brightness = (1.0 + brightness_spread) ** rng.random(throws)
    quaternions = rng.normal(size=(throws, 4))
    cells = np.where(in_tumor, longest + CELL_RIM_UM, 0.0)
    has_room = _distance_to_vessels(centers, vessels) > longest + VESSEL_GAP_UM
    return tuple(
        Nucleus(
            _triple(centers[i]),
            _triple(longest[i] * np.array([1.0, ratios[i, 0], ratios[i, 1]])),
            rotation_of(quaternions[i]),
            float(brightness[i]),
            float(cells[i]),
        )
        for i in _kept_apart(centers[has_room], longest[has_room], in_tumor[has_room], has_room)
    )


def _kept_apart(
    centers: NDArray[np.float64],
    reach: NDArray[np.float64],
    in_tumor: NDArray[np.bool_],
    candidates: NDArray[np.bool_],
) -> list[int]:
    """Return the placements that keep their distance from those accepted before them.

    centers     float64 (n, 3), centres (z, y, x) of the candidates, um
    reach       (n,), radii of the candidates, um
    in_tumor    (n,), whether a candidate lies in the tumour
    candidates  (m,), mask that marks the n candidates among all m placements

    The result has the indices of the kept placements among all m.
    """
    cell = 14.0  # um; centres that are further apart are never too close
    bins: defaultdict[tuple[int, int, int], list[tuple[float, ...]]] = defaultdict(list)
    kept = []
    throws = np.flatnonzero(candidates).tolist()
    rows = zip(throws, centers.tolist(), reach.tolist(), in_tumor.tolist(), strict=True)
    for index, (z, y, x), r, tumor in rows:
        key = (int(z // cell), int(y // cell), int(x // cell))
        gap = NUCLEUS_GAP_UM if tumor else STROMA_GAP_UM
        near = (
            other
            for i, j, k in product((-1, 0, 1), repeat=3)
            for other in bins.get((key[0] + i, key[1] + j, key[2] + k), ())
        )
        if all(
            (z - oz) ** 2 + (y - oy) ** 2 + (x - ox) ** 2
            >= (r + other_r + max(gap, other_gap)) ** 2
            for oz, oy, ox, other_r, other_gap in near
        ):
            bins[key].append((z, y, x, r, gap))
            kept.append(index)
    return kept


def _in_tumor(
    points: NDArray[np.float64], size_um: Triple, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Return a mask (n,) of the points in the tumour, which lies left of a wavy front."""
    _, height, width = size_um
    phases = rng.uniform(0.0, 2.0 * np.pi, 2)
    front = TUMOR_SHARE * width + 0.06 * width * np.sin(points[:, 1] / 0.28 / height + phases[0])
    front += 0.03 * width * np.sin(points[:, 1] / 0.11 / height + phases[1])
    inside: NDArray[np.bool_] = points[:, 2] < front
    return inside


def _distance_to_vessels(
    points: NDArray[np.float64], vessels: tuple[Tube, ...]
) -> NDArray[np.float64]:
    """Return signed distances (n,), capped at 10 um, from points (n, 3) to the nearest vessel."""
    nearest = np.full(len(points), 10.0)
    tree = KDTree(points)
    for tube in vessels:
        low, high = np.asarray(tube.low_um) - 10.0, np.asarray(tube.high_um) + 10.0
        reach = float(np.linalg.norm(high - low)) / 2
        near = np.array(tree.query_ball_point((low + high) / 2, reach), np.intp)
        near = near[np.all((points[near] > low) & (points[near] < high), axis=1)]
        z, y, x = points[near].T
        nearest[near] = np.minimum(nearest[near], tube.distance((z, y, x)))
    return nearest


def _triple(values: object) -> Triple:
    z, y, x = np.asarray(values, dtype=np.float64)
    return float(z), float(y), float(x)
