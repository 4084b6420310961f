"""Find the boundaries between materials in a histogram of value and gradient magnitude.

A boundary between materials of values a < b is an ideal edge blurred by a Gaussian. It crosses the
value at a + t (b - a) with the gradient (b - a) / (s sqrt(2 pi)) exp(-erfinv(2t - 1)^2), which is
an arc from one material to the other (Kindlmann & Durkin, "Semi-automatic generation of transfer
functions for direct volume rendering", IEEE Volume Visualization 1998. doi:10.1145/288126.288167).

Arcs of different pairs cross, and an arc over the whole window passes over the voxels of others. So
no arc is looked for by itself. The voxels above the noise are explained as a sum of boundaries of
all pairs of materials (see transfer/material_peaks.py) at several blurs (see
transfer/edge_model.py), and of the materials' own noise. No term is negative (Lawson & Hanson,
Solving Least Squares Problems, 1974. doi:10.1137/1.9781611971217). Pairs with a large part of the
sum are the boundaries. A boundary may pass over a third material, and resemble that material's
noise. It counts only if the sum without it explains the voxels clearly worse.
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
NOISES = (1.0, 1.5)  # multiples of a material's noise, which a bias field makes wider
MIN_CONTRAST = 0.06  # least difference between two materials, as a share of the window
OVER_NOISE = 1.1  # least height of an arc's apex, in multiples of the noise
MIN_SEEN = 0.02  # least share of an edge's voxels above the noise for an edge to be looked for
MIN_SHARE = 0.05  # least share of a boundary in the voxels that all boundaries explain
# Least relative growth of squares without a boundary that passes over a third material
MIN_MISSED = 0.05
MIN_VOXELS = 2e-5  # least share of all voxels; a ball of 40 voxels in 256^3 has twice as many
# Number of voxels; cells of the histogram with fewer voxels get no more weight, because no edge is
# quite ideal
MIN_COUNT = 20.0
MAX_BOUNDARIES = 6
CLEAR = 2.0  # standard deviations of noise that a shape keeps away from a material's value
EVEN: Ratios = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Boundary:
    """A boundary between two materials.

    low, high  values of the materials, 0..1 in the window
    apex       steepest gradient of an edge that is perpendicular to an axis, as a share of
               `gradient_max`; it may exceed 1 a little
    steepest   steepest gradient over all directions of the edge, as a share of `gradient_max`
    blur       sigma of the edge, in finest voxels
    share      share of all voxels that lie above the noise and that it explains
    noise      gradient that noise may have at the middle value, as a share of `gradient_max`
    sigma      standard deviation of the values' noise there
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
    reason     why there is no boundary; empty if there is one
    """

    boundaries: tuple[Boundary, ...]
    materials: tuple[float, ...]
    reason: str


@dataclass(frozen=True, slots=True)
class SuggestedShapes:
    """A first 2D function for a channel. `reason` is why it has no shapes; empty if it has some."""

    transfer_2d: TransferFunctions2d
    reason: str

    @property
    def shapes(self) -> Shapes:
        return self.transfer_2d.functions.get(NAME, ())


def suggest(fine: NDArray[np.int64], *, spacing_um: Ratios = EVEN) -> SuggestedShapes:
    """Return shapes for the boundaries of a channel.

    fine        int64 (FINE_ROWS, COLUMNS), counts of voxels by gradient and value; see
                choose_gradient_max
    spacing_um  (z, y, x); only the ratios matter

    >>> from stereocell.transfer.joint_histogram import FINE_ROWS, STEEPEST, count_joint
    >>> z, y, x = np.ogrid[-24:24, -24:24, -24:24]
    >>> ball = 50 + 150 / (1 + np.exp(2 * (np.sqrt(z**2 + y**2 + x**2) - 14)))
    >>> noisy = (ball + np.random.default_rng(0).normal(0, 2, ball.shape)).astype(np.uint8)
    >>> fine = count_joint(noisy, (1, 1, 1), gradient_max=STEEPEST, rows=FINE_ROWS)
    >>> [(shape.kind, round(255 * shape.tip, -1)) for shape in suggest(fine).shapes]  # 50 to 200
    [('triangle', 120.0)]
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
    gradient_max  gradient magnitude that the histogram's last row stands for
    spacing_um    (z, y, x); only the ratios matter

    The same histogram always gives the same answer. A constant volume, or one of a single material,
    has no boundaries.
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
    """Return a triangle for each boundary, with its tip below the apex.

    At the height of the apex it covers values within 0.3 of the contrast around the middle, as far
    as the noise of the two materials leaves space. It reaches a little above the steepest voxels.
    Boundaries of lower values are more transparent, because more lies behind them.
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
class _EdgeSum:
    """The voxels above the noise, as a sum whose terms are to be found.

    matrix  (cells, terms): voxels from each boundary, and then each material; weighted
    cells   (cells,): voxels counted in each cell of the histogram; weighted
    pairs   (boundaries,): the pair of materials of each boundary
    blurs   (boundaries,): sigma of each boundary's blur, in finest voxels
    seen    (boundaries,): voxels above the noise, for each voxel of the edge's area
    """

    matrix: NDArray[np.float64]
    cells: NDArray[np.float64]
    pairs: NDArray[np.int64]
    blurs: NDArray[np.float64]
    seen: NDArray[np.float64]

    def fit(self, without: int = -1) -> tuple[NDArray[np.float64], float]:
        """Return the voxels of each boundary, and the sum of the remaining squares.

        without  number of a pair whose boundaries are left out; -1: none is
        """
        # This import is slow, and every command and worker would wait for it at the start.
        from scipy.optimize import nnls

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
    """Return the boundaries that have a large share of the voxels above the noise."""
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
) -> _EdgeSum | None:
    """Return the sum for all pairs and blurs, or None if no boundary rises above the noise."""
    cells = counts.reshape(grid.rows, grid.columns, COARSER).sum(axis=2).astype(np.float64)
    level = noise.reshape(grid.columns, COARSER).max(axis=1)
    is_steep = np.arange(grid.rows)[:, np.newaxis] > level * (grid.rows - 1)
    weight = 1 / np.sqrt(cells[is_steep] + MIN_COUNT)  # standard errors of counts are their roots
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
    return _EdgeSum(np.stack(terms, axis=1), cells[is_steep] * weight, numbers, blurs, seen_of)


def _noise_at(noise: NDArray[np.float64], value: float) -> float:
    return float(noise[round(value * (len(noise) - 1))])
