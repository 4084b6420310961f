"""Judge iso-values over the corpus: Dice, distance, empty volumes, neighbours, confidence.

Every method gets the same denoised field. Peers are global thresholds of scikit-image, and
Sauvola's, which depends on the surroundings. Criteria that work tile by tile choose a level in each
tile.
"""

import argparse
import os
import sys
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree
from skimage import filters

sys.path.insert(0, str(Path(__file__).parents[1]))
from machine import stated

from corpus import all_cases
from corpus.case import Mask
from corpus.collected import missing
from corpus.level_search import LevelSearch, search_levels
from corpus.real import data_folder
from stereocell.isosurface.distance_field import gradient_magnitude
from stereocell.isosurface.edge_criteria import choose_by_edges, gather_edges
from stereocell.isosurface.level_histogram import BINS as BINS_OF_SCALE
from stereocell.isosurface.level_histogram import LevelHistogram, Scale
from stereocell.isosurface.options import CRITERIA, IsoValueOptions

OURS = "stereocell"
RIGHT = 0.7  # Dice from which a surface counts as right
BINS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)  # edges of bins of confidence
_SAMPLE = 2_000_000  # voxels from which a peer finds its threshold
_POINTS = 20_000  # points of a true boundary whose distance to the found one is measured
PEERS: dict[str, Callable[[NDArray[np.float32]], float]] = {
    "Otsu": filters.threshold_otsu,
    # scikit-image's own tolerance, the least difference of two voxels, may never be reached.
    "Li": lambda values: filters.threshold_li(values, tolerance=1e-5 * float(np.ptp(values))),
    "isodata": filters.threshold_isodata,
    "triangle": filters.threshold_triangle,
    "multi-Otsu": lambda values: float(filters.threshold_multiotsu(values, 3)[0]),
}


@dataclass
class Found:
    """One method on one case: the share of voxels inside, and its agreement with the truth.

    levels  levels of the tiles that have a surface
    """

    inside: float
    dice: float = float("nan")
    away: float = float("nan")  # mean distance of the boundaries, in finest voxels
    levels: tuple[float, ...] = ()


@dataclass
class Figures:
    """One case: results of all methods; `tiles` has (confidence, Dice) of ours in each tile."""

    name: str
    group: str
    held_out: bool
    found: dict[str, Found] = field(default_factory=dict)
    tiles: list[tuple[float, float]] = field(default_factory=list)
    confidence: float = 0.0
    true_level: int = 0  # index of the true level among clear levels
    level_count: int = 0  # number of clear levels that were found

    @property
    def has_truth(self) -> bool:
        return self.group not in ("empty", "looked at")


def dice(found: Mask, truth: Mask) -> float:
    return float(2 * (found & truth).sum() / max(1, found.sum() + truth.sum()))


class Truth:
    """A case's truth; its distance map is computed once for all methods."""

    def __init__(self, inside: Mask, spacing: tuple[float, float, float]) -> None:
        self.inside, self.spacing = inside, np.array(spacing)
        edge = _edge(inside)
        self._points = _some(np.argwhere(edge) * self.spacing)
        self._away = ndimage.distance_transform_edt(~edge, spacing) if edge.any() else None

    def distance(self, found: Mask) -> float:
        """Return the mean distance of the boundaries in both directions, in finest spacings."""
        edge = _edge(found)
        if self._away is None or not edge.any():
            return float("nan")
        nearest, _ = cKDTree(np.argwhere(edge) * self.spacing).query(self._points)
        return float((self._away[edge].mean() + nearest.mean()) / 2 / self.spacing.min())


def _edge(solid: Mask) -> Mask:
    return np.asarray(solid & ~ndimage.binary_erosion(solid, border_value=1))


