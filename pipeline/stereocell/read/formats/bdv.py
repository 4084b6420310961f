"""BigDataViewer's XML as a source: the container of HDF5 or N5 that it names is read.

References: https://imagej.net/plugins/bdv/index
"""

import os
from dataclasses import replace

from stereocell.model.errors import SourceError
from stereocell.read.bigdataviewer.xml import container_of, read_described
from stereocell.read.file_kind import require_kind
from stereocell.read.formats.hdf5 import image as hdf5
from stereocell.read.formats.n5 import image as n5
from stereocell.read.image import Image
from stereocell.read.series import lines
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location, is_own, require_own

_READERS = {"hdf5": hdf5.read_image, "n5": n5.read_image}


def read_image(location: Location, *, series: int = 0) -> Image:
    """Return the image of one view of the container; 0 is the largest.

    Raises SourceError where there is no container in the folder, UsageError for no such view.
    """
    container = _container_of(location)
    image = _READERS[str(container.format)](container, series=series, xml=location.path)
    return replace(image, files=(location.path, *(image.files or (container.path,))))


def list_series(location: Location) -> tuple[str, ...]:
    """Return a line for each tile, angle and illumination. Raises SourceError."""
    described = read_described(_container_of(location).path, location.path)
    return lines([described.candidate(view) for view in described.views(sorted(described.setups))])


def _container_of(location: Location) -> Location:
    where = location.shown
    with one_line(where, "BigDataViewer's XML"):
        named = container_of(location.path)
    if named is None:
        raise SourceError(
            f"{where}: ImageLoader: found no file of HDF5 or N5, expected one beside the XML; name "
            "the image files themselves, or save them again as HDF5 in BigStitcher"
        )
    path = os.path.join(os.path.dirname(os.path.realpath(location.path)), named)
    field = f"{where}: ImageLoader {named!r:.200}"
    if not is_own(path, [location.folder]):
        raise SourceError(
            f"{field}: leads to {os.path.realpath(path)}, expected a container in "
            f"{location.folder} or below (links followed)"
        )
    if not os.path.isdir(path):
        require_own(path, [location.folder], named=field)  # a pipe would block
    container = Location.of(path)
    if os.path.isdir(path) and container.format == "ome-zarr":
        raise SourceError(
            f"{field}: found OME-Zarr, expected HDF5 (.h5) or N5 (.n5); name an image in it, as "
            f"{named}/IMAGE, or save it again as HDF5 in BigStitcher"
        )
    if not os.path.exists(path) or container.format not in _READERS:
        raise SourceError(f"{field}: not found, expected HDF5 (.h5) or N5 beside the XML")
    require_kind(container, "" if container.format == "n5" else container.format, "HDF5")
    return container
