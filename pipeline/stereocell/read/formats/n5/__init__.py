"""N5."""

import os
from typing import Any

from stereocell.read.chunk_counts import Absent, Spans
from stereocell.read.format import Format, Guide
from stereocell.read.image import Image
from stereocell.storage.file_states import FileStates
from stereocell.storage.location import Location


def _open(location: Location, *, axes: str = "") -> Image:
    from stereocell.read.formats.n5.image import read_image

    return read_image(location, axes=axes)


def _holds(location: Location) -> bool:
    """Return whether a folder has an `attributes.json`, which no other format has."""
    return os.path.exists(f"{location.source}/attributes.json")


def _count_absent(stored: Any, spans: Spans, states: FileStates) -> Absent | None:
    from stereocell.read.formats.n5.absent import count_absent

    return count_absent(stored, spans, states)


FORMAT = Format(
    title="N5",
    open=_open,
    has_axes=True,
    has_plain_names=True,
    is_remote=True,
    folder_endings=(".n5",),
    holds=_holds,
    count_absent=_count_absent,
    guides=(Guide("N5", "`NAME.n5`, or a folder in it", "[N5 and plain Zarr](input-zarr-n5.md)"),),
)
