"""Images that hold all slices of a volume side by side: Siemens's mosaics and UIH's VFRAME.

Siemens states one position, that of a slice as large as the whole mosaic with the same middle. The
direction and number of the slices are in its private header (CSA, read by nibabel). UIH states the
position of every slice. The rules follow dcm2niix and nibabel's MosaicWrapper.

References: https://nipy.org/nibabel/dicom/dicom_mosaic.html
"""

import math
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pydicom
from numpy.typing import NDArray

from stereocell.read.formats.dicom.frame import Vector
from stereocell.read.formats.dicom.silence_logs import DICOM_FAULTS

MOSAIC, VFRAME = "MOSAIC", "VFRAME"  # values of ImageType
_NUMBER = 0x0019100A  # NumberOfImagesInMosaic
_SIEMENS_TAGS: list[Any] = [
    "SpacingBetweenSlices",
    "SliceThickness",
    0x00190010,
    _NUMBER,
    # The private header and its creator, in their usual block or one of the next two.
    *(0x00290000 + block for block in (0x10, 0x11, 0x12)),
    *(0x00290010 + (block << 8) for block in (0x10, 0x11, 0x12)),
]
_UIH_SLICES = 0x00651051
_MAX_SLICES = 4096  # slices; a mosaic that states more is left out
_MAX_COSINE_ERROR = 0.01  # largest difference from 1 of the cosine of stated and computed normal


class MosaicError(Exception):
    """The slices of a mosaic have no place; the text gives the reason without the file's values."""


@dataclass(frozen=True, slots=True)
class Tile:
    """One slice of a mosaic: its first pixel (row, column) in the image, and that pixel's place.

    position  LPS, mm
    """

    corner: tuple[int, int]
    position: Vector


@dataclass(frozen=True, slots=True)
class Mosaic:
    """The slices of one image, each `rows` x `columns` pixels."""

    rows: int
    columns: int
    tiles: tuple[Tile, ...]


def find_mosaic(
    path: Path,
    image_type: Any,
    shape: tuple[int, int],
    directions: tuple[Vector, Vector],
    spacing: tuple[float, float],
    position: Vector | None,
) -> Mosaic | None:
    """Return the slices of a file's single image; None: it is a plain image.

    image_type  the header's ImageType
    shape       pixels (rows, columns) of the whole image
    directions  unit vectors along a row and along a column
    spacing     mm between (rows, columns)
    position    ImagePositionPatient; None: not stated

    Raises MosaicError where the slices have no place.
    """
    if VFRAME in image_type:
        return _uih(path, shape)
    if MOSAIC not in image_type:
        return None
    return _siemens(path, shape, directions, spacing, position)


def _siemens(
    path: Path,
    shape: tuple[int, int],
    directions: tuple[Vector, Vector],
    spacing: tuple[float, float],
    position: Vector | None,
) -> Mosaic:
    header = pydicom.dcmread(path, stop_before_pixels=True, force=True, specific_tags=_SIEMENS_TAGS)
    count, normal = _private_header(header)
    count = count or int(header[_NUMBER].value if _NUMBER in header else 0)
    subject = f"with a mosaic of {count or 'several'} slices"
    if count < 1 or normal is None or position is None:
        raise MosaicError(
            f"{subject}, without the private header (0029,1010) that places them: export it with "
            "private tags, or as single slices"
        )
    side = math.ceil(math.sqrt(count))
    rows, columns = _tile(shape, side, side, count, subject)
    along_row, along_column = (np.array(direction) for direction in directions)
    gap = float(header.get("SpacingBetweenSlices") or header.get("SliceThickness") or 0)
    if (
        not 0 < gap < math.inf
        or abs(abs(normal @ np.cross(along_row, along_column)) - 1) > _MAX_COSINE_ERROR
    ):
        raise MosaicError(f"{subject} without their direction or distance")
    down, across = spacing
    first = (
        np.array(position)
        + along_row * across * (shape[1] - columns) / 2
        + along_column * down * (shape[0] - rows) / 2
    )
    places = first + np.arange(count)[:, None] * gap * normal
    return _mosaic(rows, columns, side, places)


def _private_header(header: Any) -> tuple[int, NDArray[np.float64] | None]:
    """Return number and direction of the slices from Siemens's CSA header; (0, None): none."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # nibabel warns that this part of it may change
        from nibabel.nicom import csareader

        try:
            found = csareader.get_csa_header(header, "image")  # type: ignore[no-untyped-call]
            if not found:
                return 0, None
            normal = csareader.get_slice_normal(found)  # type: ignore[no-untyped-call]
            return int(csareader.get_n_mosaic(found) or 0), _unit(normal)  # type: ignore[no-untyped-call]
        except (csareader.CSAReadError, *DICOM_FAULTS):
            return 0, None


def _unit(vector: Any) -> NDArray[np.float64] | None:
    if vector is None:
        return None
    values = np.asarray(vector, np.float64)
    length = float(np.linalg.norm(values))
    return values / length if values.shape == (3,) and 0.5 < length < 2 else None


def _uih(path: Path, shape: tuple[int, int]) -> Mosaic | None:
    header = pydicom.dcmread(path, stop_before_pixels=True, force=True, specific_tags=[_UIH_SLICES])
    items = header[_UIH_SLICES].value if _UIH_SLICES in header else ()
    if not isinstance(items, pydicom.Sequence) or not items:
        return None
    subject = f"with a grid of {len(items)} slices"
    try:
        places = np.array([item.ImagePositionPatient for item in items], np.float64)
    except DICOM_FAULTS:
        raise MosaicError(f"{subject} without their places") from None
    if places.shape != (len(items), 3):
        raise MosaicError(f"{subject} without their places")
    across = math.ceil(math.sqrt(len(items)))
    rows, columns = _tile(shape, -(-len(items) // across), across, len(items), subject)
    return _mosaic(rows, columns, across, places)


def _tile(
    shape: tuple[int, int], down: int, across: int, count: int, subject: str
) -> tuple[int, int]:
    """Return the pixels (rows, columns) of a slice in a grid of `down` x `across` slices."""
    if count > _MAX_SLICES or shape[0] % down or shape[1] % across:
        raise MosaicError(
            f"{subject} in an image of {shape[0]} x {shape[1]} pixels, which they don't fill"
        )
    return shape[0] // down, shape[1] // across


def _mosaic(rows: int, columns: int, across: int, places: NDArray[np.float64]) -> Mosaic:
    if not np.isfinite(places).all():
        raise MosaicError("with a mosaic of slices without a place in the patient")
    tiles = []
    for k, (x, y, z) in enumerate(places.tolist()):
        row, column = divmod(k, across)
        tiles.append(Tile((row * rows, column * columns), (x, y, z)))
    return Mosaic(rows, columns, tuple(tiles))
