"""Curves as inline SVG: crisp, small, and coloured by the page's own CSS."""

from collections.abc import Mapping, Sequence

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike, NDArray

from stereocell.model.channel import OpacityPoints

WIDTH, HEIGHT = 320.0, 120.0  # units of the SVG's viewBox
_BINS = 128  # bars of a drawn histogram


def histogram(
    counts: Sequence[int], functions: Mapping[str, OpacityPoints], iso_normalized: float | None
) -> Markup:
    """Return a channel's histogram (log counts) over its window, with opacities and iso-value.

    counts          of equal bins over the window
    iso_normalized  0..1 in the window; None: no line

    The lines have the classes `tf` and `tf-<name>`; opacity runs from 0 at the bottom to 1.
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


def ladder(heights: Sequence[float], *, taken: Sequence[float], others: Sequence[float]) -> Markup:
    """Return the histogram that levels are found on.

    heights        up to 1, evenly along the axis
    taken, others  places on the axis, 0..1: the surface's level, and levels that were found besides
    """
    parts = [f'<path class="curve" d="{_path(np.linspace(0, 1, len(heights)), heights)}"/>']
    parts += [_rule("found", place) for place in others]
    parts += [_rule("mark", place) for place in taken]
    return _svg("histogram with levels", parts)


def threshold(
    counts: Sequence[int],
    smoothed: NDArray[np.float64],
    *,
    top: float,
    peaks: Sequence[float],
    rules: Mapping[str, float],
) -> Markup:
    """Return a histogram and its moving mean, with vertical lines by their class.

    counts, smoothed  of equal bins along the axis, (n,)
    top               count at the chart's top; larger counts are cut there
    peaks, rules      places on the axis, 0..1; ticks at the top mark the peaks
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
    """Return a path through points in 0..1, y upwards."""
    points = np.stack([np.asarray(x) * WIDTH, (1 - np.asarray(y)) * (HEIGHT - 4) + 4], axis=1)
    return "M" + "L".join(_point(point) for point in points)


def _point(point: NDArray[np.float64]) -> str:
    return f"{point[0]:.1f},{point[1]:.1f}"


def _rule(kind: str, at: float) -> str:
    """Return a vertical line at `at`, clamped to 0..1."""
    x = min(max(at, 0.0), 1.0) * WIDTH
    return f'<path class="{kind}" d="M{x:.1f},0V{HEIGHT:g}"/>'


def _svg(label: str, parts: Sequence[str]) -> Markup:
    return Markup(
        f'<svg viewBox="-1 0 {WIDTH + 2:g} {HEIGHT:g}" preserveAspectRatio="none" role="img" '
        f'aria-label="{label}">{"".join(parts)}</svg>'
    )
