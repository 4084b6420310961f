"""Read OME-TIFF with tifffile, which serves every level as a Zarr array of strips or tiles.

bioio's reader, which builds on tifffile, is not used. It reads only level 0 (leaving out
sub-resolutions in SubIFDs). It reads a whole page for each window, and opens the file again for
each page. It also refuses a file for a fault anywhere in its metadata, and takes 2 s to import.

References: https://docs.openmicroscopy.org/ome-model/latest/ome-tiff/specification.html
"""

import math
import re
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from itertools import chain
from typing import Any
from xml.etree import ElementTree

from tifffile import TiffFile, TiffPage

from stereocell.model.errors import SourceError
from stereocell.read import ome_xml
from stereocell.read.dataset import VoxelArray
from stereocell.read.formats.tiff.arrays import (
    array_of,
    require_depth,
    samples_as_channels,
    with_given_axes,
)
from stereocell.read.formats.tiff.ome_images import Chosen
from stereocell.read.formats.tiff.ome_pages import require_alike, require_described, require_files
from stereocell.read.formats.tiff.open_file import MAX_PLANES, files_of, note_absent, require_pages
from stereocell.read.formats.tiff.orientation import turn_of
from stereocell.read.formats.tiff.stated import tag_notes
from stereocell.read.image import MAX_CHANNELS, Image
from stereocell.read.ome_depth import settle_depth
from stereocell.read.ome_xml import OmeImage
from stereocell.read.spacing import Grid, grid_of
from stereocell.read.statements import Statement, Subject, Trust, settle
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

# Limits of numbers in OME-XML and tags: the libraries allocate lists of such lengths at once.
_MAX_SIDE = 10_000_000  # voxels along x or y; an image with more is refused
_MAX_LEVELS = 64  # coarser levels of a pyramid; a file with more is refused
_SUB_IFDS = 330  # TIFF tag SubIFDs: offsets of a page's coarser levels
_VALUE_TYPE = Subject("type of the voxels")
_NUMPY_NAMES = {"float": "float32", "double": "float64", "bit": "bool"}  # OME-XML's name -> NumPy's
_CLAIM = re.compile(r"""\b(Size[XYZCT]|PlaneCount|IFD)\s*=\s*["']\s*(\d+)""")


def read_ome(
    location: Location,
    tiff: TiffFile,
    stack: ExitStack,
    *,
    chosen: Chosen,
    text: str,
    log: Sequence[str],
    axes: str,
) -> Image:
    """Return the chosen image of an open file.

    text    OME-XML with only the chosen image, from the file or from the one beside it
    log     list to which tifffile's messages are added
    axes    letters of the axes longer than 1, slowest first; empty: as in the OME-XML

    Raises SourceError where it can't be read as an image.
    """
    where, root = location.shown, chosen.root
    with one_line(where, "a complete OME-TIFF file with its OME-XML"):
        _check_claims(where, tiff, text)
        tiff.is_ome = True
        images = ome_xml.images_of(root, where)
        series = tiff.series[0]
        pages = [list(level.pages) for level in series.levels]
        arrays = [array_of(series, index) for index in range(len(pages))]
    if series.kind != "ome":
        reason = f" ({log[-1]:.120})" if log else ""
        raise SourceError(
            f"{where}: planes don't match the OME-XML{reason}, expected a page for each plane"
        )
    _require_planes(location, tiff, root, pages)
    if axes:
        arrays = with_given_axes(where, arrays, axes)
    image = _image(where, images, arrays, page=series.keyframe, stack=stack)
    image, depth_notes = _with_depth(image, root)
    _, turn_notes = turn_of(series.keyframe, is_applied=False)
    _, y, x = images[0].spacing_um
    size_notes = tag_notes(series.keyframe, (y, x), "PhysicalSize of the OME-XML")
    described = (*size_notes, *depth_notes, *turn_notes, *_type_notes(root, series.keyframe))
    notes = (*image.notes, *described, *_undescribed(tiff, chosen.others), *note_absent(pages))
    return replace(image, notes=notes, files=files_of(location, chain(*pages)))


