"""Measure light, hue and silhouette of a picture.

References
----------
Ottosson (2020). A perceptual color space for image processing. bottosson.github.io/posts/oklab
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from support.dcc.truth import Truth

MIN_CHROMA = 0.04  # in Oklab; a colour with less is grey, and has no hue to compare
_LMS = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)


@dataclass(frozen=True, slots=True)
class Measures:
    """The numbers that describe one picture.

    luminance   mean over the specimen, of the encoded values, 0 to 1
    white       share of the specimen's pixels that are white in all three colours
    hues        degrees between a channel's hue and that of its pixels, by channel
    silhouette  intersection over union with the truth's silhouette; 1 if there is no truth
    """

    luminance: float
    white: float
    hues: dict[str, float]
    silhouette: float


def measure(
    picture: NDArray[np.float64], truth: Truth | None, *, is_seen_through: bool = False
) -> Measures:
    """Measure a picture, encoded RGBA from 0 to 1, (height, width, 4).

    truth            None: the picture has another view, and only its light is measured
    is_seen_through  volumes: a channel's hue is that of pixels with no other channel behind it
    """
    drawn = picture[..., 3] > 0.5
    pixels = picture[drawn][:, :3]
    if not len(pixels):
        return Measures(0.0, 0.0, {}, 0.0)
    inside = ndimage.binary_erosion(drawn)
    hues = {}
    for number, (name, color) in enumerate(truth.channels.items() if truth else ()):
        assert truth is not None
        own = ndimage.binary_erosion(truth.shown == number) & inside
        if is_seen_through:
            own &= truth.alone
        if color is None or own.sum() < 30:
            continue
        expected = to_oklab(np.array(color))
        if np.hypot(*expected[1:]) < MIN_CHROMA:
            continue
        mean = to_oklab(decode(picture[own][:, :3]).mean(axis=0))
        hues[name] = _angle(mean, expected)
    return Measures(
        luminance=float((pixels @ [0.2126, 0.7152, 0.0722]).mean()),
        white=float((pixels >= 254.5 / 255).all(axis=1).mean()),
        hues=hues,
        silhouette=1.0 if truth is None else overlap(drawn, truth.covered),
    )


def overlap(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    """Return the intersection over union of two silhouettes, with a tolerance of one pixel.

    A pixel on an edge is covered in part, and programs draw it differently. Cells that are a few
    pixels wide consist almost only of edges. So a pixel counts as different only if none of its
    eight neighbours is covered in the other picture.
    """
    around = np.ones((3, 3), bool)
    wide_one, wide_other = (ndimage.binary_dilation(part, around) for part in (one, other))
    differ = (one & ~wide_other) | (other & ~wide_one)
    return float(1 - differ.sum() / max((one | other).sum(), 1))


def decode(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return linear values of sRGB ones."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def to_oklab(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return L, a, b of linear sRGB, along the last axis."""
    return np.asarray(np.cbrt(linear @ _LMS.T) @ _LAB.T)


def _angle(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    turn = np.degrees(np.arctan2(one[2], one[1]) - np.arctan2(other[2], other[1]))
    return float(abs((turn + 180) % 360 - 180))
