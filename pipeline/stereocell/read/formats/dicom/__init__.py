"""DICOM: a folder with files at any depth, or one file."""

import os

from stereocell.read.format import Format, Guide
from stereocell.read.image import Image
from stereocell.read.known_formats import is_unknown
from stereocell.storage.first_bytes import Mark
from stereocell.storage.location import Location


def _open(location: Location, *, series: int = 0) -> Image:
    from stereocell.read.formats.dicom.image import read_image

    return read_image(location, series=series)


def _list_series(location: Location) -> tuple[str, ...]:
    from stereocell.read.formats.dicom.image import list_series

    return list_series(location)


def _read_free_labels(location: Location) -> dict[int, str]:
    from stereocell.read.formats.dicom.image import read_free_labels

    return read_free_labels(location)


def _is_folder(location: Location) -> bool:
    return os.path.isdir(location.source)


FORMAT = Format(
    title="DICOM (a file or a folder)",
    open=_open,
    list_series=_list_series,
    order=(
        "images before phases, projections and localizers, larger series first; then images as "
        "acquired before derived ones, in phase and water before opposed phase and fat, then lower "
        "echo times, b-values and energies"
    ),
    loose_endings=(".dcm", ".dicom", ".ima"),
    may_hold=_is_folder,
    marks=(Mark("a DICOM file", rb"DICM", at=128),),
    is_unmarked=is_unknown,  # files from before 1993 have no mark
    read_free_labels=_read_free_labels,
    guides=(Guide("DICOM", "a folder or a file", "[DICOM and NIfTI](dicom.md)"),),
)
