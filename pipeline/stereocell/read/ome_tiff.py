"""OME-TIFF, by tifffile, which serves every level as a Zarr array of the file's strips or tiles.

bioio's reader, which stands on tifffile, is not used: it reads level 0 only (it leaves out
sub-resolutions, in SubIFDs), reads a whole page for each window, opens the file anew for each page,
refuses a file for a fault anywhere in its metadata, and takes 2 s to import.

References: https://docs.openmicroscopy.org/ome-model/latest/ome-tiff/specification.html
"""

import logging
import math
import os
import re
from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any
from xml.etree import ElementTree

import fsspec
import zarr
from tifffile import TiffFile, TiffFrame, TiffPage, TiffPageSeries

from stereocell.model.errors import SourceError
from stereocell.read import ome_xml
from stereocell.read.dataset import VoxelArray
from stereocell.read.image import MAX_CHANNELS, Image
from stereocell.read.ome_xml import OmeImage
from stereocell.read.spacing import Grid
from stereocell.storage.library_errors import collected_log, one_line
from stereocell.storage.location import Location, require_own

# Limits of the numbers in OME-XML and tags: the libraries allocate lists of such a length at once.
_MAX_PLANES = 1_000_000
_MAX_SIDE = 10_000_000  # voxels along an axis
_MAX_LEVELS = 64  # of the pyramid
_SUB_IFDS = 330  # TIFF tag SubIFDs: offsets of a page's coarser levels
_CLAIM = re.compile(r"""\b(Size[XYZCT]|PlaneCount|IFD)\s*=\s*["']\s*(\d+)""")
logging.getLogger("tifffile").addHandler(logging.NullHandler())  # errors are raised below
_REMOTE_BLOCK = 1 << 18  # bytes of a remote read; fsspec's default reads 5 MB ahead for every tile


def read_image(location: Location) -> Image:
    """Return the first image of the file. Raises SourceError where it can't be read as one."""
    where = location.shown
    stack = ExitStack()
    try:
        with (
            collected_log("tifffile") as log,
            one_line(where, "an OME-TIFF file, whole, with its OME-XML"),
        ):
            tiff = _open(location, stack)
            text = tiff.pages.first.description
            root = ome_xml.parse(text, where)
            _check_claims(where, tiff, text)
            _check_files(location, tiff, root)
            images = ome_xml.images_of(root, where)
            series = tiff.series[0]
            pages = [list(level.pages) for level in series.levels]
            arrays = [_array(series, index) for index in range(len(pages))]
        if series.kind != "ome":
            reason = f" ({log[-1]:.120})" if log else ""
            raise SourceError(
                f"{where}: planes don't match the OME-XML{reason}, expected a page for each plane"
            )
        for index, level in enumerate(pages):
            _check_whole(f"{where}: level {index}", tiff, level)
        return _image(where, images, arrays, stack)
    except BaseException:
        stack.close()
        raise


def _check_claims(where: str, tiff: TiffFile, text: str) -> None:
    """Raise SourceError where the OME-XML or the tags request more than any file holds."""
    sizes: dict[str, int] = {}
    for name, digits in _CLAIM.findall(text):
        most = _MAX_SIDE if name in ("SizeX", "SizeY") else _MAX_PLANES
        if name == "SizeC":
            most = MAX_CHANNELS
        value = int(digits) if len(digits) < 20 else math.inf
        if value > most:
            raise SourceError(
                f"{where}: OME-XML: {name}: found {digits:.20}, expected at most {most}"
            )
        sizes[name] = max(sizes.get(name, 1), int(value))
    planes = math.prod(sizes.get(f"Size{axis}", 1) for axis in "ZCT")
    if planes > _MAX_PLANES:
        raise SourceError(f"{where}: OME-XML: {planes} planes, expected at most {_MAX_PLANES}")
    tag = tiff.pages.first.tags.get(_SUB_IFDS)
    if tag is not None and tag.count > _MAX_LEVELS:
        raise SourceError(f"{where}: SubIFDs: found {tag.count}, expected at most {_MAX_LEVELS}")


def _check_files(location: Location, tiff: TiffFile, root: ElementTree.Element) -> None:
    """Raise SourceError where the OME-XML refers to a file outside the source's folder.

    This runs before tifffile opens these files. For a remote source tifffile opens none.
    """
    if not location.is_local:
        return
    names = {  # each once: every plane may name its file
        element.get("FileName"): None
        for element in root.iter()
        if element.tag.endswith("UUID") and element.text != root.get("UUID", "")
    }
    folder = location.folder
    for name in names:
        if name is not None:
            named = f"{location.shown}: OME-XML: UUID FileName {name!r:.200}"
            require_own(os.path.join(tiff.filehandle.dirname, name), [folder], named=named)


def _image(where: str, images: list[OmeImage], arrays: list[VoxelArray], stack: ExitStack) -> Image:
    if not images:
        raise SourceError(f"{where}: OME-XML: found no Image, expected one")
    samples = arrays[0].size("s")
    if samples > 1:
        raise SourceError(
            f"{where}: SamplesPerPixel: found {samples}, expected 1 (channels as planes, not RGB)"
        )
    first, count = images[0], arrays[0].size("c")
    unnamed = [None] * (count - len(first.names))
    return Image(
        tuple(arrays),
        (Grid(arrays[0].shape, first.spacing_um), *(Grid(level.shape) for level in arrays[1:])),
        (*first.names[:count], *unnamed),
        (*first.colors[:count], *unnamed),
        len(images),
        stack.close,
    )


def _open(location: Location, stack: ExitStack) -> TiffFile:
    """Open a file, without the formats whose index makes tifffile open other files."""
    if location.is_local:  # by path, so that the files of a set find each other
        return stack.enter_context(
            TiffFile(os.path.realpath(location.source), is_mmstack=False, is_ndtiff=False)
        )
    files, path = fsspec.url_to_fs(location.source, **location.storage_options)
    file = files.open(path, "rb", block_size=_REMOTE_BLOCK, cache_type="blockcache")
    stack.callback(file.close)
    return stack.enter_context(TiffFile(file, is_mmstack=False, is_ndtiff=False))


def _array(series: TiffPageSeries, level: int) -> VoxelArray:
    """Return a level's voxels. Axes of length 1 are squeezed out: tifffile 2026.5 requires it."""
    array = zarr.open_array(series.aszarr(level=level), mode="r")
    # tifffile's store is Zarr v3 from 2026.5 on, v2 before; each names the axes in its own way
    names: Any = getattr(array.metadata, "dimension_names", None)
    names = names or array.attrs["_ARRAY_DIMENSIONS"]
    return VoxelArray(array, tuple(str(name).lower() for name in names))


def _check_whole(where: str, tiff: TiffFile, pages: Sequence[TiffPage | TiffFrame | None]) -> None:
    """Raise SourceError for missing planes, which tifffile would read as zeros, or a short file."""
    present = [page for page in pages if page is not None]
    if len(present) < len(pages):
        raise SourceError(
            f"{where}: found {len(present)} planes, expected {len(pages)} "
            "(the file is cut short, or a file of the set is missing)"
        )
    size = tiff.filehandle.size
    for page in present:
        if page.parent is tiff and page.dataoffsets and page.databytecounts:
            end = max(a + b for a, b in zip(page.dataoffsets, page.databytecounts, strict=False))
            if end > size:
                raise SourceError(
                    f"{where}: found {size} bytes, expected at least {end} (the file is cut short)"
                )
