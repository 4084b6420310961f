"""Find the boundaries between materials in a histogram of value and gradient magnitude.

A boundary between materials of values a < b, an ideal edge blurred by a Gaussian, crosses the
value at a + t (b - a) with the gradient (b - a) / (s sqrt(2 pi)) exp(-erfinv(2t - 1)^2): an arc
from one material to the other (Kindlmann & Durkin 1998). The histogram has central differences
instead, whose arc is closed form too: with z = sqrt 2 erfinv(2t - 1), s in finest voxels and Phi
the normal distribution, (b - a) (Phi(z + 1/s) - Phi(z - 1/s)).

Boundaries are taken one by one: the pair of materials (see materials.py) and the blur whose arc
holds most of the voxels above the noise, all along it; these are then taken out, and the rest is
searched again.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.special import erfinv, ndtr

from stereocell.histogram2d import choose_gradient_max, rebin
from stereocell.materials import column_gap, find_materials, find_noise
from stereocell.specimen import Shape, Shapes

BLURS = np.geomspace(0.35, 8.0, 28)  # sigma of an edge, in finest voxels
LEAST_CONTRAST = 0.06  # of the window, between two materials
OVER_NOISE = 1.3  # x the noise, to an arc's apex
OVER_ANOTHER = 1.6  # where a third material lies between
HIGHEST_APEX = 1.25  # of the scale, whose end leaves some of the steepest voxels out
MARGIN = 0.15  # of an arc at either end is the materials' own
TOLERANCE = 0.2  # of the apex, to either side of an arc
SPREAD = 0.75  # x the noise: two sigmas by which noise moves a boundary's voxels off its arc
SMEARED = 5  # columns: without noise, only some values of 8 bits occur
LEAST_IN_BAND = 0.25  # of a column's voxels above the noise, to have the arc
LEAST_COVERED = 0.6  # of an arc's columns
LEAST_VOXELS = 2e-5  # of all, to a boundary: a ball of 40 voxels in 256^3 has twice as many
MAX_ARCS = 6


@dataclass(frozen=True, slots=True)
class Arc:
    """A boundary between two materials.

    low, high  values of the materials, 0..1 in the window
    apex       its steepest gradient, 0..1 of the scale's end: at times a little above
    blur       sigma of the edge, in finest voxels
    share      of all voxels, on the arc
    covered    0..1, how much of the arc's length has its voxels
    noise      gradient magnitude at the middle value, 0..1 of the scale's end, that noise may have
    """

    low: float
    high: float
    apex: float
    blur: float
    share: float
    covered: float
    noise: float


@dataclass(frozen=True, slots=True)
class Boundaries:
    """What was found; `reason` says why there is no arc, empty if there is one.

    materials  values 0..1, rising
    """

    arcs: tuple[Arc, ...]
    materials: tuple[float, ...]
    reason: str


@dataclass(frozen=True, slots=True)
class Proposal:
    """A first 2D function for a channel; `reason` says why it has no shapes, empty if it has some.

    gradient_max  the gradient magnitude that is 1 to the shapes
    """

    shapes: Shapes
    gradient_max: float
    reason: str


def propose(fine: NDArray[np.int64]) -> Proposal:
    """Return shapes on the boundaries of a channel; `fine`: counts, see choose_gradient_max."""
    gradient_max = choose_gradient_max(fine)
    found = find_boundaries(rebin(fine, gradient_max), gradient_max)
    return Proposal(propose_shapes(found), gradient_max, found.reason)


def arc_height(t: NDArray[np.float64], blur: float) -> NDArray[np.float64]:
    """Return the step over two voxels where a blurred edge of height 1 has the value t (0..1)."""
    z = np.sqrt(2) * erfinv(2 * np.clip(t, 1e-12, 1 - 1e-12) - 1)
    height: NDArray[np.float64] = ndtr(z + 1 / blur) - ndtr(z - 1 / blur)
    return height


def find_boundaries(counts: NDArray[np.int64], gradient_max: float) -> Boundaries:
    """Return materials and boundaries of a histogram, int (rows, columns); see histogram2d.py.

    Same histogram, same answer. A constant volume, or one of a single material, has no arcs.
    """
    total = int(counts.sum())
    noise = find_noise(counts, gradient_max)
    if total == 0:
        return Boundaries((), (), "no voxels were counted")
    materials = find_materials(counts, noise)
    if len(materials) < 2:
        return Boundaries((), materials, f"materials found: {len(materials)}, expected at least 2")
    rows, columns = counts.shape
    is_steep = np.arange(rows)[:, np.newaxis] > noise * (rows - 1)
    left = np.where(is_steep, counts, 0).astype(np.float64)
    reach = max(SMEARED, 2 * round(column_gap(counts)) + 1)
    search = _Search(_smeared(left, reach), reach, total, noise, gradient_max)
    arcs: list[Arc] = []
    pairs = sorted(combinations(materials, 2))
    while len(arcs) < MAX_ARCS:
        fits = [_fit(left, search, pair, _least_apex(pair, materials)) for pair in pairs]
        found = [fit for fit in fits if fit is not None]
        if not found:
            break
        best = max(found, key=lambda arc: (arc.share * arc.covered, -arc.low, -arc.high))
        arcs.append(best)
        pairs.remove((best.low, best.high))
        left[_band(best, rows, columns, gradient_max, SPREAD * best.noise)] = 0
    reason = "" if arcs else f"no boundary rises above the noise between {len(materials)} materials"
    return Boundaries(tuple(sorted(arcs, key=lambda a: (a.low, a.high))), materials, reason)


def propose_shapes(boundaries: Boundaries) -> Shapes:
    """Return a triangle on each arc: its tip below the apex, its sides round the arc's upper part.

    What lies within 0.3 of the contrast of the middle value at the apex's height is taken, and
    what is steeper, such as the edges of brighter bodies, if no other arc lies above. The lower a
    boundary's value, the more lies behind it: outer ones let more through.
    """
    arcs = sorted(boundaries.arcs, key=lambda arc: (arc.low + arc.high, arc.low))
    shapes = []
    for i, arc in enumerate(arcs):
        middle = (arc.low + arc.high) / 2
        is_below = any(_height_at(other, middle) > arc.apex for other in arcs if other is not arc)
        top = min(1.0, 1.35 * arc.apex) if is_below else 1.0
        half = 0.3 * (arc.high - arc.low) * top / arc.apex
        bottom = min(max(0.4 * arc.apex, min(arc.noise, 0.7 * arc.apex)), 0.9 * top)
        opacity = 0.7 if len(arcs) == 1 else 0.15 + 0.55 * i / (len(arcs) - 1)
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


def _height_at(arc: Arc, value: float) -> float:
    """Return an arc's gradient magnitude at a value, by the scale of its apex; 0 outside of it."""
    if not arc.low < value < arc.high:
        return 0.0
    heights = arc_height(np.array([0.5, (value - arc.low) / (arc.high - arc.low)]), arc.blur)
    return float(arc.apex * heights[1] / heights[0])


