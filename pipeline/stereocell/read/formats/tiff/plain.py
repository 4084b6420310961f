"""Read TIFF without OME-XML: pages of one size, and the metadata of ImageJ, Zeiss and others.

tifffile knows these kinds of file and names the axes of each. Pages whose meaning is not stated
count as slices along z, and a note says so. Only the file can state time and channels, with one
exception: of two unknown axes, a short one is read as channels.
"""

from collections.abc import Sequence
from contextlib import ExitStack
from math import prod

from tifffile import TiffFile, TiffPageSeries

from stereocell.model.errors import SourceError
from stereocell.read.dataset import VoxelArray
from stereocell.read.formats.tiff.arrays import (
    FirstAlong,
    array_of,
    notes_of,
    require_depth,
    samples_as_channels,
    with_given_axes,
)
from stereocell.read.formats.tiff.ndtiff import index_of, with_index
from stereocell.read.formats.tiff.open_file import (
    MAX_PLANES,
    files_of,
    note_absent,
    open_tiff,
    refuse_short,
    require_series,
)
from stereocell.read.formats.tiff.orientation import turn_of
from stereocell.read.formats.tiff.page_tags import require_same_tags
from stereocell.read.formats.tiff.stated import Stated, stated_by
from stereocell.read.image import MAX_CHANNELS, Image
from stereocell.read.spacing import Grid, grid_of
from stereocell.read.turn import turned_image
from stereocell.read.value_scale import ScaledArray
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_UNKNOWN = "qio"  # tifffile's axes for sequences, images and other pages
_PLACES = {"r": "positions", "p": "positions", "m": "mosaic tiles", "v": "views"}
_MAX_CHANNELS = 10  # length up to which one of two unknown axes is read as channels
_IMAGEJ_AXES = ("channels", "slices", "frames")
_EXPECTED = "a TIFF of planes of one size"


def read_plain(location: Location, tiff: TiffFile, stack: ExitStack, axes: str) -> Image:
    """Return the largest image of an open TIFF. Raises SourceError, and UsageError for the axes.

    axes  letters of the axes longer than 1, slowest first; empty: the file's own, or a guess
    """
    where = location.shown
    with one_line(where, _EXPECTED):
        tiff, indexed = with_index(location, tiff, stack)
        _require_imagej_whole(where, tiff)
        found = list(tiff.series)
        if _are_planes(found):
            tiff = open_tiff(location, stack, is_shaped=False)
            found = list(tiff.series)
    if not found:
        raise SourceError(f"{where}: found no image, expected pages")
    series = max(found, key=lambda one: one.size)  # the first of equally large ones
    with one_line(where, _EXPECTED):
        for level in series.levels:
            require_series(where, tiff, level)
            if location.is_local:  # at an address each directory would need one more request
                require_same_tags(where, tiff, level.pages)
        arrays = [array_of(series, index) for index in range(len(series.levels))]
        page = series.keyframe
        stated = stated_by(tiff, page)
        files = files_of(location, (page for level in series.levels for page in level.pages))
        absent = note_absent(level.pages for level in series.levels)
        if series.kind == "ndtiff":
            files += (index_of(location),)
        notes = _undescribed(tiff, found)
    # the other images of LSM are thumbnails
    notes += [] if series.kind == "lsm" else _left_out(found, series)
    arrays, more = _at_first_place(arrays)
    notes += more
    if axes:
        arrays = with_given_axes(where, arrays, axes)
    else:
        arrays, more = _with_axes(where, arrays)
        notes += more
    arrays, names, colors, sample_notes = samples_as_channels(where, arrays, page)
    notes += [*sample_notes, *notes_of(page), *absent]
    require_depth(where, arrays[0])
    count = len(names) or arrays[0].size("c")
    if count > MAX_CHANNELS or arrays[0].size("z") * arrays[0].size("t") > MAX_PLANES:
        raise SourceError(
            f"{where}: found {count} channels and {arrays[0].size('z')} planes at each of "
            f"{arrays[0].size('t')} time points, expected at most {MAX_CHANNELS} and {MAX_PLANES}"
        )
    arrays, more = _calibrated(arrays, stated)
    notes += more
    unstated = (None,) * count
    shape = arrays[0].shape
    turn, turn_notes = turn_of(page)
    image = Image(
        tuple(arrays),
        (
            grid_of(shape, stated.spacing_um, stated.hint),
            *(Grid(level.shape) for level in arrays[1:]),
        ),
        names or (*(stated.names or indexed), *unstated)[:count],
        colors or (*stated.colors, *unstated)[:count],
        1,
        stack.close,
        notes=(*notes, *turn_notes),
        files=files,
    )
    return turned_image(image, turn)


def _calibrated(arrays: list[VoxelArray], stated: Stated) -> tuple[list[VoxelArray], list[str]]:
    """Return arrays with the values that the file's scale defines, and notes."""
    if not stated.values.is_plain:
        arrays = [VoxelArray(ScaledArray(one.array, stated.values), one.axes) for one in arrays]
    return arrays, list(stated.notes)


def _are_planes(found: Sequence[TiffPageSeries]) -> bool:
    """Return whether a program wrote a stack with tifffile plane by plane, each as one array."""
    first = found[0] if found else None
    return (
        first is not None
        and len(found) > 1
        and all(
            one.kind == "shaped" and len(one.pages) == 1
            and (one.shape, one.dtype) == (first.shape, first.dtype)
            for one in found
        )
    )  # fmt: skip


