"""Combine the volumes of all tiles to one volume on their common lattice, on disk, tile by tile.

Axes are those of the source, as a microscope or a scanner stored them: x to the right, y downwards,
z from plane to plane. Positions are also those of the source. The world's y grows upwards, so it is
reversed. For a patient, positions are DICOM's: (left, posterior, superior).
"""

import os
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.bundle.windowed_voxels import read_measured, read_windowed
from stereocell.export.chosen import Chosen
from stereocell.export.options import UNITS_M, Region
from stereocell.formats.exr import read_atlas
from stereocell.formats.voxel_grid import VoxelGrid
from stereocell.model.errors import StageError, UsageError
from stereocell.usd.composed_appearance import ComposedAppearance
from stereocell.usd.layer import METERS_PER_UNIT
from stereocell.usd.read_stage import sides_of
from stereocell.usd.read_volume import ComposedVolume

_OFF = 1e-2  # voxels, largest distance of a tile from the lattice of the first tile
_IMAGE_AXES = np.diag([1.0, -1.0, 1.0])  # matrix from the world's axes to those of an image
_AS_BYTES = (0.0, 255.0)  # window of 8-bit sources: the stage's bytes then are the source's values

_BLOCK = 1 << 20  # bytes of zeros that are written at a time


@dataclass(frozen=True, slots=True)
class Layout:
    """The layout of a file with a volume: its lattice, channels and type of voxels.

    grid         size, spacing, origin and direction of the volume
    dtype        type of the voxels in the file
    first        first voxel (x, y, z) of the volume on the common lattice, whose (0, 0, 0) is the
                 first voxel of the first tile
    firsts       first voxel (x, y, z) of each tile on the common lattice, by tile ID
    is_measured  whether values are those of the source; else the channel's window is scaled to the
                 whole range of the type
    is_upright   whether y grows upwards and z away from the viewer, as in Unity
    """

    grid: VoxelGrid
    channels: tuple[ComposedAppearance, ...]
    dtype: np.dtype[np.integer[Any]]
    first: NDArray[np.int64]
    firsts: dict[str, NDArray[np.int64]]
    is_measured: bool
    is_upright: bool = False

    @property
    def names(self) -> list[str]:
        return [channel.name for channel in self.channels]

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """The shape of the volume: (channel, z, y, x)."""
        x, y, z = self.grid.size
        return len(self.channels), z, y, x

    @property
    def about(self) -> str:
        """A phrase about size, type, channels and values of the volume, for the user."""
        x, y, z = self.grid.size
        if self.is_measured:
            values = "the source's values"
        else:
            windows = (f"{c.name} {c.window[0]:g} to {c.window[1]:g}" for c in self.channels)
            values = f"0 to {np.iinfo(self.dtype).max} for {', '.join(windows)}"
        return f"{x} x {y} x {z} voxels of {self.dtype.name}, {', '.join(self.names)}: {values}"


def find_layout(chosen: Chosen) -> Layout:
    """Find the common lattice of the selected volumes, and the type of the voxels.

    All voxels are read to find the type, unless 8 bits are requested. Raises StageError if tiles
    have no common lattice or no volumes, and UsageError for options that are not possible.
    """
    options = chosen.options
    bits = options.bits or (8 if options.unity else None)
    start: NDArray[np.float64] | None = None
    steps = np.eye(3)
    firsts: dict[str, NDArray[np.int64]] = {}
    ends: list[NDArray[np.int64]] = []
    found: dict[str, ComposedAppearance] = {}
    span = _Span()
    for tile, channel, volume in chosen.volumes():
        place, own = _place(volume)
        if start is None:
            start, steps = place, own
        if not np.allclose(own, steps, rtol=1e-5, atol=1e-5 * np.abs(steps).max()):
            raise StageError(
                f"{tile}: found an edit that turned or scaled only this tile, expected the same "
                "for all tiles: choose other --tiles"
            )
        at = (place - start) @ np.linalg.inv(steps)
        if np.abs(at - np.rint(at)).max() > _OFF:
            raise StageError(
                f"{tile}: found a move by a part of a voxel, expected whole voxels: choose other "
                "--tiles"
            )
        firsts[tile] = np.rint(at).astype(np.int64)
        ends.append(firsts[tile] + np.array(volume.size) - 2 * volume.apron)
        found[channel.id] = channel
        if bits != 8:
            span.add(channel, volume, chosen, is_needed=bits == 16)
    if start is None:
        names = ", ".join(channel.name for channel in chosen.channels)
        are_maps = len(chosen.label_maps) == len(chosen.channels)
        why = " (label maps have only surfaces)" if are_maps else ""
        raise StageError(
            f"{chosen.path}: found no volume of {names}{why}, expected one or more: choose other "
            "--channels"
        )
    channels = tuple(channel for channel in chosen.channels if channel.id in found)
    if options.unity and len(channels) > 1:
        names = ", ".join(channel.name for channel in channels)
        raise UsageError(
            f"--unity: found {len(channels)} channels, expected one: name one of {names} by "
            "--channels"
        )
    first, end = np.min(list(firsts.values()), axis=0), np.max(ends, axis=0)
    within = _cut(chosen.region, start, steps, first, end)
    if within is None:
        raise chosen.nothing("voxel")
    first, end = within
    dtype = np.dtype("u1") if bits == 8 or not span.is_known else span.dtype
    grid = _grid(chosen, start + first @ steps, steps, end - first)
    is_measured = dtype != np.dtype("u1") and span.are_whole
    layout = Layout(grid, channels, dtype, first, firsts, is_measured)
    return _upright(layout) if options.unity else layout


