"""Open a source: find its format, read its metadata, check that it is a volume we can build."""

import math
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import fsspec
import numpy as np

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.cast import TAKEN, built_dtype, cast_note
from stereocell.read.dataset import ChannelInfo, Dataset, VoxelArray
from stereocell.read.file_kind import require_kind
from stereocell.read.image import Image
from stereocell.read.spacing import Triple, levels_of
from stereocell.storage.first_bytes import describe
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import ANSWER_S, Location, does_answer, first_bytes, require_own

_SURFACES = (".gii", ".gii.gz", ".stl", ".obj", ".ply", ".vtp")  # GIFTI and the like
_PICTURES = (".png", ".jpg", ".jpeg")  # which are planes of a folder
_VOXELS, _HEADERS = (".raw", ".zraw", ".bin"), (".mhd", ".nhdr")  # of MetaImage and NRRD
MAX_CHUNK_BYTES = 4 << 30  # largest chunk in bytes: a chunk is decoded whole


@dataclass(frozen=True, slots=True)
class Reader:
    """One format: its names, and the module whose `read_image(location) -> Image` reads it.

    title       the format's usual name
    has_series  one source may hold several images: `read_image(location, series=1)`
    has_pattern names of files tell what they hold: `read_image(location, pattern="a_z{z}.tif")`
    has_axes    a source may not name its axes: `read_image(location, axes="czyx")`
    is_remote   it is read from an address, too
    """

    module: str
    title: str
    has_series: bool = False
    has_pattern: bool = False
    has_axes: bool = False
    is_remote: bool = False

    def read_image(
        self, location: Location, *, series: int = 0, pattern: str = "", axes: str = ""
    ) -> Image:
        """Return the image of a source. Raises UsageError for an option that it doesn't take."""
        given: dict[str, Any] = {}
        for name, value in (("series", series), ("pattern", pattern), ("axes", axes)):
            if getattr(self, f"has_{name}"):
                given[name] = value
            elif value:
                raise _not_taken(location, self, name, str(value))
        # imported on use: each import takes up to 2 s, and a process needs one
        image: Image = import_module(self.module).read_image(location, **given)
        return image


READERS = {
    "ome-zarr": Reader("stereocell.read.ome_zarr", "OME-Zarr", has_axes=True, is_remote=True),
    "tiff": Reader("stereocell.read.tiff", "TIFF", has_axes=True, is_remote=True),
    "planes": Reader(
        "stereocell.read.planes",
        "a folder of TIFF, PNG or JPEG planes",
        has_series=True,
        has_pattern=True,
    ),
    "dicom": Reader("stereocell.read.dicom", "DICOM (a file or a folder)", has_series=True),
    "nifti": Reader("stereocell.read.nifti", "NIfTI or Analyze"),
    "ims": Reader("stereocell.read.ims", "Imaris"),
    "hdf5": Reader("stereocell.read.hdf5", "HDF5 (NAME.h5:/KEY)", has_axes=True),
    "n5": Reader("stereocell.read.n5", "N5", has_axes=True, is_remote=True),
    "bdv": Reader("stereocell.read.bdv", "BigDataViewer's XML"),
    "nrrd": Reader("stereocell.read.nrrd", "NRRD"),
    "metaimage": Reader("stereocell.read.metaimage", "MetaImage"),
    "mrc": Reader("stereocell.read.mrc", "MRC"),
    "czi": Reader("stereocell.read.czi", "CZI", has_series=True),
    "lif": Reader("stereocell.read.lif", "LIF", has_series=True),
    "nd2": Reader("stereocell.read.nd2", "ND2", has_series=True),
}
# a file that no reader above knows is given to this one, which takes what bioio's plugins do
OTHER = Reader(
    "stereocell.read.bioio_image", "a file for an installed plugin of bioio", has_series=True
)


def reader_of(source: str | Path) -> str:
    """Return the dotted name of the module that reads a source."""
    return READERS.get(Location.of(source).format or "", OTHER).module


def _find(source: str | Path) -> tuple[Location, Reader]:
    """Return the place of a source that is there, and the reader of its format."""
    location = Location.of(source)
    if location.is_local and not Path(location.path).exists():
        if os.path.islink(location.path):
            target = os.readlink(location.path)
            raise SourceError(
                f"{location.shown}: a link to {_shown(target):.200}, which isn't there, expected "
                "a file or a folder"
            )
        raise SourceError(f"{location.shown}: not found, expected a file or a folder")
    if location.is_local and not Path(location.path).is_dir():
        require_own(location.path, [location.folder], named=location.shown)
    named = location.format
    if named is None and not import_module(OTHER.module).can_read(location):
        raise _unknown(location)
    reader = READERS.get(named or "", OTHER)
    require_kind(location, named or "", reader.title.partition(" (")[0])
    if not location.is_local and not reader.is_remote:
        raise SourceError(
            f"{location.shown}: {reader.title} at an address, expected a path on this machine: "
            "copy it here first"
        )
    if not location.is_local:
        with one_line(location.shown, "an address that fsspec opens"):
            files, path = fsspec.url_to_fs(location.source, **location.storage_options)
        if not does_answer(files, path):
            raise SourceError(
                f"{location.shown}: no answer within {ANSWER_S:g} s, expected a store that is up"
            )
    return location, reader


