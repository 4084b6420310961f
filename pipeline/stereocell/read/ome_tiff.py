"""OME-TIFF, by bioio (metadata) and tifffile (pixels).

bioio's reader parses the OME-XML (ome-types). Its pixels are not used: it reads level 0 only
(it leaves out sub-resolutions, in SubIFDs), reads a whole page for each window, and opens the file
anew for each page. tifffile, its own foundation, serves every level as a Zarr array of the file's
strips or tiles.

References: https://docs.openmicroscopy.org/ome-model/latest/ome-tiff/specification.html
"""

import logging
import math
import os
import re
import warnings
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import Any
from xml.etree import ElementTree

import fsspec
import zarr
from bioio_ome_tiff import Reader
from tifffile import TiffFile, TiffFrame, TiffPage, TiffPageSeries

from stereocell.model.errors import SourceError
from stereocell.read.dataset import VoxelArray
from stereocell.read.image import MAX_CHANNELS, Color, Image, linear_color
from stereocell.read.spacing import Grid, Triple, um_per
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
            _check_claims(where, tiff)
            _check_files(location, tiff)
            with warnings.catch_warnings():  # about invalid values: they become errors below
                warnings.simplefilter("ignore")
                reader = Reader(location.source, fs_kwargs=location.storage_options)
                images = reader.ome_metadata.images
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
        return _image(where, images, arrays, stack.close)
    except BaseException:
        stack.close()
        raise


def _check_claims(where: str, tiff: TiffFile) -> None:
    """Raise SourceError where the OME-XML or the tags request more than any file holds."""
    text = tiff.pages.first.description  # bioio parses it, even where tifffile finds no OME-XML
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise SourceError(f"{where}: OME-XML: found a DOCTYPE, expected none")
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


def _check_files(location: Location, tiff: TiffFile) -> None:
    """Raise SourceError where the OME-XML refers to a file outside the source's folder.

    This runs before tifffile opens these files. For a remote source tifffile opens none.
    """
    if not location.is_local or not tiff.ome_metadata:
        return
    root = ElementTree.fromstring(tiff.ome_metadata)
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


def _image(
    where: str, images: list[Any], arrays: list[VoxelArray], close: Callable[[], None]
) -> Image:
    if not images:
        raise SourceError(f"{where}: OME-XML: found no Image, expected one")
    samples = arrays[0].size("s")
    if samples > 1:
        raise SourceError(
            f"{where}: SamplesPerPixel: found {samples}, expected 1 (channels as planes, not RGB)"
        )
    pixels = images[0].pixels
    count = arrays[0].size("c")
    unnamed = [None] * (count - len(pixels.channels))
    channels = pixels.channels[:count]
    return Image(
        tuple(arrays),
        (Grid(arrays[0].shape, _spacing(pixels)), *(Grid(level.shape) for level in arrays[1:])),
        (*((channel.name or "").strip() or None for channel in channels), *unnamed),
        (*(_color(channel) for channel in channels), *unnamed),
        len(images),
        close,
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


def _spacing(pixels: Any) -> Triple | None:
    lengths = []
    for axis in "zyx":
        size = getattr(pixels, f"physical_size_{axis}")
        unit = getattr(pixels, f"physical_size_{axis}_unit")
        um = um_per(unit.value)
        if size is None or um is None:
            return None
        lengths.append(float(size) * um)
    z, y, x = lengths
    return z, y, x


def _color(channel: Any) -> Color | None:
    if "color" not in channel.model_fields_set:
        return None  # ome-types fills in white
    red, green, blue = channel.color.as_rgb_tuple(alpha=False)
    return linear_color((red, green, blue))