@dataclass(frozen=True, slots=True)
class _Search:
    """What all fits share: the sums over a column of what is above the noise, each with its
    neighbours' as far as `reach`; all voxels; the noise of each column; the scale's end.
    """

    column_sums: NDArray[np.float64]
    reach: int
    total: int
    noise: NDArray[np.float64]
    gradient_max: float


def _least_apex(pair: tuple[float, float], materials: tuple[float, ...]) -> float:
    """Return how high an arc must be, in noise: over another material it meets that one's tail."""
    low, high = pair
    return OVER_ANOTHER if any(low < other < high for other in materials) else OVER_NOISE


def _fit(
    left: NDArray[np.float64], search: _Search, pair: tuple[float, float], least_apex: float
) -> Arc | None:
    """Return the arc of a pair that holds most of what is left; None: there is none."""
    rows, columns = left.shape
    low, high = pair
    if high - low < LEAST_CONTRAST:
        return None
    here = float(search.noise[round((low + high) / 2 * (columns - 1))])
    best: Arc | None = None
    for blur in BLURS:
        apex = (high - low) * float(arc_height(np.array(0.5), blur)) / search.gradient_max
        if apex > HIGHEST_APEX or apex < least_apex * here:
            continue
        arc = Arc(low, high, apex, float(blur), 0.0, 0.0, here)
        band = _band(arc, rows, columns, search.gradient_max)
        held = left * band
        on = _smeared(held, search.reach)
        # columns where the arc is above the noise, and so to be told from it
        seen = band.any(axis=0) & (_curve(arc, columns, search.gradient_max) > 1.1 * search.noise)
        if seen.sum() < 4:
            continue
        is_on = (on[seen] >= LEAST_IN_BAND * search.column_sums[seen]) & (on[seen] > 0)
        covered = float(is_on.mean())
        share = float(held.sum()) / search.total
        if covered < LEAST_COVERED or share < LEAST_VOXELS:
            continue
        arc = Arc(low, high, apex, float(blur), share, covered, here)
        if best is None or share * covered > best.share * best.covered:
            best = arc
    return best


def _curve(arc: Arc, columns: int, gradient_max: float) -> NDArray[np.float64]:
    """Return an arc's gradient magnitude, 0..1 of the scale, at each column; 0 outside of it."""
    contrast = arc.high - arc.low
    t = (np.linspace(0, 1, columns) - arc.low) / contrast
    inside = (t > MARGIN) & (t < 1 - MARGIN)
    return np.where(inside, contrast * arc_height(t, arc.blur) / gradient_max, 0.0)


def _smeared(cells: NDArray[np.float64], reach: int) -> NDArray[np.float64]:
    """Return the means of the columns' sums, each with its neighbours'."""
    sums: NDArray[np.float64] = ndimage.uniform_filter1d(cells.sum(axis=0), reach, mode="nearest")
    return np.where(sums > 1e-9, sums, 0.0)  # what the filter's running sum leaves of nothing


def _band(
    arc: Arc, rows: int, columns: int, gradient_max: float, wider: float = 0.0
) -> NDArray[np.bool_]:
    """Return the cells (rows, columns) near an arc."""
    curve = _curve(arc, columns, gradient_max)
    reach = max(TOLERANCE * arc.apex, 1.5 / (rows - 1)) + wider
    gradients = np.linspace(0, 1, rows)[:, np.newaxis]
    near: NDArray[np.bool_] = (np.abs(gradients - np.minimum(curve, 1)) <= reach) & (curve > 0)
    return near
