"""The grey values of an MR on its cut faces, as a slice shows them.

A 2D function of bands of values: the brighter the tissue, the lighter its colour. Opacity alone
shows tissues of a solid body hardly at all. The edge between air and tissue has the channel's own
colour, which the surface has.
"""

import numpy as np

from stereocell.model.channel import OpacityPoints, Shape, Shapes

NAME = "grey"
_BANDS = 10
_DARKEST = 0.12  # linear RGB of the dimmest tissue, as a factor to the channel's colour
_BEYOND = 1.4  # levels up to which steep values are the body's outer edge
_CONTRAST = 1.3  # power of the share of the range that becomes light
_LEAST_RANGE = 0.01  # share of the window from the foot to the brightest tissue, at least
_STEEP = 0.6  # step over two voxels, in levels, from which on an edge is one to air


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
    steep = min(_STEEP * level / gradient_max, 0.9)
    step = (max(brightest, foot + _LEAST_RANGE) - foot) / _BANDS
    bands = []
    for band in range(_BANDS):
        middle = foot + (band + 0.5) * step
        light = _DARKEST + (1 - _DARKEST) * ((band + 0.5) / _BANDS) ** _CONTRAST
        low = max(middle - step, foot)
        high = 1.0 if band == _BANDS - 1 else min(middle + step, 1.0)
        share = float(np.interp(middle, places, absorbed))
        bands.append(_shape((low, high), (0.0, 1.0), light, share))
    beyond = max(_BEYOND * level, foot + step)  # strong noise lets opacity begin above the level
    at_edge = float(np.interp(beyond, places, absorbed))
    return (*bands, _shape((foot, min(beyond, 1.0)), (steep, 1.0), 1.0, at_edge))


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
