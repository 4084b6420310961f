"""Open a source: find its format, read its metadata, check that it is a volume we can build."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import fsspec
import numpy as np

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.dataset import ChannelInfo, Dataset
from stereocell.read.image import Image
from stereocell.read.spacing import Triple, levels_of
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import ANSWER_S, Location, does_answer, require_own

DTYPES = ("uint8", "uint16", "int16", "float32")
MAX_CHUNK_BYTES = 4 << 30  # largest chunk in bytes: a chunk is decoded whole


@dataclass(frozen=True, slots=True)
class Reader:
    """One format: its names, and the module whose `read_image(location) -> Image` reads it.

    title       the format's usual name
    example     a typical source, for messages
    has_series  one source may hold several volumes: `read_image(location, series)`
    has_axes    its arrays may not name their axes: `read_image(location, axes)`
    is_remote   it is read from an address, too
    """

    module: str
    title: str
    example: str
    has_series: bool = False
    has_axes: bool = False
    is_remote: bool = False

    def read_image(self, location: Location, series: int, axes: str) -> Image:
        """Return the image of a source; `series` and `axes` count where the format has them."""
        # imported on use: each import takes up to 2 s, and a process needs one
        read = import_module(self.module).read_image
        chosen = ((series,) if self.has_series else ()) + ((axes,) if self.has_axes else ())
        image: Image = read(location, *chosen)
        return image


READERS = {
    "ome-zarr": Reader(
        "stereocell.read.ome_zarr", "OME-Zarr", "NAME.zarr", has_axes=True, is_remote=True
    ),
    "ome-tiff": Reader("stereocell.read.ome_tiff", "OME-TIFF", "NAME.ome.tif", is_remote=True),
    "nifti": Reader("stereocell.read.nifti", "NIfTI or Analyze", ".nii, .nii.gz, .hdr"),
    "dicom": Reader(
        "stereocell.read.dicom", "DICOM", "a folder or a file, on this machine", has_series=True
    ),
    "ims": Reader("stereocell.read.ims", "Imaris", ".ims"),
    "hdf5": Reader("stereocell.read.hdf5", "HDF5", "NAME.h5:/KEY", has_axes=True),
    "n5": Reader("stereocell.read.n5", "N5", ".n5", has_axes=True, is_remote=True),
    "bdv": Reader("stereocell.read.bdv", "BigDataViewer", ".xml"),
    "nrrd": Reader("stereocell.read.nrrd", "NRRD", ".nrrd, .nhdr"),
    "metaimage": Reader("stereocell.read.metaimage", "MetaImage", ".mha, .mhd"),
    "mrc": Reader("stereocell.read.mrc", "MRC", ".mrc, .rec, .map"),
    "czi": Reader("stereocell.read.czi", "CZI", ".czi", has_series=True),
    "lif": Reader("stereocell.read.lif", "LIF", ".lif", has_series=True),
    "nd2": Reader("stereocell.read.nd2", "ND2", ".nd2", has_series=True),
}


# what a name that no reader knows is given to; it takes the formats of bioio's installed plugins
OTHER = Reader("stereocell.read.bioio_image", "what bioio reads", "any file", has_series=True)


def reader_of(source: str | Path) -> str:
    """Return the dotted name of the module that reads a source."""
    return READERS.get(Location.of(source).format or "", OTHER).module


def _is_read_by_bioio(location: Location) -> bool:
    return bool(import_module(OTHER.module).can_read(location))


def _no_series(location: Location, given: str) -> UsageError:
    titles = ", ".join(reader.title for reader in READERS.values() if reader.has_series)
    return UsageError(
        f"{location.shown}: --series {given}: expected a format of several images ({titles}), "
        "or no --series"
    )


def _formats() -> str:
    """Return all formats, each with an example, as a phrase for messages."""
    *others, last = (f"{reader.title} ({reader.example})" for reader in READERS.values())
    return f"{', '.join(others)} or {last}"


def open(
    source: str | Path,
    *,
    time: int = 0,
    spacing_um: Triple | None = None,
    series: int = 0,
    axes: str = "",
) -> Dataset:
    """Open a source of any format of READERS.

    source      a local path or, where the format's Reader says so, an address (`http://`,
                `https://`, `s3://`, or another one that fsspec knows)
    time        time point, from 0
    spacing_um  (z, y, x), um; replaces the voxel spacing that the source states
    series      series of DICOM, or image of a file of several, from 1 as `list_series` counts;
                0: the largest
    axes        the names of an array's dimensions, as `czyx`, where its format states none

    No voxels are read yet, with two exceptions: DICOM slices at the same place, to detect copies,
    and floats of NIfTI, to count NaN. Raises SourceError where the source can't be read as a
    volume (one line: the found value, its place, the expected value), UsageError where the source
    lacks the time point or the series, or where `spacing_um` is no length.

        dataset = open("head.ome.zarr")
        volume = dataset.read(0, Box((0, 0, 0), (64, 64, 64)))
    """
    location = Location.of(source)
    if location.is_local and not Path(location.path).exists():
        raise SourceError(f"{location.shown}: not found, expected a file or a folder")
    if location.is_local and not Path(location.path).is_dir():
        require_own(location.path, [location.folder], named=location.shown)
    if location.format is None and not _is_read_by_bioio(location):
        raise SourceError(
            f"{location.shown}: unknown format, expected {_formats()}; or what "
            "an installed plugin of bioio reads"
        )
    reader = READERS.get(location.format or "", OTHER)
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
    if series and not reader.has_series:
        raise _no_series(location, str(series))
    if axes and not reader.has_axes:
        raise UsageError(
            f"{location.shown}: --axes {axes}: {reader.title} names its axes, expected none"
        )
    image = reader.read_image(location, series, axes)
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
        dtype=np.dtype(finest.array.dtype).newbyteorder("="),
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
        remarks=(*image.notes, *(image.notes_at(time) if image.notes_at is not None else ())),
    )


def list_series(source: str | Path) -> tuple[str, ...]:
    """Return a line for each image of a source of several; line i describes `series` = i.

    A line holds modality, orientation, size and spacing, and no description from the files.
    Raises SourceError where the source can't be read, UsageError where it has another format.
    """
    location = Location.of(source)
    reader = READERS.get(location.format or "", OTHER)
    if not reader.has_series:
        raise _no_series(location, "list")
    lines: tuple[str, ...] = import_module(reader.module).list_series(location)
    return lines


def _check_arrays(where: str, image: Image) -> None:
    finest = image.arrays[0]
    for index, level in enumerate(image.arrays):
        dtype = np.dtype(level.array.dtype)
        if dtype.name not in DTYPES or dtype != np.dtype(finest.array.dtype):
            expected = ", ".join(DTYPES[:-1]) + f" or {DTYPES[-1]}, the same in all levels"
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
            f"{where}: a volume needs at least 2 planes: found {finest.shape[0]} along z"
        )


def _shown(name: str) -> str:
    """Return a name without unprintable characters (controls, NUL, line ends)."""
    if name.isprintable():
        return name
    return " ".join("".join(c if c.isprintable() else " " for c in name).split())


def _unique(names: Sequence[str]) -> list[str]:
    """Fill in missing names and number equal ones (a marker imaged in every cycle)."""
    filled = list(names)
    for index in (i for i, name in enumerate(names) if not name):
        filled[index] = f"Channel{index}"
        while filled[index] in names:
            filled[index] += "_"
    while len(set(filled)) < len(filled):
        count = Counter(filled)
        filled = [
            f"{name} (channel {index})" if count[name] > 1 else name
            for index, name in enumerate(filled)
        ]
    return filled
