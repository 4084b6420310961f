"""The grey values of an MR on its cut faces, as a slice shows them.

A 2D function of bands of values: the brighter the tissue, the lighter its colour. Opacity alone
shows tissues of a solid body hardly at all. The edge between air and tissue has the channel's own
colour, which the surface has.
"""

from dataclasses import replace

import numpy as np

from stereocell.model.channel import OpacityPoints, Shape, Shapes

NAME = "grey"
_BANDS = 10
_DARKEST = 0.14  # linear RGB of the dimmest tissue, as a factor to the channel's colour
_LEAST_RANGE = 0.01  # share of the window from the foot to the brightest tissue, at least
# Step over two voxels, as a factor to the value, from which on an edge is one to air. Half-way up a
# blurred edge to air it is 1.6, and between tissues about 1 at most.
_STEEP = 1.1
_STEEPEST = 0.8  # gradient, 0..1, from which on no band has an edge of its own
_EDGE_FROM = 0.6  # share of that step at which the edge's colour begins
_EDGE_SOFTNESS = 0.3  # a sharp end: in a soft one the edge would mix with the dimmest tissue


def grey_shapes(
    level: float, brightest: float, opacity: OpacityPoints, gradient_max: float
) -> Shapes:
    """Return the bands from a body's outermost values up to the window's end.

    level         where the surface lies, 0..1 in the window
    brightest     value from which on tissue has the channel's own colour, 0..1 in the window
    opacity       of the general function: bands absorb as much, so that noise stays as faint
    gradient_max  share of the window that a step is where its gradient is 1
    """
    foot = next(value for value, absorbed in reversed(opacity) if absorbed == 0)
    places, absorbed = np.array(opacity).T
    step = (max(brightest, foot + _LEAST_RANGE) - foot) / _BANDS
    shapes = []
    for band in range(_BANDS):
        middle = foot + (band + 0.5) * step
        light = _DARKEST + (1 - _DARKEST) * (band + 0.5) / _BANDS
        is_last = band == _BANDS - 1
        low, high = max(middle - step, foot), 1.0 if is_last else min(middle + step, 1.0)
        share = float(np.interp(middle, places, absorbed))
        steep = _STEEP * middle / gradient_max
        has_edge = steep < _STEEPEST and not is_last
        shapes.append(_shape((low, high), (0.0, steep if has_edge else 1.0), light, share))
        if has_edge:
            edge = _shape((low, high), (_EDGE_FROM * steep, 1.0), 1.0, share)
            shapes.append(replace(edge, softness=_EDGE_SOFTNESS))
    return tuple(shapes)


def _shape(
    values: tuple[float, float], gradients: tuple[float, float], light: float, opacity: float
) -> Shape:
    return Shape(
        kind="rectangle",
        values=values,
        gradients=gradients,
        tip=0.5,
        color=(light, light, light),
        opacity=opacity,
        softness=1.0,
    )
