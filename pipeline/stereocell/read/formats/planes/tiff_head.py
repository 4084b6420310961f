"""The head of a TIFF file in a folder of planes."""

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
from tifffile import TiffFile

from stereocell.model.errors import SourceError
from stereocell.read import ome_xml
from stereocell.read.formats.planes.head import Head
from stereocell.read.formats.tiff.arrays import WHITE_IS_ZERO, notes_of
from stereocell.read.formats.tiff.open_file import open_tiff, require_pages
from stereocell.read.formats.tiff.orientation import turn_of
from stereocell.read.formats.tiff.stated import stated_by
from stereocell.read.ome_depth import positions_of
from stereocell.storage.location import Location


def tiff_head(path: str, named: str) -> Head:
    """Return what a file states; no pixels are decoded. Raises SourceError."""
    with ExitStack() as stack:
        tiff = open_tiff(Location(path, True), stack)
        page = tiff.pages.first
        if page.dtype is None:
            raise SourceError(f"{named}: found pixels of an unknown type, expected numbers")
        stated = stated_by(tiff, page)
        turn, turn_notes = turn_of(page)
        sizes = (0, page.imagelength, page.imagewidth)
        _, rows, columns = (sizes[axis] for axis in turn.order)
        z_um = _metaseries_place(tiff)
        head = Head(
            (rows, columns, page.samplesperpixel),
            np.dtype(page.dtype),
            _pages(tiff, named),
            stated.spacing_um,
            z_um,
            values=stated.values,
            is_inverse=page.photometric == WHITE_IS_ZERO,
            notes=(*turn_notes, *notes_of(page), *stated.notes),
        )
        if ome_xml.is_ome(page.description):
            head = _with_ome(head, page.description, named)
        z, y, x = (head.spacing_um[axis] for axis in turn.order)
        return replace(head, spacing_um=(z, y, x))


def _pages(tiff: TiffFile, named: str) -> int:
    """Return the number of planes; 2 where one directory may hold several."""
    pages = len(tiff.pages)
    if tiff.is_stk or tiff.is_lsm:
        return 2
    if pages > 1:
        return pages
    require_pages(named, tiff, [tiff.pages.first], 1)
    described = (tiff.imagej_metadata or {}) if tiff.is_imagej else {}
    images = described.get("images", 1)  # ImageJ writes files over 4 GB with one directory
    return images if isinstance(images, int) else 1


def _metaseries_place(tiff: TiffFile) -> float | None:
    described = (tiff.metaseries_metadata or {}) if tiff.is_metaseries else {}
    z_um = described.get("PlaneInfo", {}).get("z-position")
    return float(z_um) if isinstance(z_um, int | float) else None


def _with_ome(head: Head, text: str, named: str) -> Head:
    """Return the head with the voxel size and the position of the plane in its OME-XML."""
    try:
        root = ome_xml.parse(text, named)
        images = ome_xml.images_of(root, named)
    except SourceError:  # without OME-XML the pixels are still a plane
        return head
    places, has_unit = positions_of(root)
    y_um, x_um = (_only(positions_of(root, axis)[0]) for axis in "YX")
    return replace(
        head,
        spacing_um=images[0].spacing_um if images else head.spacing_um,
        z_um=_only(places),
        z_field="PositionZ",
        has_z_unit=has_unit,
        yx_um=(y_um, x_um),
    )


def _only(places: Mapping[int, float]) -> float | None:
    return next(iter(places.values())) if len(places) == 1 else None