def _left_out(found: Sequence[TiffPageSeries], chosen: TiffPageSeries) -> list[str]:
    """Return a note on the images that are not built; it names one of the same size, if any."""
    others = [one for one in found if one is not chosen]
    if not others:
        return []
    count = f"{len(others)} other image{'s' * (len(others) > 1)} in the file left out"
    alike = [one for one in others if one.size == chosen.size]
    if not alike:
        return [f"{count}: the largest is built"]
    pages = sum(len(one.pages) for one in others)
    return [
        f"{count} ({pages} of {pages + len(chosen.pages)} pages): the first of the largest is "
        f"built, {kind_of(chosen)}, not {kind_of(alike[0])}"
    ]


def _undescribed(tiff: TiffFile, found: Sequence[TiffPageSeries]) -> list[str]:
    """Return a note on pages that belong to no image, if the file's description counts fewer."""
    largest = max(found, key=lambda one: one.size)
    if largest.kind == "ndtiff":  # ndtiff.py has compared the pages with the index
        return []
    levels, total = [level for one in found for level in one.levels], len(tiff.pages)
    if largest.kind == "lsm":  # every second page is a thumbnail
        levels, total = [largest], len(largest)
    described = sum(level.size // max(level.keyframe.size, 1) for level in levels)
    if described >= total:
        return []
    share = (total - described) / total
    return [
        f"the file's description counts {described} of {total} pages: the others are left out "
        f"({share:.0%})"
    ]


def _require_imagej_whole(where: str, tiff: TiffFile) -> None:
    """Raise SourceError where planes are missing that ImageJ's description counts.

    The description states the number of planes, and usually the axes too, which must agree with it.
    """
    meta = tiff.imagej_metadata if tiff.is_imagej else None
    if not meta:
        return
    sizes = [meta.get(key, 1) for key in _IMAGEJ_AXES]
    if not all(isinstance(size, int) and 0 < size <= MAX_PLANES for size in sizes):
        raise SourceError(
            f"{where}: ImageJ's description: found {sizes!r:.80} channels, slices and frames, "
            f"expected whole numbers from 1 to {MAX_PLANES}"
        )
    page = tiff.pages.first
    planes = max(sizes[0] // page.samplesperpixel, 1) * sizes[1] * sizes[2]
    images = meta.get("images", planes)
    if any(key in meta for key in _IMAGEJ_AXES) and images not in (planes, prod(sizes)):
        stated = " x ".join(f"{meta[key]} {key}" for key in _IMAGEJ_AXES if key in meta)
        raise SourceError(
            f"{where}: ImageJ's description: found images={images!s:.20} and {stated}, expected "
            "the same number of planes (copy or download the file again, or save it in ImageJ)"
        )
    if planes > len(tiff.pages) and page.is_final and page.dataoffsets:
        end = page.dataoffsets[0] + planes * page.nbytes
        if end > tiff.filehandle.size:
            refuse_short(where, tiff.filehandle.size, end)


def _at_first_place(arrays: list[VoxelArray]) -> tuple[list[VoxelArray], list[str]]:
    """Return the arrays at the first of several positions, and notes."""
    notes = []
    for axis, noun in _PLACES.items():
        count = arrays[0].size(axis)
        if count > 1:
            notes.append(f"{count} {noun} in the file: the first is built")
            arrays = [_first_along(level, axis) for level in arrays]
    return arrays, notes


def _first_along(level: VoxelArray, axis: str) -> VoxelArray:
    place = level.axes.index(axis)
    axes = (*level.axes[:place], *level.axes[place + 1 :])
    return VoxelArray(FirstAlong(level.array, place), axes)


def _with_axes(where: str, arrays: list[VoxelArray]) -> tuple[list[VoxelArray], list[str]]:
    """Return the arrays with unknown axes named z or c, and a note."""
    axes = arrays[0].axes
    known = [axis for axis in axes if axis not in _UNKNOWN]
    unknown = [place for place, axis in enumerate(axes) if axis in _UNKNOWN]
    if not unknown and len(set(known)) == len(known):
        return arrays, []
    lengths = [int(arrays[0].array.shape[place]) for place in unknown]
    guessed = _guess_axes(axes, lengths) if len(set(known)) == len(known) else None
    if guessed is None:
        shape = ", ".join(str(n) for n in arrays[0].array.shape)
        raise SourceError(
            f"{where}: axes: found {''.join(axes).upper()} of {shape}, expected pages whose axes "
            "are named by the file (ImageJ, OME-TIFF), or by --axes, such as zcyx"
        )
    names = dict(zip(unknown, guessed, strict=True))
    renamed = tuple(names.get(place, axis) for place, axis in enumerate(axes))
    nouns = {"z": "slices along z", "c": "channels", "t": "time points"}
    meaning = " of ".join(
        f"{length} {nouns[axis]}" for length, axis in zip(lengths, guessed, strict=True)
    )
    note = f"the file doesn't state what its pages are: read as {meaning}"
    return [VoxelArray(level.array, renamed) for level in arrays], [note]


def _guess_axes(axes: Sequence[str], lengths: list[int]) -> str | None:
    """Return the axes that the unknown ones are read as, one letter each; None: no guess."""
    if len(lengths) == 1:
        return next((axis for axis in "zct" if axis not in axes), None)
    if len(lengths) > 2 or "z" in axes or "c" in axes:
        return None
    first, second = lengths
    if min(first, second) > _MAX_CHANNELS or first == second:
        return None
    return "cz" if first < second else "zc"


def kind_of(series: TiffPageSeries) -> str:
    """Return a description of a series for messages: `imagej, ZYX of 5 x 64 x 64, uint16`."""
    shape = " x ".join(str(n) for n in series.shape)
    return f"{series.kind}, {series.axes} of {shape}, {series.dtype}"