def fill(layout: Layout, chosen: Chosen, values: NDArray[np.generic]) -> None:
    """Write the voxels into an array of zeros (channel, z, y, x), one tile after the other."""
    into = values[:, ::-1, ::-1] if layout.is_upright else values
    number = {channel.id: i for i, channel in enumerate(layout.channels)}
    size = np.array(layout.grid.size)
    for tile, channel, volume in chosen.volumes():
        voxels = _read(layout, chosen, channel, volume)
        low = layout.firsts[tile] - layout.first
        high = low + voxels.shape[::-1]
        start, stop = low.clip(0, size), high.clip(0, size)
        if (start < stop).all():
            (x0, y0, z0), (x1, y1, z1) = start, stop
            i, j, k = start - low
            part = voxels[k : k + z1 - z0, j : j + y1 - y0, i : i + x1 - x0]
            into[number[channel.id], z0:z1, y0:y1, x0:x1] = part


def _place(volume: ComposedVolume) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the position of a tile's first voxel, and the steps along x, y and z as rows.

    Both are in um of the world.
    """
    low, high = np.array(volume.low), np.array(volume.high)
    spacing = (high - low) / (np.array(volume.size) - 2 * volume.apron - 1)
    turned = volume.matrix[:3, :3]
    place = np.array([low[0], high[1], low[2]]) @ turned + volume.matrix[3, :3]
    return place, (spacing * (1, -1, 1))[:, np.newaxis] * turned


class _Span:
    """Finds the range of the values that 16 bits have to hold."""

    def __init__(self) -> None:
        self._low, self._high = np.inf, -np.inf
        self._are_whole = True
        self.is_known = True  # whether the stage has measured values of all volumes so far

    def add(
        self,
        channel: ComposedAppearance,
        volume: ComposedVolume,
        chosen: Chosen,
        *,
        is_needed: bool,
    ) -> None:
        if not self.is_known:
            return
        values = _measured(channel, volume, chosen)
        if values is None:
            self.is_known = False
            if is_needed:
                raise UsageError(
                    f"--bits is 16, expected 8, because the stage has 8 bits of {channel.name}: "
                    "build without --bits 8"
                )
            return
        self._low = min(self._low, float(values.min()))
        self._high = max(self._high, float(values.max()))
        self._are_whole &= bool((values == np.rint(values)).all())

    @property
    def are_whole(self) -> bool:
        """Whether all values are whole numbers that fit into 16 bits."""
        is_near = self._high - min(self._low, 0) <= 0xFFFF and self._low >= -0x8000
        is_signed = self._low < 0
        return self._are_whole and is_near and (not is_signed or self._high <= 0x7FFF)

    @property
    def dtype(self) -> np.dtype[np.integer[Any]]:
        return np.dtype("<i2" if self.are_whole and self._low < 0 else "<u2")


def _measured(
    channel: ComposedAppearance, volume: ComposedVolume, chosen: Chosen
) -> NDArray[np.float32] | NDArray[np.uint8] | None:
    """Return the voxels as measured, without the apron; None: the stage does not keep them."""
    if volume.measured is not None:
        chosen.as_written.require(volume.measured)
        return _without_apron(read_measured(volume), volume)
    if channel.volume_window != _AS_BYTES:
        return None
    chosen.as_written.require(volume.atlas)
    return _without_apron(read_atlas(volume.atlas), volume)


def _read(
    layout: Layout, chosen: Chosen, channel: ComposedAppearance, volume: ComposedVolume
) -> NDArray[np.generic]:
    if layout.dtype == np.dtype("u1"):
        return _without_apron(read_windowed(volume, channel, as_written=chosen.as_written), volume)
    values = _measured(channel, volume, chosen)
    assert values is not None
    if layout.is_measured:
        return values.astype(layout.dtype)
    low, high = channel.window
    share = np.clip((values.astype(np.float64) - low) / (high - low), 0, 1)
    return np.rint(share * 0xFFFF).astype(layout.dtype)


def _without_apron(voxels: NDArray[Any], volume: ComposedVolume) -> NDArray[Any]:
    own = slice(volume.apron, -volume.apron or None)
    return voxels[own, own, own]


def _cut(
    region: Region | None,
    start: NDArray[np.float64],
    steps: NDArray[np.float64],
    first: NDArray[np.int64],
    end: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Return the voxels whose centres are in a region, as first and end (x, y, z) on the lattice.

    Returns None if no centre is in it. If the volumes are rotated in the world, as a scan of
    a patient may be, this is the smallest box of the lattice around the region.

    start, steps  position of the lattice's (0, 0, 0), and its steps as rows, world um
    first, end    first voxel and end (x, y, z) of all tiles on the lattice
    """
    if region is None:
        return first, end
    whole = _corners(first, end - 1) @ steps + start
    low, high = (
        np.maximum(region.low, whole.min(axis=0)),
        np.minimum(region.high, whole.max(axis=0)),
    )
    at = (_corners(low, high) - start) @ np.linalg.inv(steps)
    start_at = np.maximum(first, np.ceil(at.min(axis=0) - _OFF).astype(np.int64))
    end_at = np.minimum(end, np.floor(at.max(axis=0) + _OFF).astype(np.int64) + 1)
    return (start_at, end_at) if (low <= high).all() and (start_at < end_at).all() else None


