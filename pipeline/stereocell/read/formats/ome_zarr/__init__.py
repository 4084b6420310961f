"""OME-Zarr, and Zarr without the metadata of OME-Zarr."""

import os
import re
from typing import Any

from stereocell.read.chunk_counts import Absent, Spans
from stereocell.read.format import Format, Guide
from stereocell.read.formats.ome_zarr.archive import ARCHIVE_ENDINGS, ZARR_FILES, is_archive
from stereocell.read.image import Image
from stereocell.storage.file_states import FileStates
from stereocell.storage.location import Location

# DANDI's bucket holds each Zarr under a UUID without an ending.
_OF_DANDI = re.compile(r"/zarr/[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}(/|$)")


def _open(location: Location, *, series: int = 0, axes: str = "") -> Image:
    from stereocell.read.formats.ome_zarr.image import read_image

    return read_image(location, series=series, axes=axes)


def _list_series(location: Location) -> tuple[str, ...]:
    from stereocell.read.formats.ome_zarr.image import list_series

    return list_series(location)


def _holds(location: Location) -> bool:
    if is_archive(location.path):
        return True
    return any(os.path.exists(f"{location.source}/{name}") for name in ZARR_FILES)


def _count_absent(stored: Any, spans: Spans, states: FileStates) -> Absent | None:
    from stereocell.read.formats.ome_zarr.absent import count_absent

    return count_absent(stored, spans, states)


FORMAT = Format(
    title="OME-Zarr",
    open=_open,
    list_series=_list_series,
    has_axes=True,
    has_parts=True,
    has_plain_names=True,
    is_remote=True,
    endings=ARCHIVE_ENDINGS,
    folder_endings=(".zarr", ".ome.zarr"),
    addresses=_OF_DANDI,
    holds=_holds,
    count_absent=_count_absent,
    guides=(
        Guide(
            "OME-Zarr 0.1 to 0.6",
            "`NAME.zarr`, a zip file of it (`NAME.ozx`), or an image in either",
            "[OME-Zarr](input-ome-zarr.md)",
        ),
        Guide(
            "Zarr 2 and 3",
            "the folder of an array, or of a group that holds one array",
            "[N5 and plain Zarr](input-zarr-n5.md)",
        ),
    ),
)
