"""The heat map of a radiotracer: the more of it, the lighter, as PET and SPECT are read.

A 2D function of bands of values, at every gradient: colours are a part of such functions alone.
Bands overlap by half, so that their colours run into each other. They are factors to the channel's
colour. A faint veil shows the body that the organs lie in.
"""

from stereocell.model.channel import Shape, Shapes

NAME = "heat"
# linear RGB from little to much: dark red, red, orange, and the channel's own colour
_COLORS = (
    (0.25, 0.02, 0.02),
    (0.6, 0.06, 0.02),
    (0.9, 0.3, 0.04),
    (1.0, 0.75, 0.4),
    (1.0, 1.0, 1.0),
)
_OPACITIES = (0.08, 0.2, 0.35, 0.45, 0.6)
# The body around the organs: a factor to amber that makes it grey, and what one voxel absorbs. 60
# voxels take a fifth of the light, so that one sees where organs lie in the body.
_BODY_COLOR, _BODY_OPACITY = (0.3, 0.42, 0.9), 0.0045
_BODY_BELOW = 0.8  # of the organs' level: a threshold above it parts no body from the air


def heat_shapes(level: float, body: float | None = None) -> Shapes:
    """Return the bands from a level up to the window's end; 0..1 in the window.

    level  that of the organs: below it the body's background takes up little
    body   value that parts the body from the air; None: it is not known, and no body shows
    """
    first = min(max(level, 0.02), 0.9)
    step = (1 - first) / len(_COLORS)
    veil: Shapes = ()
    if body is not None and 0 < body < _BODY_BELOW * first:
        veil = (_veil((body, first + step / 2)),)
    bands = tuple(
        Shape(
            kind="rectangle",
            values=(first + max(band - 0.5, 0) * step, min(first + (band + 1.5) * step, 1.0)),
            gradients=(0.0, 1.0),
            tip=0.5,
            color=color,
            opacity=opacity,
            softness=0.6,
        )
        for band, (color, opacity) in enumerate(zip(_COLORS, _OPACITIES, strict=True))
    )
    return (*bands, *veil)


def _veil(values: tuple[float, float]) -> Shape:
    return Shape(
        kind="rectangle",
        values=values,
        gradients=(0.0, 1.0),
        tip=0.5,
        color=_BODY_COLOR,
        opacity=_BODY_OPACITY,
        softness=0.05,
    )
