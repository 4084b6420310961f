"""The heat map of a radiotracer: the more of it, the lighter, as PET and SPECT are read.

A 2D function of bands of values, at every gradient: colours are a part of such functions alone.
Bands overlap by half, so that their colours run into each other. They are factors to the channel's
colour.
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


def heat_shapes(level: float) -> Shapes:
    """Return the bands from a level up to the window's end; 0..1 in the window.

    level  that of the organs: below it the body's background takes up little
    """
    first = min(max(level, 0.02), 0.9)
    step = (1 - first) / len(_COLORS)
    return tuple(
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
