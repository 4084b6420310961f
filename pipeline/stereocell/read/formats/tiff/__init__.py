"""TIFF: OME, ImageJ, LSM, STK, NDTiff and plain."""

import re

from stereocell.read.format import Format, Guide
from stereocell.read.formats.tiff.magic import MAGIC
from stereocell.read.image import Image
from stereocell.storage.first_bytes import Mark
from stereocell.storage.location import Location

# DICOM files may start like TIFF, before DICOM's own mark.
_MARK = rb"(?!.{128}DICM)(" + b"|".join(map(re.escape, MAGIC)) + rb")"
_COMPANION = ".companion.ome"  # the OME-XML of a set, in a separate file


def _open(location: Location, *, series: int = 0, axes: str = "") -> Image:
    from stereocell.read.formats.tiff.image import read_image

    return read_image(location, series=series, axes=axes)


def _list_series(location: Location) -> tuple[str, ...]:
    from stereocell.read.formats.tiff.image import list_series

    return list_series(location)


def _is_companion(path: str, _head: bytes) -> bool:
    return path.lower().endswith(_COMPANION)


FORMAT = Format(
    title="TIFF",
    open=_open,
    list_series=_list_series,
    has_axes=True,
    has_plain_names=True,
    is_remote=True,
    endings=(
        *(".tif", ".tiff", ".ome.tiff", ".ome.tif", ".ome.tf2", ".ome.tf8", ".ome.btf"),
        *(_COMPANION, ".tf2", ".tf8", ".btf", ".lsm", ".stk"),
    ),
    marks=(Mark("a TIFF file", _MARK),),
    is_unmarked=_is_companion,
    guides=(
        Guide(
            "TIFF: OME, ImageJ, LSM, STK, NDTiff, plain",
            "`NAME.tif` and others",
            "[TIFF](input-tiff.md)",
        ),
    ),
)
