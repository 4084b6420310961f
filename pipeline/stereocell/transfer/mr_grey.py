"""The grey values of an MR on its cut faces, as on a slice.

This is a 2D function of bands of values: brighter tissue has a lighter colour. Opacity alone hardly
shows the tissues of a solid body. The edge between air and tissue has the channel's own colour,
like the surface.
"""

from dataclasses import replace

import numpy as np

from stereocell.model.channel import OpacityPoints, Shape, Shapes

NAME = "grey"
_BANDS = 10
_DARKEST = 0.14  # linear RGB of the dimmest tissue, as a factor to the channel's colour
_LEAST_RANGE = 0.01  # share of the window: least distance from the foot to the brightest tissue
# Multiple of the value: least step over two voxels of an edge to air. Half-way up a blurred edge to
# air it is 1.6, and between tissues at most about 1.
_STEEP = 1.1
_STEEPEST = 0.8  # gradient, 0..1, above which a band has no edge of its own
_EDGE_FROM = 0.6  # share of the step of an edge to air at which the colour of the edge begins
_EDGE_SOFTNESS = 0.3  # low, because a soft edge would mix with the dimmest tissue


def grey_shapes(
    level: float, brightest: float, opacity: OpacityPoints, gradient_max: float
) -> Shapes:
    """Return the bands from a body's outermost values up to the window's end.

    level         iso-value of the surface, 0..1 in the window
    brightest     least value with the channel's own colour, 0..1 in the window
    opacity       opacity points of the general function; bands absorb as much, so that noise stays
                  as faint
    gradient_max  step, as a share of the window, whose gradient is 1
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
