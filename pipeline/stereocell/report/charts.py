"""Draw curves as inline SVG, which the page's CSS colours."""

from collections.abc import Mapping, Sequence

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike, NDArray

from stereocell.model.channel import OpacityPoints

WIDTH, HEIGHT = 320.0, 120.0  # units of the SVG's viewBox
_BINS = 128  # largest number of bars of a drawn histogram


def histogram(
    counts: Sequence[int], functions: Mapping[str, OpacityPoints], iso_normalized: float | None
) -> Markup:
    """Return a chart of a channel's histogram over its window, with opacities and iso-value.

    counts          number of voxels in equal bins over the window; drawn logarithmically
    functions       opacity points of each transfer function; 0 is at the bottom, 1 at the top
    iso_normalized  0..1 in the window; None: no line

    The lines of functions have the CSS classes `tf` and `tf-<name>`.
    """
    summed = np.add.reduceat(counts, np.arange(0, len(counts), max(1, len(counts) // _BINS)))
    heights = np.log1p(summed) / max(1.0, float(np.log1p(summed).max()))
    edges = np.linspace(0, 1, len(heights) + 1)
    steps = _path(np.repeat(edges, 2)[1:-1], np.repeat(heights, 2))
    parts = [f'<path class="area" d="{steps}V{HEIGHT:g}H0Z"/>']
    for name, points in functions.items():
        x, y = np.array(points, dtype=np.float64).T
        parts.append(f'<path class="tf tf-{name}" d="{_path(x, y)}"/>')
    if iso_normalized is not None:
        parts.append(_rule("mark", iso_normalized))
    return _svg("histogram with transfer functions", parts)


def candidates(
    heights: Sequence[float], *, taken: Sequence[float], others: Sequence[float]
) -> Markup:
    """Return a chart of the histogram from which iso-values are found, with a line at each of them.

    heights        0..1, evenly spaced along the axis
    taken, others  positions on the axis, 0..1: the surface's iso-value, and the others found
    """
    parts = [f'<path class="curve" d="{_path(np.linspace(0, 1, len(heights)), heights)}"/>']
    parts += [_rule("found", place) for place in others]
    parts += [_rule("mark", place) for place in taken]
    return _svg("histogram with iso-values", parts)


def threshold(
    counts: Sequence[int],
    smoothed: NDArray[np.float64],
    *,
    top: float,
    peaks: Sequence[float],
    rules: Mapping[str, float],
) -> Markup:
    """Return a chart of a histogram and its moving mean, with vertical lines at thresholds.

    counts, smoothed  number of voxels in equal bins along the axis, and its moving mean, (n,)
    top               count at the top of the chart, where larger counts are cut off
    peaks             positions of peaks on the axis, 0..1; short ticks at the top mark them
    rules             CSS class of each line: its position on the axis, 0..1
    """
    edges = np.linspace(0, 1, len(counts) + 1)
    steps = _path(np.repeat(edges, 2)[1:-1], np.repeat(np.minimum(np.divide(counts, top), 1), 2))
    middles = (edges[1:] + edges[:-1]) / 2
    parts = [
        f'<path class="area" d="{steps}V{HEIGHT:g}H0Z"/>',
        f'<path class="curve" d="{_path(middles, np.minimum(smoothed / top, 1))}"/>',
    ]
    parts += [f'<path class="peak" d="M{at * WIDTH:.1f},0V9"/>' for at in peaks]
    parts += [_rule(kind, at) for kind, at in rules.items()]
    return _svg("histogram, smoothed, with thresholds", parts)


def _path(x: ArrayLike, y: ArrayLike) -> str:
    """Return the SVG path through points with coordinates 0..1, y upwards."""
    points = np.stack([np.asarray(x) * WIDTH, (1 - np.asarray(y)) * (HEIGHT - 4) + 4], axis=1)
    return "M" + "L".join(_point(point) for point in points)


def _point(point: NDArray[np.float64]) -> str:
    return f"{point[0]:.1f},{point[1]:.1f}"


def _rule(kind: str, at: float) -> str:
    """Return a vertical line at a position of the axis, which is clamped to 0..1."""
    x = min(max(at, 0.0), 1.0) * WIDTH
    return f'<path class="{kind}" d="M{x:.1f},0V{HEIGHT:g}"/>'


def _svg(label: str, parts: Sequence[str]) -> Markup:
    return Markup(
        f'<svg viewBox="-1 0 {WIDTH + 2:g} {HEIGHT:g}" preserveAspectRatio="none" role="img" '
        f'aria-label="{label}">{"".join(parts)}</svg>'
    )
