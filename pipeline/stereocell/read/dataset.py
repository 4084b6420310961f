"""A source's channels, levels and voxels. Voxels are read only on request."""

import difflib
import weakref
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import prod
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError, UsageError
from stereocell.model.identifiers import to_identifier
from stereocell.model.image_plane import find_slice_axis
from stereocell.model.object_notes import ObjectNotes
from stereocell.model.rigid_transform import IDENTITY, Matrix
from stereocell.model.spacing import Point
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.read.acquired import Acquired
from stereocell.read.cast import built_dtype, cast
from stereocell.read.fingerprint import fingerprint_of
from stereocell.read.remarks import choice_notes
from stereocell.read.spacing import Level
from stereocell.read.unmeasured import least_finite, share_of_gaps
from stereocell.storage.library_errors import one_line

__all__ = ["ChannelInfo", "Dataset", "Level", "VoxelArray"]


# voxels; largest level that is searched for the smallest value, the same limit as in a plan
MAX_SEARCHED = 2_000_000_000
MAX_VALUE = 1e30  # largest voxel value; squares and differences of larger ones overflow float32


@dataclass(frozen=True, slots=True)
class ChannelInfo:
    """One channel. `color` is linear RGB, 0..1, or None where the source states none.

    is_named  False: the source states no name, and the reader made one up (`Channel0`)
    """

    name: str
    color: tuple[float, float, float] | None
    is_named: bool = True


class StoredArray(Protocol):
    """The interface that a Zarr array and a WholeArray share."""

    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def chunks(self) -> tuple[int, ...]: ...
    @property
    def dtype(self) -> Any: ...
    def __getitem__(self, key: Any, /) -> Any: ...


@dataclass(frozen=True, slots=True)
class VoxelArray:
    """One level's voxels in the layout and the dtype of the source.

    axes  the names of the array's dimensions: `t`, `c`, `z`, `y`, `x` in any order; a dimension of
          any other name has length 1
    """

    array: StoredArray
    axes: tuple[str, ...]

    @property
    def shape(self) -> tuple[int, int, int]:
        """The number of voxels (z, y, x)."""
        z, y, x = (self.size(axis) for axis in "zyx")
        return z, y, x

    @property
    def chunk(self) -> tuple[int, int, int]:
        """The block (z, y, x) in voxels that one read decodes."""
        chunk = dict(zip(self.axes, self.array.chunks, strict=True))
        z, y, x = (int(chunk.get(axis, 1)) for axis in "zyx")
        return z, y, x

    def size(self, axis: str) -> int:
        """The length along one axis in voxels; 1 where the array lacks the axis."""
        return int(self.array.shape[self.axes.index(axis)]) if axis in self.axes else 1

    def window(self, time: int, channel: int, box: Box) -> NDArray[Any]:
        """Return the voxels of a box, (z, y, x), in the dtype of a build (read/cast.py)."""
        stored = self.stored_window(time, channel, box)
        return cast(stored, built_dtype(stored.dtype) or stored.dtype)

    def stored_window(self, time: int, channel: int, box: Box) -> NDArray[Any]:
        """Return the voxels of a box, (z, y, x), stored dtype, in this machine's byte order."""
        wanted: dict[str, int | slice] = dict(zip("zyx", box.slices, strict=True))
        wanted |= {"t": time, "c": channel}
        stored = np.asarray(self.array[tuple(wanted.get(axis, 0) for axis in self.axes)])
        order = [axis for axis in self.axes if axis in "zyx"]
        lacking = [axis for axis in "zyx" if axis not in order]
        stored = stored.reshape(stored.shape + (1,) * len(lacking))
        voxels = stored.transpose([(order + lacking).index(axis) for axis in "zyx"])
        return np.ascontiguousarray(voxels, dtype=voxels.dtype.newbyteorder("="))