def _unknown(location: Location) -> SourceError:
    """Return the error of a source of no known format, which says what it is instead."""
    last = location.parts[-1].lower() if location.parts else ""
    found = "unknown format"
    if last.endswith(_SURFACES):
        found = "a surface (mesh), no volume"
    elif header := _header_beside(location):
        return SourceError(
            f"{location.shown}: found the voxels of {_shown(header):.200}, expected that file"
        )
    elif location.is_local:
        content = describe(first_bytes(location.source))
        if last.endswith(_PICTURES) and content.endswith(" image"):
            return SourceError(
                f"{location.shown}: one plane (2D): found {content}, expected a volume: name the "
                "folder of its planes"
            )
        found += f": found {content}"
    formats = ", ".join(reader.title for reader in READERS.values())
    return SourceError(f"{location.shown}: {found}; expected {formats}, or {OTHER.title}")


def _header_beside(location: Location) -> str:
    """Return the name of the header beside a file of bare voxels; empty: there is none."""
    path = Path(location.path)
    if not location.is_local or path.suffix.lower() not in _VOXELS:
        return ""
    beside = (path.with_suffix(suffix) for suffix in _HEADERS)
    return next((header.name for header in beside if header.is_file()), "")


def _not_taken(location: Location, reader: Reader, option: str, value: str) -> UsageError:
    """Return the error of an option that a format doesn't take; it names those that do."""
    takers = [one.title for one in (*READERS.values(), OTHER) if getattr(one, f"has_{option}")]
    return UsageError(
        f"{location.shown}: --{option} {value}: found {reader.title}, expected "
        f"{', '.join(takers)}, or no --{option}"
    )


def open(
    source: str | Path,
    *,
    time: int = 0,
    spacing_um: Triple | None = None,
    series: int = 0,
    pattern: str = "",
    axes: str = "",
) -> Dataset:
    """Open a source of any format of READERS.

    source      a local path or, where the format's Reader says so, an address (`http://`,
                `https://`, `s3://`, or another one that fsspec knows)
    time        time point, from 0
    spacing_um  (z, y, x), um; replaces the voxel spacing that the source states
    series      series of DICOM or of planes, or image of a file of several, from 1 as
                `list_series` counts; 0: the largest
    pattern     how the files of a folder of planes are named, as `img_c{c}_z{z}.tif`; empty:
                guessed
    axes        letters of an array's axes, or of those longer than 1, as `czyx`, slowest first;
                empty: as the source names them

    No voxels are read yet, with two exceptions: DICOM slices at the same place, to detect copies,
    and floats of NIfTI, to count NaN. Raises SourceError where the source can't be read as a
    volume (one line: the found value, its place, the expected value), UsageError where the source
    lacks the time point or the series, or where `spacing_um` is no length.

        dataset = open("head.ome.zarr")
        volume = dataset.read(0, Box((0, 0, 0), (64, 64, 64)))
    """
    location, reader = _find(source)
    image = reader.read_image(location, series=series, pattern=pattern, axes=axes)
    try:
        return _dataset(location, image, time, spacing_um)
    except BaseException:
        if image.close is not None:
            image.close()
        raise


def _dataset(location: Location, image: Image, time: int, spacing_um: Triple | None) -> Dataset:
    where = location.shown
    finest = image.arrays[0]
    _check_arrays(where, image)
    if not 0 <= time < finest.size("t"):
        raise UsageError(
            f"{where}: --time: found {time}, expected 0 to {finest.size('t') - 1} "
            f"(the source holds {finest.size('t')} time points)"
        )
    given = [_shown(name or "") for name in image.names]
    channels = map(ChannelInfo, _unique(given), image.colors, map(bool, given))
    return Dataset(
        source=location.source,
        name=image.title or _shown(location.name) or "dataset",
        dtype=built_dtype(finest.array.dtype) or np.dtype(finest.array.dtype),
        levels=levels_of(image.grids, spacing_um, where),
        channels=tuple(channels),
        time_points=finest.size("t"),
        time=time,
        images=image.images,
        arrays=image.arrays,
        shown=where,
        on_close=image.close,
        modality=image.modality,
        placement=image.placement,
        has_sides=image.has_sides,
        remarks=(
            *map(_shown, image.notes),  # which may name files
            *filter(None, [cast_note(finest.array.dtype)]),
            *(image.notes_at(time) if image.notes_at is not None else ()),
        ),
        acquired=image.acquired,
        labels=image.labels,
        objects=image.objects,
        offset_um=image.grids[0].offset_um or (0.0, 0.0, 0.0),
    )


def list_series(source: str | Path) -> tuple[str, ...]:
    """Return a line for each image of a source of several; line i describes `series` = i.

    A line holds modality, orientation, size and spacing, and no description from the files.
    Raises SourceError where the source can't be read, UsageError where it has another format.
    """
    location, reader = _find(source)
    if not reader.has_series:
        raise _not_taken(location, reader, "series", "list")
    lines: tuple[str, ...] = import_module(reader.module).list_series(location)
    return lines


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
            found = min(-(-100 * bytes_of_one >> 30), 10**20) / 100  # up, so that it is more
            raise SourceError(
                f"{where}: chunk {level.array.chunks} of level {index}: found {found:g} GiB, "
                f"expected at most {MAX_CHUNK_BYTES >> 30} GiB"
            )
    if finest.shape[0] < 2:
        raise SourceError(
            f"{where}: one plane (2D): a volume needs at least 2 planes: found "
            f"{finest.shape[0]} along z"
            f"{_beside(finest)}; expected a stack, or a folder of planes (name the folder)"
        )


def _beside(flat: VoxelArray) -> str:
    """Return the words for the axes that a flat image has beside y and x."""
    counts = [(flat.size("c"), "channels"), (flat.size("t"), "points in time")]
    found = " and ".join(f"{count} {noun}" for count, noun in counts if count > 1)
    return f" (a flat image of {found})" if found else ""


def _shown(name: str) -> str:
    """Return a name without unprintable characters (controls, NUL, line ends)."""
    if name.isprintable():
        return name
    return " ".join("".join(c if c.isprintable() else " " for c in name).split())


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