def _with_depth(image: Image, root: ElementTree.Element) -> tuple[Image, tuple[str, ...]]:
    """Return the image with the depth of its voxels from the most trusted field, and notes."""
    finest = image.grids[0]
    z, y, x = finest.spacing_um or finest.partial_um
    stated = [] if z is None else [Statement(z, "PhysicalSizeZ")]
    depth, notes = settle_depth(root, stated)
    return replace(image, grids=(grid_of(finest.shape, (depth, y, x)), *image.grids[1:])), notes


def _type_notes(root: ElementTree.Element, page: TiffPage) -> tuple[str, ...]:
    """Return a note if the OME-XML and the tags of the pages state different voxels."""
    pixels = ome_xml.pixels_of(root)
    name = "" if pixels is None else pixels.get("Type", "")
    if not name or page.dtype is None:
        return ()
    tags = Statement(page.dtype.name, "the TIFF header")
    xml = Statement(_NUMPY_NAMES.get(name, name), "Type of Pixels", Trust.REPEATED)
    return settle(_VALUE_TYPE, [tags, xml]).notes


def _require_planes(
    location: Location, tiff: TiffFile, root: ElementTree.Element, levels: list[list[Any]]
) -> None:
    """Raise SourceError where planes are missing, or differ from those that the OME-XML names."""
    require_files(location, root, levels[0])
    for index, level in enumerate(levels):
        require_pages(f"{location.shown}: level {index}", tiff, level, len(level))
    with one_line(location.shown, "an OME-XML with whole numbers in TiffData"):
        require_described(location, root, levels[0])
    require_alike(location, levels[0])


def _undescribed(tiff: TiffFile, others: int) -> tuple[str, ...]:
    """Return a note on pages of the files that belong to no image of the OME-XML.

    others  number of planes of other images
    """
    pages = [page for one in tiff.series for page in one.pages if page is not None]
    described = len(pages) + others
    total = sum(len(file.pages) for file in {page.parent for page in pages})
    if total <= described:
        return ()
    return (
        f"the OME-XML describes {described} of {total} pages in the files; "
        f"{total - described} are left out ({(total - described) / total:.0%})",
    )


def _check_claims(where: str, tiff: TiffFile, text: str) -> None:
    """Raise SourceError where the OME-XML or the tags request more than any file holds."""
    sizes: dict[str, int] = {}
    for name, digits in _CLAIM.findall(text):
        most = _MAX_SIDE if name in ("SizeX", "SizeY") else MAX_PLANES
        if name == "SizeC":
            most = MAX_CHANNELS
        value = int(digits) if len(digits) < 20 else math.inf
        if value > most:
            raise SourceError(
                f"{where}: OME-XML: {name}: found {digits:.20}, expected at most {most}"
            )
        sizes[name] = max(sizes.get(name, 1), int(value))
    planes = math.prod(sizes.get(f"Size{axis}", 1) for axis in "ZCT")
    if planes > MAX_PLANES:
        raise SourceError(f"{where}: OME-XML: found {planes} planes, expected at most {MAX_PLANES}")
    tag = tiff.pages.first.tags.get(_SUB_IFDS)
    if tag is not None and tag.count > _MAX_LEVELS:
        raise SourceError(f"{where}: SubIFDs: found {tag.count}, expected at most {_MAX_LEVELS}")


def _image(
    where: str,
    images: list[OmeImage],
    arrays: list[VoxelArray],
    *,
    page: TiffPage,
    stack: ExitStack,
) -> Image:
    if not images:
        raise SourceError(f"{where}: OME-XML: found no Image, expected one")
    arrays, names, colors, notes = samples_as_channels(where, arrays, page)
    require_depth(where, arrays[0])
    first, count = images[0], len(names) or arrays[0].size("c")
    unnamed = [None] * (count - len(first.names))
    return Image(
        tuple(arrays),
        (
            grid_of(arrays[0].shape, first.spacing_um),
            *(Grid(level.shape) for level in arrays[1:]),
        ),
        names or (*first.names[:count], *unnamed),
        colors or (*first.colors[:count], *unnamed),
        1,
        stack.close,
        notes=notes,
    )
