"""Folders of planes, with one image file per plane."""

import os

from stereocell.read.format import Format, Guide
from stereocell.read.formats.planes.endings import BMP, JPEG, PNG, TIFF
from stereocell.read.image import Image
from stereocell.read.known_formats import identify, known_formats
from stereocell.storage.location import Location, first_bytes

_MAX_OTHERS = 200  # files without an image's ending that are checked for DICOM


def _open(location: Location, *, series: int = 0, pattern: str = "") -> Image:
    from stereocell.read.formats.planes.image import read_image

    return read_image(location, series=series, pattern=pattern)


def _list_series(location: Location) -> tuple[str, ...]:
    from stereocell.read.formats.planes.image import list_series

    return list_series(location)


def _holds(location: Location) -> bool:
    """Return whether a folder holds images of planes, and no DICOM beside them."""
    has_planes, others = False, 0
    dicom = known_formats()["dicom"]
    for at, folders, names in os.walk(location.source):
        folders.sort()
        for name in sorted(names):
            lower = name.lower()
            if lower.startswith("."):
                continue
            if lower.endswith((*TIFF, *PNG, *JPEG, *BMP)):
                has_planes = True
            elif lower.endswith(dicom.loose_endings):
                return False
            elif others < _MAX_OTHERS:
                others += 1
                if identify(first_bytes(os.path.join(at, name))).format == dicom.name:
                    return False
    return has_planes


FORMAT = Format(
    title="a folder of TIFF, PNG, JPEG or BMP planes",
    open=_open,
    list_series=_list_series,
    has_pattern=True,
    has_plain_names=True,
    holds=_holds,
    guides=(
        Guide(
            "planes of TIFF, PNG, JPEG or BMP",
            "a folder",
            "[Folders of planes](input-planes.md)",
        ),
    ),
)
