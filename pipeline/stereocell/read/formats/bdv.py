"""Read BigDataViewer's XML as a source: open the HDF5 or N5 container that it names.

References: https://imagej.net/plugins/bdv/index
"""

import os
from dataclasses import replace
from typing import Any

from stereocell.model.errors import SourceError
from stereocell.read.bigdataviewer.absent import count_in_views
from stereocell.read.bigdataviewer.xml import container_of, read_described
from stereocell.read.chunk_counts import Absent, Spans
from stereocell.read.file_kind import require_kind
from stereocell.read.format import Format, Guide
from stereocell.read.image import Image
from stereocell.read.known_formats import format_of
from stereocell.read.series import lines
from stereocell.storage.file_states import FileStates
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location, first_bytes, is_own, require_own

_CONTAINERS = ("hdf5", "n5")  # formats of the container that an XML may name
_HEAD_BYTES = 1 << 16  # bytes at the start of an XML that contain the name of its root


def _holds(location: Location) -> bool:
    is_named = location.source.lower().endswith(".xml")
    return is_named and b"<SpimData" in first_bytes(location.source, count=_HEAD_BYTES)


def read_image(location: Location, *, series: int = 0) -> Image:
    """Return the image of one view of the container; 0 is the largest.

    Raises SourceError if there is no container in the folder, UsageError for a missing view.
    """
    container = _container_of(location)
    if format_of(container.source).name == "n5":
        from stereocell.read.formats.n5.image import read_image as read_container
    else:
        from stereocell.read.formats.hdf5.image import read_image as read_container
    image = read_container(container, series=series, xml=location.path)
    return replace(image, files=(location.path, *(image.files or (container.path,))))


def list_series(location: Location) -> tuple[str, ...]:
    """Return a line for each tile, angle and illumination. Raises SourceError."""
    described = read_described(_container_of(location).path, location.path)
    return lines([described.candidate(view) for view in described.views(sorted(described.setups))])


def _count_absent(stored: Any, spans: Spans, states: FileStates) -> Absent | None:
    if hasattr(stored, "path_of"):
        from stereocell.read.formats.n5.absent import count_absent
    else:
        from stereocell.read.formats.hdf5.absent import count_absent
    return count_absent(stored, spans, states)


def _count_absent_in_views(stored: Any, spans: Spans, states: FileStates) -> Absent | None:
    return count_in_views(stored, spans, states, _count_absent)


def _container_of(location: Location) -> Location:
    where = location.shown
    with one_line(where, "BigDataViewer's XML"):
        named = container_of(location.path)
    if named is None:
        raise SourceError(
            f"{where}: ImageLoader: found no HDF5 or N5 file, expected one beside the XML: name "
            "the image files themselves, or save them again as HDF5 in BigStitcher"
        )
    path = os.path.join(os.path.dirname(os.path.realpath(location.path)), named)
    field = f"{where}: ImageLoader {named!r:.200}"
    if not is_own(path, [location.folder]):
        raise SourceError(
            f"{field}: leads to {os.path.realpath(path)}, expected a container inside "
            f"{location.folder} (links are followed)"
        )
    if not os.path.isdir(path):
        require_own(path, [location.folder], named=field)  # refuses a pipe, which would block
    container = Location.of(path)
    format = format_of(path)
    if os.path.isdir(path) and format.name == "ome-zarr":
        raise SourceError(
            f"{field}: found OME-Zarr, expected HDF5 (.h5) or N5 (.n5); name an image in it, such "
            f"as {named}/IMAGE, or save it again as HDF5 in BigStitcher"
        )
    if not os.path.exists(path) or format.name not in _CONTAINERS:
        raise SourceError(f"{field}: not found, expected HDF5 (.h5) or N5 beside the XML")
    if not format.folder_endings:
        require_kind(container, format)
    return container


FORMAT = Format(
    title="BigDataViewer's XML",
    open=read_image,
    list_series=list_series,
    endings=(".xml",),
    holds=_holds,
    count_absent=_count_absent_in_views,
    guides=(
        Guide(
            "BigDataViewer",
            "`NAME.xml`, or its `.h5` or `.n5`",
            "[BigDataViewer](input-bigdataviewer.md)",
        ),
    ),
)
