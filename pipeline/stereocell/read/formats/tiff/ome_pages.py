"""Compare the planes of an OME-TIFF with the files and pages that the OME-XML names for them.

tifffile uses the last of two entries for a plane, and leaves out a file that it can't open.
"""

import os
from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree

import numpy as np

from stereocell.model.errors import SourceError
from stereocell.read import ome_xml
from stereocell.storage.location import Location


def require_described(location: Location, root: ElementTree.Element, pages: Sequence[Any]) -> None:
    """Raise SourceError where a plane of the first image isn't the page that the OME-XML names.

    The OME-XML then names two pages for a plane, or describes no page of the planes.

    pages  pages of the finest level; none is missing
    """
    order, sizes = _loops(root)
    described = 0
    for data, uuid in ome_xml.tiff_data_of(root):
        place = [int(data.get(f"First{axis}", 0)) for axis in order]
        if any(at >= size for at, size in zip(place, sizes, strict=True)):
            continue  # ImageJ writes such entries when it crops; tifffile leaves them out too
        described += 1
        start, first = int(np.ravel_multi_index(place, sizes)), int(data.get("IFD", 0))
        count = max(int(data.get("PlaneCount", data.get("NumPlanes", 1))), 1)
        path = _path_of(location, root, uuid)
        for number, page in enumerate(pages[start : start + count]):
            found = (os.path.realpath(page.parent.filehandle.path), page.index)
            expected = (path or found[0], first + number)
            if found != expected:
                at = np.unravel_index(start + number, sizes)
                plane = ", ".join(f"{a} {n}" for a, n in zip(order, at, strict=True))
                raise SourceError(
                    f"{location.shown}: OME-XML: TiffData of plane {plane}: found {_words(found)} "
                    f"and {_words(expected)}, expected one page for each plane"
                )
    if not described:
        raise SourceError(
            f"{location.shown}: OME-XML: found no TiffData in the first Image, expected its planes"
        )


def require_files(
    location: Location, root: ElementTree.Element, pages: Sequence[object | None]
) -> None:
    """Raise SourceError where planes are missing because a file of the set is missing.

    pages  pages of the finest level; None: a missing page
    """
    if not location.is_local or all(page is not None for page in pages):
        return
    paths = {_path_of(location, root, uuid) for _, uuid in ome_xml.tiff_data_of(root)}
    missing = sorted(os.path.basename(path) for path in paths if not os.path.exists(path))
    if missing:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        raise SourceError(
            f"{location.shown}: found {sum(page is not None for page in pages)} planes, expected "
            f"{len(pages)}: a file of the set is missing: {missing[0]!r:.100}{more}: copy it again"
        )


def require_alike(location: Location, pages: Sequence[Any]) -> None:
    """Raise SourceError where the files of a set hold planes of another size or number type.

    pages  pages of the finest level; none is missing
    """
    first = pages[0].keyframe
    for page in {page.parent: page.keyframe for page in pages}.values():
        if (page.shape, page.dtype) != (first.shape, first.dtype):
            raise SourceError(
                f"{location.shown}: {page.parent.filename!r:.100}: found planes of {page.shape} "
                f"{page.dtype}, expected {first.shape} {first.dtype}, as in "
                f"{first.parent.filename!r:.100}: the file belongs to another set"
            )


def _loops(root: ElementTree.Element) -> tuple[str, list[int]]:
    """Return the axes over planes, slowest first, and their sizes. Samples are not planes."""
    pixels = ome_xml.pixels_of(root)
    if pixels is None:
        return "", []
    order = pixels.get("DimensionOrder", "XYZCT")[:1:-1]
    sizes = {axis: int(pixels.get(f"Size{axis}", 1)) for axis in order}
    if "C" in sizes:
        sizes["C"] //= ome_xml.samples_of(pixels)
    return order, list(sizes.values())


def _words(page: tuple[str, int]) -> str:
    return f"page {page[1]} of {os.path.basename(page[0])!r:.100}"


def _path_of(
    location: Location, root: ElementTree.Element, uuid: ElementTree.Element | None
) -> str:
    """Return the path of the file that tifffile reads for a UUID; empty at an address."""
    if not location.is_local:
        return ""
    own = os.path.realpath(location.path)
    if uuid is None or uuid.text == root.get("UUID"):
        return own
    return os.path.realpath(os.path.join(os.path.dirname(own), uuid.get("FileName", "")))