def _corners(low: NDArray[Any], high: NDArray[Any]) -> NDArray[np.float64]:
    """Return the eight corners (8, 3) of the box between two corners."""
    return np.array(list(product(*zip(low.tolist(), high.tolist(), strict=True))), np.float64)


def places_of_world(chosen: Chosen) -> NDArray[np.float64]:
    """Return the matrix (3, 3) for column vectors from the world's axes to those of the source."""
    sides = sides_of(chosen.stage)
    if sides is None:
        return _IMAGE_AXES
    return np.array([sides[name] for name in ("left", "posterior", "superior")])


def _grid(
    chosen: Chosen, start: NDArray[np.float64], steps: NDArray[np.float64], size: NDArray[np.int64]
) -> VoxelGrid:
    to_source = places_of_world(chosen)
    is_patient = sides_of(chosen.stage) is not None
    unit = chosen.options.units or "mm"
    factor = METERS_PER_UNIT / UNITS_M[unit]
    columns = to_source @ steps.T * factor
    spacing = np.linalg.norm(columns, axis=0)
    x, y, z = size.tolist()
    origin = to_source @ start * factor + 0.0  # turns -0.0 into 0.0
    return VoxelGrid((x, y, z), spacing, origin, columns / spacing + 0.0, unit, is_patient)


def _upright(layout: Layout) -> Layout:
    """Return the layout with y and z reversed, for Unity's left-handed axes."""
    grid = layout.grid
    _, height, depth = grid.size
    columns = grid.direction * grid.spacing
    origin = grid.origin + columns[:, 1] * (height - 1) + columns[:, 2] * (depth - 1)
    direction = grid.direction * np.array([1.0, -1.0, -1.0]) + 0.0
    return replace(layout, grid=replace(grid, origin=origin, direction=direction), is_upright=True)


def map_file(file: Path, layout: Layout, offset: int) -> NDArray[np.generic]:
    """Map an array of zeros (channel, z, y, x) into a file, after a header of `offset` bytes."""
    return map_zeros(file, layout.dtype, layout.shape, offset=offset)


def map_zeros(
    file: Path, dtype: np.dtype[Any], shape: tuple[int, ...], *, offset: int = 0
) -> NDArray[Any]:
    """Map an array of zeros into an existing file, from byte `offset` on.

    The disk space is allocated at once. Otherwise, if the disk became full while the mapped array
    is filled, the system would kill the process. Raises OSError.
    """
    size = offset + int(np.prod(shape)) * np.dtype(dtype).itemsize
    with file.open("r+b") as opened:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(opened.fileno(), 0, size)
        else:
            opened.seek(0, os.SEEK_END)
            while (missing := size - opened.tell()) > 0:
                opened.write(bytes(min(missing, _BLOCK)))
    return np.memmap(file, dtype, "r+", offset, shape)