def _some(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return every nth point, enough for a mean that is accurate to a hundredth."""
    return points[:: max(1, len(points) // _POINTS)]


def measure(number: int) -> Figures:
    """Return the figures of all methods on one case."""
    case = list(all_cases())[number]
    search = search_levels(case)
    result = Figures(case.name, case.group, case.held_out, true_level=case.level)
    result.level_count = len(search.found.shown())
    truth = None if search.truth is None else Truth(search.truth, case.spacing_um)
    for name, inside, levels in _solids(search):
        found = Found(float(inside.mean()), levels=levels)
        if truth is not None:
            found.dice = dice(inside, truth.inside)
            found.away = truth.distance(inside)
        result.found[name] = found
    clear = search.found.shown()
    if clear and search.truth is not None:
        level = clear[min(case.level, len(clear) - 1)]
        result.confidence = level.confidence
        for place, evidence in search.tiles:
            judged = search.found.judge_tile(level, evidence)
            if judged is not None:
                inside = search.values[place] > level.value
                result.tiles.append((judged.confidence, dice(inside, search.truth[place])))
    return result


def _solids(search: LevelSearch) -> Iterable[tuple[str, Mask, tuple[float, ...]]]:
    """Yield each method's name, its mask of the inside, and the tiles' levels."""
    case, values = search.case, search.field
    clear = search.found.shown()
    if clear:
        level = clear[min(case.level, len(clear) - 1)]
        yield OURS, search.values > level.value, (level.value,) * len(search.tiles)
    else:
        yield OURS, np.zeros(values.shape, bool), ()
    sample = values[~search.padding] if not search.padding.all() else values.ravel()
    sample = sample[:: max(1, sample.size // _SAMPLE)]
    for name, peer in PEERS.items():
        value = float(peer(sample))
        yield name, values > value, (value,)
    window = max(3, 2 * round(8 * min(case.spacing_um) / case.spacing_um[1]) + 1)
    spread = float(np.ptp(np.percentile(sample, (1, 99)))) / 2  # half the range: 128 for uint8
    local = np.stack(
        [filters.threshold_sauvola(plane, 4 * window + 1, r=spread) for plane in values]
    )
    yield "Sauvola", values > local, ()
    for criterion in CRITERIA:
        inside, levels = np.zeros(values.shape, bool), []
        for place, _ in search.tiles:
            part = np.ascontiguousarray(search.above[place])
            value = _by_edges(part, case.spacing_um, criterion)
            if value is not None:
                inside[place] = part > value
                levels.append(value)
        yield f"{criterion}, by tile", inside, tuple(levels)


def _by_edges(
    field: NDArray[np.float32], spacing_um: tuple[float, float, float], criterion: str
) -> float | None:
    """Return the level that a criterion of edges chooses in one tile alone."""
    scale = Scale.of(field, np.zeros(field.shape, bool))
    slopes = gradient_magnitude(field, spacing_um)
    sums = gather_edges(field, slopes, scale=scale, criterion=CRITERIA[criterion])
    counts = np.bincount(scale.bins_of(field).ravel(), minlength=BINS_OF_SCALE).astype(np.float64)
    histogram = LevelHistogram(counts, scale.edges())
    return choose_by_edges(sums, histogram, options=IsoValueOptions(criterion=criterion))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="cases whose name holds this")
    parser.add_argument("--each", action="store_true", help="a line for each case, too")
    options = parser.parse_args()
    folder = data_folder()
    absent = (
        ["all: STEREOCELL_DATA names no folder"]
        if folder is None
        else missing(folder / "level_corpus")
    )
    if absent:
        print(f"real volumes left out, not in the folder: {', '.join(absent)}", file=sys.stderr)
    chosen = [n for n, case in enumerate(all_cases()) if options.only in case.name]
    with ProcessPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        cases = []
        for case in pool.map(measure, chosen):
            cases.append(case)
            print(f"{len(cases)} of {len(chosen)}: {case.name}", file=sys.stderr, flush=True)
    whole = [case for case in cases if case.group not in ("nested", "looked at")]
    if whole:
        print_methods(whole)
    print_looks([case for case in cases if case.group == "looked at"])
    print_confidence("a tile", [tile for case in whole for tile in case.tiles])
    print_inner(cases)
    if options.each:
        print_cases(cases)


def _groups(cases: list[Figures]) -> dict[str, list[Figures]]:
    names = ["labelled", "outlined", "made"]
    found = {name: [c for c in cases if c.group == name] for name in names}
    found["held out"] = [c for c in cases if c.held_out and c.has_truth]
    return {name: some for name, some in found.items() if some}


def print_methods(cases: list[Figures]) -> None:
    groups = _groups(cases)
    empty = [c for c in cases if c.group == "empty"]
    head = [f"{name} ({len(some)}): mean, least" for name, some in groups.items()]
    head += ["boundary, median voxels", f"surface on {len(empty)} empty", "neighbours, 90 %"]
    print("| method | " + " | ".join(head) + " |")
    print("|---" * (1 + len(head)) + "|")
    for method in cases[0].found:
        cells = []
        for some in groups.values():
            scores = [c.found[method].dice for c in some]
            cells.append(f"{np.mean(scores):.3f}, {np.min(scores):.2f}")
        with_truth = [c.found[method] for c in cases if c.has_truth]
        cells.append(f"{np.nanmedian([f.away for f in with_truth]):.2f}")
        cells.append(f"{sum(c.found[method].inside > 0 for c in empty)}")
        ratios = [_ratio(f.levels) for f in with_truth if len(f.levels) > 1]
        # No interpolation, because a ratio may be infinite.
        most = np.quantile(ratios, 0.9, method="inverted_cdf") if ratios else None
        cells.append("-" if most is None else f"x {most:.3g}")
        print(f"| {method} | " + " | ".join(cells) + " |")


def _ratio(levels: tuple[float, ...]) -> float:
    """Return the largest over the least level of a case's tiles."""
    least = min(levels)
    return max(levels) / least if least > 0 else float("inf")


def print_confidence(what: str, judged: list[tuple[float, float]]) -> None:
    """Print how well confidence predicts Dice, from pairs (confidence, Dice)."""
    print(f"\n| confidence of {what} | count | share with Dice > {RIGHT} | mean Dice |")
    print("|---|---|---|---|")
    for low, high in pairwise(BINS):
        inside = [d for c, d in judged if low <= c < high or c == high == 1.0]
        if inside:
            right = np.mean([d > RIGHT for d in inside])
            print(
                f"| {low:.1f} to {high:.1f} | {len(inside)} | {right:.2f} | {np.mean(inside):.2f} |"
            )


def print_inner(cases: list[Figures]) -> None:
    """Print how good inner levels are, how many are missed, and how many are found in excess."""
    within = [case for case in cases if case.true_level]
    missed = [case.name for case in within if case.level_count <= case.true_level]
    judged = [(c.confidence, c.found[OURS].dice) for c in within if c.name not in missed]
    print_confidence("an inner level", judged)
    print(f"\ninner levels that are missed: {len(missed)} of {len(within)} {missed}")
    alike = [case for case in cases if ", x 1," in case.name]  # bodies of equal brightness
    further = sum(max(0, case.level_count - 1) for case in alike)
    print(f"further levels on {len(alike)} volumes whose bodies are all alike: {further}")


def print_looks(cases: list[Figures]) -> None:
    """Print the share of a volume without a truth that each method finds inside."""
    for case in cases:
        shares = ", ".join(f"{name} {found.inside:.2%}" for name, found in case.found.items())
        print(f"\n{case.name}, inside: {shares}; confidence {case.confidence:.2f}")


def print_cases(cases: list[Figures]) -> None:
    print()
    for case in cases:
        mine = case.found[OURS]
        if not case.has_truth:
            continue
        best = max(case.found.items(), key=lambda item: np.nan_to_num(item[1].dice))
        print(
            f"{case.group:9} {case.name:36} Dice {mine.dice:.3f} "
            f"inside {mine.inside:.4f} confidence {case.confidence:.2f}; "
            f"best {best[0]} {best[1].dice:.3f}"
        )


if __name__ == "__main__":
    with stated():
        main()
