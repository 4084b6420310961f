"""Open a source: read its metadata with its format's reader and check that it can be built."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.cast import TAKEN, built_dtype
from stereocell.read.dataset import ChannelInfo, Dataset, VoxelArray
from stereocell.read.image import Image, printable
from stereocell.read.inverted_array import InvertedArray
from stereocell.read.level_spacing import settle_levels
from stereocell.read.plausible_size import ratio_notes
from stereocell.read.readers import find_reader, read_image
from stereocell.read.remarks import cast_note
from stereocell.read.repeats import collected
from stereocell.read.source_place import name_of
from stereocell.read.spacing import Triple, levels_of
from stereocell.storage.library_errors import library_boundary
from stereocell.storage.location import Location

MAX_CHUNK_BYTES = 4 << 30  # bytes; largest chunk that is accepted, because a chunk is decoded whole


def open(
    source: str | Path,
    *,
    time: int = 0,
    spacing_um: Triple | None = None,
    series: int = 0,
    pattern: str = "",
    axes: str = "",
    dark: bool = False,
) -> Dataset:
    """Open a source of any format that is read (`read/formats`).

    source      a local path or, where the format's row says so, an address (`http://`,
                `https://`, `s3://`, or another one that fsspec knows)
    time        time point, from 0
    spacing_um  (z, y, x), um; replaces the voxel spacing that the source states
    series      series of DICOM or of planes, or image of a file that holds several; counted from 1
                as `list_series` does; 0: the largest
    pattern     how the files of a folder of planes are named, such as `img_c{c}_z{z}.tif`; empty:
                the names are guessed from the files
    axes        letters of all axes of an array, or of its axes longer than 1, slowest first, such
                as `czyx`; empty: as the source names them
    dark        whether structures are darker than their surroundings: then all values are inverted
                (`InvertedArray`), so that structures are bright

    No voxels are read yet, with two exceptions: DICOM slices at the same place, to detect copies,
    and floating-point NIfTI, to count NaN. Raises SourceError where the source can't be read as a
    volume (one line: the found value, its place, the expected value). Raises UsageError where the
    source lacks the time point or the series, or where `spacing_um` isn't three positive lengths.

    >>> import tempfile, tifffile
    >>> stated = {"axes": "ZYX", "PhysicalSizeZ": 2, "PhysicalSizeY": 0.5, "PhysicalSizeX": 0.5}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     source = f"{folder}/stack.ome.tif"
    ...     tifffile.imwrite(source, np.zeros((8, 16, 24), np.uint16), metadata=stated)
    ...     dataset = open(source)
    >>> dataset.levels[0].shape, dataset.levels[0].spacing_um
    ((8, 16, 24), (2.0, 0.5, 0.5))
    """
    location, format = find_reader(source)
    with library_boundary(location.shown, f"a complete source ({format.short_title})"):
        with collected() as repeats:
            image = read_image(location, format, series=series, pattern=pattern, axes=axes)
        notes = (note for _, note in sorted(repeats.items()))
        image = replace(image, notes=(*image.notes, *notes))
        try:
            image = _at_time(location.shown, image, time)
            if dark:
                image = _inverted(image)
            return _dataset(location, image, time, spacing_um)
        except BaseException:
            if image.close is not None:
                image.close()
            raise


def _dataset(location: Location, image: Image, time: int, spacing_um: Triple | None) -> Dataset:
    where = location.shown
    finest = image.arrays[0]
    _check_arrays(where, image)
    grids, level_notes = settle_levels(image.grids)
    levels = levels_of(grids, spacing_um, where)
    if spacing_um is None:
        level_notes += ratio_notes(levels[0].spacing_um, image.acquired.axis)
    given = [printable(name or "") for name in image.names]
    channels = map(ChannelInfo, _unique(given), image.colors, map(bool, given))
    return Dataset(
        source=location.source,
        name=image.title or printable(name_of(location)) or "dataset",
        dtype=built_dtype(finest.array.dtype) or np.dtype(finest.array.dtype),
        levels=levels,
        channels=tuple(channels),
        time_points=finest.size("t"),
        time=time,
        images=image.images,
        arrays=image.arrays,
        shown=where,
        on_close=image.close,
        modality=image.modality,
        has_hounsfield_units=image.has_hounsfield_units,
        placement=image.placement,
        has_sides=image.has_sides,
        remarks=(
            *map(printable, image.notes),  # notes may quote names of files
            *level_notes,
            *filter(None, [cast_note(finest.array.dtype)]),
            *(image.notes_at(time) if image.notes_at is not None else ()),
        ),
        acquired=image.acquired,
        files=image.files or (location.path if location.is_local else location.source,),
        labels=image.labels,
        objects=image.objects,
        offset_um=image.grids[0].offset_um or (0.0, 0.0, 0.0),
    )


def _at_time(where: str, image: Image, time: int) -> Image:
    """Return the image at one time point. Raises UsageError where that time point is missing."""
    count = image.arrays[0].size("t")
    if not 0 <= time < count:
        raise UsageError(
            f"{where}: --time: found {time}, expected 0 to {count - 1} "
            f"(the source holds {count} time points)"
        )
    return image if image.at_time is None else image.at_time(image, time)


def _inverted(image: Image) -> Image:
    """Return an image whose dark voxels are bright, with a note on its values."""
    dtype = np.dtype(image.arrays[0].array.dtype)
    values = f"{np.iinfo(dtype).max} minus" if dtype.kind == "u" else "the negative of"
    if dtype.kind == "i":
        values = "-1 minus"
    note = f"voxels are inverted (--dark): each is {values} the value in the file"
    arrays = tuple(VoxelArray(InvertedArray(one.array), one.axes) for one in image.arrays)
    return replace(image, arrays=arrays, notes=(*image.notes, note))


def _check_arrays(where: str, image: Image) -> None:
    finest = image.arrays[0]
    for index, level in enumerate(image.arrays):
        dtype = np.dtype(level.array.dtype)
        if built_dtype(dtype) is None or dtype != np.dtype(finest.array.dtype):
            expected = f"{', '.join(TAKEN)} or another real number type, the same in all levels"
            raise SourceError(
                f"{where}: dtype of level {index}: found {dtype.name}, expected {expected}"
            )
        if any(level.size(axis) != finest.size(axis) for axis in "tc"):
            raise SourceError(
                f"{where}: level {index}: found {level.size('t')} time points and "
                f"{level.size('c')} channels, expected {finest.size('t')} and {finest.size('c')} "
                "as in level 0"
            )
        extra = {a: level.size(a) for a in level.axes if a not in "tczyx" and level.size(a) > 1}
        for axis, size in extra.items():
            raise SourceError(
                f"{where}: axis {axis!r} of length {size}, expected only t, c, z, y and x"
            )
        bytes_of_one = math.prod(int(n) for n in level.array.chunks) * dtype.itemsize
        if bytes_of_one > MAX_CHUNK_BYTES:
            # rounded up, so that the message never shows the limit itself
            found = min(-(-100 * bytes_of_one >> 30), 10**20) / 100
            raise SourceError(
                f"{where}: chunk {level.array.chunks} of level {index}: found {found:g} GiB, "
                f"expected at most {MAX_CHUNK_BYTES >> 30} GiB"
            )
    if finest.shape[0] < 2:
        raise SourceError(
            f"{where}: one plane (2D): a volume needs at least 2 planes: found "
            f"{finest.shape[0]} along z"
            f"{_beside(finest)}, expected a stack, or a folder of planes (name the folder)"
        )


def _beside(flat: VoxelArray) -> str:
    """Return the words for the channels and time points of a flat image; empty: one of each."""
    counts = [(flat.size("c"), "channels"), (flat.size("t"), "time points")]
    found = " and ".join(f"{count} {noun}" for count, noun in counts if count > 1)
    return f" (a flat image of {found})" if found else ""


def _unique(names: Sequence[str]) -> list[str]:
    """Fill in missing names and number equal ones (a marker imaged in every cycle).

    Names that differ by case alone count as equal: on Windows and macOS their files would be one.
    """
    filled = list(names)
    for index in (i for i, name in enumerate(names) if not name):
        filled[index] = f"Channel{index}"
        while filled[index] in names:
            filled[index] += "_"
    while len(count := Counter(name.lower() for name in filled)) < len(filled):
        filled = [
            f"{name} (channel {index})" if count[name.lower()] > 1 else name
            for index, name in enumerate(filled)
        ]
    return filled
