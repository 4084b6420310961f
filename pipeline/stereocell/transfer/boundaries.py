"""Find the boundaries between materials in a histogram of value and gradient magnitude.

A boundary between materials of values a < b, an ideal edge blurred by a Gaussian, crosses the
value at a + t (b - a) with the gradient (b - a) / (s sqrt(2 pi)) exp(-erfinv(2t - 1)^2): an arc
from one material to the other (Kindlmann & Durkin, "Semi-automatic generation of transfer
functions for direct volume rendering", IEEE Volume Visualization 1998. doi:10.1145/288126.288167).

Arcs of different pairs cross, and one that spans the whole window passes over the others' voxels.
So no arc is looked for by itself: what lies above the noise is explained as a sum of boundaries of
all pairs of materials (see transfer/material_peaks.py) at a row of blurs (see
transfer/edge_model.py), and of what the materials' own noise leaves there, none of them negative
(Lawson & Hanson, Solving Least Squares Problems, 1974. doi:10.1137/1.9781611971217). The pairs that
it takes much of are the boundaries; one that passes over a third material, whose own noise it can
pass for, only if the rest explains what is there clearly worse.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from stereocell.model.channel import Shape, Shapes, TransferFunctions2d
from stereocell.transfer.edge_model import (
    COARSER,
    HistogramGrid,
    Ratios,
    count_edge,
    count_material,
    find_steepest,
    value_noise,
)
from stereocell.transfer.joint_histogram import choose_gradient_max, rebin
from stereocell.transfer.material_peaks import find_materials, find_noise
from stereocell.transfer.shapes2d import NAME

BLURS = np.geomspace(0.3, 8.0, 14)  # sigma of an edge, in finest voxels
NOISES = (1.0, 1.5)  # x a material's noise, which a bias field widens
MIN_CONTRAST = 0.06  # least difference between two materials, as a share of the window
OVER_NOISE = 1.1  # least height of an arc's apex, in noise
MIN_SEEN = 0.02  # least share of an edge's voxels above the noise; below, it is not looked for
MIN_SHARE = 0.05  # least share that a boundary has of the voxels that all boundaries explain
MIN_MISSED = 0.05  # more squares left over without a boundary that passes over a third material
MIN_VOXELS = 2e-5  # least share of all voxels: a ball of 40 voxels in 256^3 has twice as many
MIN_COUNT = 20.0  # voxels: cells of fewer weigh no more, as nothing is quite as ideal
MAX_BOUNDARIES = 6
CLEAR = 2.0  # sigmas of noise that a shape keeps from a material's value
EVEN: Ratios = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Boundary:
    """A boundary between two materials.

    low, high  values of the materials, 0..1 in the window
    apex       its steepest gradient, met head-on, 0..1 of the scale's end: at times a little above
    steepest   the same, met in the direction that has most
    blur       sigma of the edge, in finest voxels
    share      of all voxels, those above the noise that it explains
    noise      gradient magnitude at the middle value, 0..1 of the scale's end, that noise may have
    sigma      of the values' noise there
    """

    low: float
    high: float
    apex: float
    steepest: float
    blur: float
    share: float
    noise: float
    sigma: float


@dataclass(frozen=True, slots=True)
class Boundaries:
    """The boundaries between materials of a volume.

    materials  values 0..1, rising
    reason     why there is no boundary; empty: there is one
    """

    boundaries: tuple[Boundary, ...]
    materials: tuple[float, ...]
    reason: str


@dataclass(frozen=True, slots=True)
class SuggestedShapes:
    """A first 2D function for a channel; `reason` says why it has no shapes."""

    transfer_2d: TransferFunctions2d
    reason: str

    @property
    def shapes(self) -> Shapes:
        return self.transfer_2d.functions.get(NAME, ())


def suggest(fine: NDArray[np.int64], *, spacing_um: Ratios = EVEN) -> SuggestedShapes:
    """Return shapes on the boundaries of a channel.

    fine        int64 (FINE_ROWS, COLUMNS), counts of voxels by gradient and value; see
                choose_gradient_max
    spacing_um  (z, y, x); only its ratios count
    """
    gradient_max = choose_gradient_max(fine)
    found = find_boundaries(rebin(fine, gradient_max), gradient_max, spacing_um=spacing_um)
    shapes = suggest_shapes(found)
    functions = {NAME: shapes} if shapes else {}
    suggested = TransferFunctions2d(gradient_max=gradient_max, functions=functions)
    return SuggestedShapes(suggested, found.reason)


def find_boundaries(
    counts: NDArray[np.int64], gradient_max: float, *, spacing_um: Ratios = EVEN
) -> Boundaries:
    """Return materials and boundaries of a histogram.

    counts        int64 (rows, columns), voxels by gradient magnitude and value; see count_joint
    gradient_max  magnitude that the last row stands for
    spacing_um    (z, y, x); only its ratios count

    Same histogram, same answer. A constant volume, or one of a single material, has no boundaries.
    """
    total = int(counts.sum())
    noise = find_noise(counts, gradient_max)
    if total == 0:
        return Boundaries((), (), "no voxels were counted")
    materials = find_materials(counts, noise)
    if len(materials) < 2:
        return Boundaries((), materials, f"materials found: {len(materials)}, expected at least 2")
    finest = min(spacing_um)
    z, y, x = (h / finest for h in spacing_um)
    grid = HistogramGrid(len(counts), counts.shape[1] // COARSER, gradient_max, (z, y, x))
    boundaries = _explain(counts, noise, materials, grid)
    boundaries = [boundary for boundary in boundaries if boundary.share >= MIN_VOXELS]
    boundaries = sorted(
        boundaries, key=lambda boundary: (-boundary.share, boundary.low, boundary.high)
    )[:MAX_BOUNDARIES]
    reason = (
        ""
        if boundaries
        else f"no boundary rises above the noise between {len(materials)} materials"
    )
    return Boundaries(tuple(sorted(boundaries, key=lambda a: (a.low, a.high))), materials, reason)


def suggest_shapes(found: Boundaries) -> Shapes:
    """Return a triangle on each boundary: its tip below the apex, its sides between the materials.

    What lies within 0.3 of the contrast of the middle value at the apex's height is taken, as far
    as the noise of the two materials leaves room, and up to a little above the boundary's steepest
    voxels. The lower a boundary's value, the more lies behind it: outer ones let more through.
    """
    boundaries = sorted(
        found.boundaries, key=lambda boundary: (boundary.low + boundary.high, boundary.low)
    )
    shapes = []
    for i, boundary in enumerate(boundaries):
        middle, contrast = (boundary.low + boundary.high) / 2, boundary.high - boundary.low
        top = min(1.0, 1.2 * boundary.steepest)
        room = max(contrast / 2 - CLEAR * boundary.sigma, 0.1 * contrast)
        half = min(0.3 * contrast * top / min(boundary.apex, top), room)
        bottom = min(max(0.4 * boundary.apex, min(boundary.noise, 0.7 * boundary.apex)), 0.9 * top)
        opacity = 0.7 if len(boundaries) == 1 else 0.15 + 0.55 * i / (len(boundaries) - 1)
        shapes.append(
            Shape(
                "triangle",
                (round(max(0.0, middle - half), 4), round(min(1.0, middle + half), 4)),
                (round(bottom, 4), round(top, 4)),
                round(middle, 4),
                (1.0, 1.0, 1.0),
                round(opacity, 4),
                0.5,
            )
        )
    return tuple(shapes)


@dataclass(frozen=True, slots=True)
class _Sum:
    """What lies above the noise, as a sum to be found.

    matrix  (cells, terms): what each boundary, and then each material, leaves there; weighted
    cells   (cells,) what was counted; weighted
    pairs   (boundaries,) which pair of materials each is of
    blurs   (boundaries,) in finest voxels
    seen    (boundaries,) voxels above the noise that one of 1 has
    """

    matrix: NDArray[np.float64]
    cells: NDArray[np.float64]
    pairs: NDArray[np.int64]
    blurs: NDArray[np.float64]
    seen: NDArray[np.float64]

    def fit(self, without: int = -1) -> tuple[NDArray[np.float64], float]:
        """Return the voxels of each boundary, and the squares that are left; without one pair."""
        from scipy.optimize import (
            nnls,
        )  # slow to import: every command and worker would wait for it

        used = np.ones(self.matrix.shape[1], bool)
        used[: len(self.pairs)] = self.pairs != without
        matrix = self.matrix[:, used]
        scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-12)
        found, left = nnls(matrix / scale, self.cells, maxiter=100 * len(scale))
        amounts = np.zeros(len(used))
        amounts[used] = found / scale
        return amounts[: len(self.pairs)] * self.seen, float(left) ** 2


def _explain(
    counts: NDArray[np.int64],
    noise: NDArray[np.float64],
    materials: tuple[float, ...],
    grid: HistogramGrid,
) -> list[Boundary]:
    """Return the boundaries that have their share of what lies above the noise."""
    pairs = [(a, b) for a, b in combinations(materials, 2) if b - a >= MIN_CONTRAST]
    terms = _make_terms(counts, noise, materials, pairs, grid)
    if terms is None:
        return []
    voxels, left = terms.fit()
    boundaries = []
    for number, (low, high) in enumerate(pairs):
        own = terms.pairs == number
        held = float(voxels[own].sum())
        if held <= 0 or held < MIN_SHARE * voxels.sum():
            continue
        here = _noise_at(noise, (low + high) / 2)
        blur = float(np.exp(np.average(np.log(terms.blurs[own]), weights=voxels[own])))
        per_step = (high - low) / grid.gradient_max
        apex = per_step * float(erf(1 / blur / np.sqrt(2)))
        if apex < OVER_NOISE * here:
            continue
        if any(low < other < high for other in materials):
            _, without = terms.fit(number)
            if without < (1 + MIN_MISSED) * left:
                continue
        boundaries.append(
            Boundary(
                low,
                high,
                apex,
                per_step * find_steepest(blur, grid.ratios),
                blur,
                held / float(counts.sum()),
                here,
                value_noise(here, grid.gradient_max),
            )
        )
    return boundaries


def _make_terms(
    counts: NDArray[np.int64],
    noise: NDArray[np.float64],
    materials: tuple[float, ...],
    pairs: list[tuple[float, float]],
    grid: HistogramGrid,
) -> _Sum | None:
    """Return the sum for all pairs and blurs; None where no boundary rises above the noise."""
    cells = counts.reshape(grid.rows, grid.columns, COARSER).sum(axis=2).astype(np.float64)
    level = noise.reshape(grid.columns, COARSER).max(axis=1)
    is_steep = np.arange(grid.rows)[:, np.newaxis] > level * (grid.rows - 1)
    weight = 1 / np.sqrt(cells[is_steep] + MIN_COUNT)  # counts are off by their root
    terms: list[NDArray[np.float64]] = []
    edges: list[tuple[int, float, float]] = []
    for number, (low, high) in enumerate(pairs):
        sigma = value_noise(_noise_at(noise, (low + high) / 2), grid.gradient_max)
        for blur in BLURS:
            share = count_edge(low, high, blur=float(blur), sigma=sigma, grid=grid)
            seen = share[is_steep]
            if seen.sum() > MIN_SEEN * share.sum():
                terms.append(seen * weight)
                edges.append((number, float(blur), float(seen.sum())))
    if not edges:
        return None
    for value in materials:
        for wider in NOISES:
            sigma = wider * value_noise(_noise_at(noise, value), grid.gradient_max)
            terms.append(count_material(value, sigma, grid)[is_steep] * weight)
    numbers, blurs, seen_of = (np.array(column) for column in zip(*edges, strict=True))
    return _Sum(np.stack(terms, axis=1), cells[is_steep] * weight, numbers, blurs, seen_of)


def _noise_at(noise: NDArray[np.float64], value: float) -> float:
    return float(noise[round(value * (len(noise) - 1))])