@dataclass(frozen=True, eq=False)
class Dataset:
    """One image of a source at one time point.

    name         the name to display: the file's name without its suffix; for DICOM and NIfTI,
                 whose file names may identify a patient, the kind of image
    dtype        uint8, uint16, int16 or float32; `stored_dtype` is the file's
    levels       finest first
    channels     in the source's order
    time_points  the number of time points in the source; `time` is the index of the one to read
    images       the number of images in the source; the reader takes the first
    modality     DICOM's code of the modality (0008,0060): `MR`, `CT`, ...; empty: not known
    has_hounsfield_units  False: a CT without Hounsfield units, so iso-values of CT don't apply
    placement    rows of a (4, 4) matrix for column vectors, um: from the world whose origin is the
                 centre of voxel (0, 0, 0) (volume.zyx_to_xyz) to the patient's world; see
                 read/anatomical_axes.py
    has_sides    whether the source states where the patient's left, back and head are; False where
                 the subject isn't a patient or the reader had to guess
    remarks      changes and omissions of the reader, a sentence each
    acquired     the axis that is perpendicular to the source's own images, and their places
    labels       the metadata that says that voxels number objects; empty: none does
    objects      the file's own notes on these objects
    files        paths or addresses of all files and folders that the source is read from
    offset_um    the source's position of the centre of level 0's voxel (0, 0, 0), (z, y, x), um;
                 results count from that voxel, and only combining two sources needs it
    """

    source: str
    name: str
    dtype: np.dtype[Any]
    levels: tuple[Level, ...]
    channels: tuple[ChannelInfo, ...]
    time_points: int
    time: int
    images: int
    arrays: tuple[VoxelArray, ...] = field(repr=False)
    shown: str = field(repr=False)  # the source without secrets, for messages
    on_close: Callable[[], None] | None = field(repr=False, default=None)
    modality: str = ""
    has_hounsfield_units: bool = True
    placement: Matrix = IDENTITY
    has_sides: bool = False
    remarks: tuple[str, ...] = ()
    labels: str = ""
    objects: ObjectNotes = ObjectNotes()  # noqa: RUF009  (frozen)
    offset_um: Point = (0.0, 0.0, 0.0)
    acquired: Acquired = Acquired()  # noqa: RUF009  (frozen)
    files: tuple[str, ...] = field(repr=False, default=())
    _darkest: dict[int, float] = field(init=False, repr=False, default_factory=dict)

    def __post_init__(self) -> None:
        if self.on_close is not None:
            weakref.finalize(self, self.on_close)

    @property
    def notes(self) -> tuple[str, ...]:
        """Changes to the source and parts that were left out, a sentence each, for the user."""
        return (*self.remarks, *choice_notes(self.images, self.time_points, self.time))

    @cached_property
    def fingerprint(self) -> str:
        """Hex digest of the metadata and of voxels, computed at the first access.

        The digest depends on neither path nor date. All voxels are hashed where they fit the budget
        of 64 MB. Otherwise the coarsest level, or blocks of it, and evenly spread blocks of the
        finest level are hashed.
        """
        with one_line(self.shown, "chunks that are whole"):
            return fingerprint_of(self)

    def read(self, channel: int, box: Box, level: int = 0) -> Volume:
        """Return the voxels of `box`, (z, y, x), in the source's dtype.

        channel  index into `channels`
        box      voxels of `level`; only the chunks that it touches are read

        The result's `origin_um` is (z, y, x), um, from the centre of level 0's voxel (0, 0, 0). Its
        `slice_axis` is the source's.
        NaN and infinity are read as the smallest finite value (read/unmeasured.py). Raises
        SourceError where a chunk can't be decoded, where no voxel of the channel is finite or where
        a voxel is beyond MAX_VALUE. Raises ValueError where the channel, the level or the box is
        out of range.
        """
        if not 0 <= channel < len(self.channels) or not 0 <= level < len(self.levels):
            raise ValueError(f"channel {channel} of level {level} doesn't exist")
        place = self.levels[level]
        bounds = zip(box.start, box.stop, place.shape, strict=True)
        if not all(0 <= start < stop <= size for start, stop, size in bounds):
            raise ValueError(f"{box} leaves level {level} of shape {place.shape}")
        where = (
            f"{self.shown}: channel {self.channels[channel].name!r}, level {level}, "
            f"voxels {_range(box)}"
        )
        with one_line(where, "chunks that are whole"):
            stored = self.arrays[level].stored_window(self.time, channel, box)
            voxels = cast(stored, built_dtype(stored.dtype) or stored.dtype)
        if stored.dtype.kind == "f" and not (is_measured := np.isfinite(stored)).all():
            least = self.darkest(channel)
            voxels = np.where(is_measured, voxels, voxels.dtype.type(least))
        if voxels.dtype.kind == "f" and not np.abs(voxels).max(initial=0) <= MAX_VALUE:
            raise SourceError(
                f"{where}: found voxels beyond {MAX_VALUE:g}, expected smaller ones: rescale them"
            )
        z, y, x = (
            origin + start * spacing
            for origin, start, spacing in zip(
                place.origin_um, box.start, place.spacing_um, strict=True
            )
        )
        return Volume(voxels, place.spacing_um, (z, y, x), self.slice_axis(level))

    def slice_axis(self, level: int = 0) -> int:
        """Return the axis perpendicular to a level's images: 0, 1 or 2 for z, y or x."""
        return find_slice_axis(self.acquired.axis, self.levels[level].spacing_um)

    @property
    def stored_dtype(self) -> np.dtype[Any]:
        """The dtype of the voxels in the file, in this machine's byte order."""
        return np.dtype(self.arrays[0].array.dtype).newbyteorder("=")

    def darkest(self, channel: int) -> float:
        """Return the smallest finite voxel of a channel, which fills gaps at all its levels.

        The value is taken from the finest level of at most MAX_SEARCHED voxels; coarser levels are
        averages of that one. The first call reads the whole level. Raises SourceError where a chunk
        can't be decoded or no voxel is finite.
        """
        if channel not in self._darkest:
            small = (i for i, one in enumerate(self.levels) if prod(one.shape) <= MAX_SEARCHED)
            level = next(small, len(self.levels) - 1)
            where = f"{self.shown}: channel {self.channels[channel].name!r}, level {level}"
            with one_line(where, "chunks that are whole"):
                found = least_finite(self.arrays[level], self.time, channel)
            if found is None:
                raise SourceError(
                    f"{where}: found no finite voxel: all are NaN or infinite, expected an image"
                )
            self._darkest[channel] = found
        return self._darkest[channel]

    def share_of_gaps(self, channel: int, boxes: Iterable[Box], level: int) -> float:
        """Return the share (0..1) of the voxels in boxes of a level that are NaN or infinite.

        Raises SourceError where a chunk can't be decoded.
        """
        if self.stored_dtype.kind != "f":
            return 0.0
        where = f"{self.shown}: channel {self.channels[channel].name!r}, level {level}"
        with one_line(where, "chunks that are whole"):
            return share_of_gaps(self.arrays[level], self.time, channel, boxes)

    def read_stored(self, channel: int, box: Box) -> NDArray[Any]:
        """Return the voxels of a box of level 0, (z, y, x), in the file's dtype.

        Raises SourceError where a chunk can't be decoded.
        """
        where = f"{self.shown}: channel {self.channels[channel].name!r}, voxels {_range(box)}"
        with one_line(where, "chunks that are whole"):
            return self.arrays[0].stored_window(self.time, channel, box)

    def find_channels(self, selection: Sequence[str]) -> tuple[int, ...]:
        """Return the indices of the selected channels, in the order selected, without repeats.

        Each selected channel is a name, an index or an identifier; names take precedence over
        indices, and indices over identifiers. Made-up names (`Channel0`) count too, since plans,
        reports and stages show them. Raises UsageError where the source lacks a channel; the
        message lists the channels that exist.
        """
        indices = {channel.name: index for index, channel in enumerate(self.channels)}
        by_id = {to_identifier(name): index for name, index in indices.items()}
        found = []
        for wanted in selection:
            if wanted in indices:
                found.append(indices[wanted])
            elif wanted.isdecimal() and int(wanted) < len(self.channels):
                found.append(int(wanted))
            elif wanted in by_id:  # files and prims are called by identifiers
                found.append(by_id[wanted])
            else:
                raise UsageError(f"{self.shown}: channel {wanted!r}: {self._remedy(wanted)}")
        return tuple(dict.fromkeys(found))

    def _remedy(self, wanted: str) -> str:
        names = [channel.name for channel in self.channels]
        most = len(self.channels) - 1
        range_ = f"an index from 0 to {most}" if most else "its index 0"
        if wanted.isdecimal():
            return f"not found, expected {range_}"
        if not any(channel.is_named for channel in self.channels):
            last = f" to {names[-1]}" if len(names) > 1 else ""
            return f"the source holds no channel names, expected {names[0]}{last}, or {range_}"
        lower = {name.lower(): name for name in reversed(names)}
        near = difflib.get_close_matches(wanted.lower(), list(lower), n=1, cutoff=0.5)
        hint = f" (did you mean {lower[near[0]]!r}?)" if near else ""
        return f"not found{hint}, expected one of {', '.join(names)} or {range_}"


def _range(box: Box) -> str:
    return ",".join(f"{a}:{b}" for a, b in zip(box.start, box.stop, strict=True))
