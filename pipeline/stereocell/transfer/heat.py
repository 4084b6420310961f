"""The heat map of a radiotracer: more tracer is lighter, as in readings of PET and SPECT.

This is a 2D function of bands of values at all gradients, because only 2D functions have colours.
Bands overlap by half, so that their colours blend. Colours are factors to the channel's colour. A
faint veil shows the body in which the organs lie.
"""

from stereocell.model.channel import Shape, Shapes

NAME = "heat"
# Linear RGB from little to much tracer: dark red, red, orange, and the channel's own colour
_COLORS = (
    (0.25, 0.02, 0.02),
    (0.6, 0.06, 0.02),
    (0.9, 0.3, 0.04),
    (1.0, 0.75, 0.4),
    (1.0, 1.0, 1.0),
)
_OPACITIES = (0.08, 0.2, 0.35, 0.45, 0.6)
# Colour and opacity per voxel of the body around the organs. The colour is a factor to amber that
# makes it grey. 60 voxels absorb a fifth of the light, which shows where in the body organs lie.
_BODY_COLOR, _BODY_OPACITY = (0.3, 0.42, 0.9), 0.0045
# Share of the organs' level; a threshold above it does not separate the body from the air
_BODY_BELOW = 0.8


def heat_shapes(level: float, body: float | None = None) -> Shapes:
    """Return the bands from a level up to the window's end. Values are 0..1 in the window.

    level  level of the organs; the body's background takes up less tracer
    body   value that separates the body from the air; None: unknown, and the body is not shown
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
