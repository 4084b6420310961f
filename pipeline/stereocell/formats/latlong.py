"""Latitude-longitude maps: images of the light from all directions.

Row 0 is the top (+y). Column 0 begins at -z and continues over +x, as in the OpenEXR documentation
(https://openexr.com/en/latest/TechnicalIntroduction.html#environment-maps).
"""

from pathlib import Path

import imagecodecs
import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from stereocell.formats.exr import read_rgb
from stereocell.model.errors import StageError

Radiance = NDArray[np.float32]  # linear RGB (rows, columns, 3)

MAX_COLUMNS = 512  # largest number of columns; a volume or a rough surface shows no finer light
_SUBSAMPLES = 4  # number of samples along each edge of a texel when an image is turned


def read_latlong(file: Path) -> Radiance:
    """Return an image of light (.exr, .hdr, .png, .jpg) with at most MAX_COLUMNS columns.

    The values of .png and .jpg are sRGB. Raises StageError for a file that cannot be read.
    """
    suffix = file.suffix.lower()
    if suffix == ".exr":
        image = read_rgb(file)
    elif suffix == ".hdr":
        try:
            image = np.asarray(imagecodecs.rgbe_decode(file.read_bytes()), np.float32)
        except (imagecodecs.RgbeError, ValueError, OSError) as error:
            raise StageError(f"{file}: can't be read as Radiance HDR: {error}") from error
    else:
        try:
            with Image.open(file) as opened:
                encoded = np.asarray(opened.convert("RGB"), np.float32) / 255
        except (UnidentifiedImageError, OSError) as error:
            raise StageError(
                f"{file}: can't be read as an image, expected one in .exr, .hdr, .png or .jpg"
            ) from error
        image = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return _reduced(np.nan_to_num(image[..., :3], posinf=0.0, neginf=0.0).clip(0))


def _reduced(image: NDArray[np.floating]) -> Radiance:
    """Return means of squares of texels, at most MAX_COLUMNS in a row; the last may be smaller."""
    factor = -(-image.shape[1] // MAX_COLUMNS)
    if factor == 1:
        return image.astype(np.float32)
    starts = [np.arange(0, edge, factor) for edge in image.shape[:2]]
    sums = np.add.reduceat(np.add.reduceat(image, starts[0], axis=0), starts[1], axis=1)
    sizes = [np.diff([*begin, edge]) for begin, edge in zip(starts, image.shape[:2], strict=True)]
    return np.asarray(sums / (sizes[0][:, None] * sizes[1])[..., None], np.float32)


def turned(image: Radiance, matrix: NDArray[np.float64]) -> Radiance:
    """Return an image of light that is rotated with its scene, from its own axes to the world.

    matrix  (3, 3) from the image's axes to the world, for row vectors; its scale does not matter
    """
    turn, _ = np.linalg.qr(matrix.T)
    turn = turn * np.sign(np.sum(turn * matrix.T, axis=0))
    if np.allclose(turn, np.eye(3), atol=1e-6):
        return image
    rows, columns = image.shape[0], image.shape[1]
    total = np.zeros_like(image, np.float64)
    for down in (np.arange(_SUBSAMPLES) + 0.5) / _SUBSAMPLES:
        for along in (np.arange(_SUBSAMPLES) + 0.5) / _SUBSAMPLES:
            towards = directions(rows, columns, float(down), float(along)) @ turn
            total += image[texels_of(towards, rows, columns)]
    return np.asarray(total / _SUBSAMPLES**2, np.float32)


def directions(rows: int, columns: int, down: float, along: float) -> NDArray[np.float64]:
    """Return unit vectors (rows, columns, 3) to a point of each texel, 0..1 from its corner."""
    tilt = ((np.arange(rows) + down) / rows * np.pi)[:, None]
    turn = ((np.arange(columns) + along) / columns * 2 * np.pi)[None, :]
    x, y, z = np.sin(tilt) * np.sin(turn), np.cos(tilt), -np.sin(tilt) * np.cos(turn)
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)


def texels_of(
    towards: NDArray[np.float64], rows: int, columns: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the row and the column that show each direction (..., 3)."""
    turn = np.arctan2(towards[..., 0], -towards[..., 2]) / (2 * np.pi) % 1
    tilt = np.arccos(towards[..., 1].clip(-1, 1)) / np.pi
    row = np.minimum((tilt * rows).astype(np.intp), rows - 1)
    return row, np.minimum((turn * columns).astype(np.intp), columns - 1)


def hemispheres(image: Radiance) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean radiance (r, g, b) of the upper and of the lower half."""
    edges = np.cos(np.arange(image.shape[0] + 1) / image.shape[0] * np.pi)
    rows = image.astype(np.float64).mean(axis=1)
    above = np.diff(-edges.clip(0))[:, None]  # the share of each row above the horizon
    below = np.diff(-edges.clip(None, 0))[:, None]
    return (rows * above).sum(axis=0), (rows * below).sum(axis=0)
