"""Write the coarse volumes of a bundle's tiles, within a bound of bytes.

A volume's voxels are the means of blocks (coarse_channel.py). How well they compress differs ten
times between specimens, so the bound is on the bytes: where they would be more, the voxels of all
tiles lie farther apart than the blocks.
"""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import prod
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from stereocell.bundle.tile_part import BundleTile, TileChannel
from stereocell.bundle.write_volume import write_volume
from stereocell.formats.ktx2 import encode_3d
from stereocell.isosurface.holder import Holder
from stereocell.live.coarse_channel import CoarseChannel, places_in
from stereocell.model.tile_content import APRON
from stereocell.model.tiling import Tile
from stereocell.model.world_box import WorldPoint, move_box, world_box
from stereocell.planning.channels import Channel
from stereocell.planning.plan import Plan
from stereocell.storage.processes import cores
from stereocell.transfer.joint_histogram import to_eight_bits
from stereocell.usd.composed_appearance import ComposedAppearance

BYTES = 1_000_000  # most bytes of the files of a view, all channels and tiles together
_OTHERS = 22_000  # bytes of a channel's other files: tables, histogram, lists
_SAMPLED, _EACH = 6, 48  # planes that are compressed for an estimate, of so many
# bytes of a texture with its mip levels over those of its finest one: noise has 1.14, tissue 1.2
_MIPS = 1.17
_STEP = 1.02  # least factor by which voxels lie farther apart in another attempt
_GAIN = 0.98  # share of the bytes from which an attempt brought too little for another one
Sizes = Mapping[str, tuple[int, int, int]]  # voxels (x, y, z) by the ID of the tile


@dataclass(frozen=True, slots=True)
class _CoarseVolume:
    """The place of a tile's coarse volume; see usd.read_volume.ComposedVolume."""

    size: tuple[int, int, int]
    low: WorldPoint
    high: WorldPoint
    matrix: NDArray[np.float64]
    apron: int = APRON
    measured: Path | None = None


@dataclass(frozen=True, slots=True)
class CoarseTiles:
    """The coarse volumes of all tiles, written.

    apart  distance between their voxels over that of the blocks that were read, from 1
    """

    tiles: tuple[BundleTile, ...]
    apart: float


def write_coarse_tiles(
    plan: Plan,
    root: Path,
    read: Mapping[str, CoarseChannel],
    appearances: Sequence[ComposedAppearance],
    sizes: Sizes,
    holders: Mapping[str, Holder] = MappingProxyType({}),
) -> CoarseTiles:
    """Write the coarse volumes of all tiles into a bundle, so that it has at most BYTES.

    Where that can't be, as with hundreds of tiles or channels, it has few more.

    sizes    see `first_view.write_first_view`
    holders  what is air in the volumes of a build, by the channel's ID

    Raises OutputError where a file can't be written.
    """
    volumes = [
        _Source(channel, read[channel.voxels_id], appearance, holders.get(channel.id))
        for channel, appearance in zip(plan.channels, appearances, strict=True)
        if channel.id not in plan.shared_volumes
    ]

    def write(tile: Tile) -> BundleTile:
        voxels = {one.channel.id: one.voxels(plan, tile, apart) for one in volumes}
        return _write_tile(plan, root, tile, appearances, voxels, sizes)

    with ThreadPoolExecutor(cores()) as pool:
        estimates = pool.map(lambda one: _estimate(plan, one), volumes)
        most = max(BYTES - len(plan.channels) * _OTHERS, BYTES // 2)
        apart = max(1.0, (sum(estimates) / most) ** (1 / 3))
        before = np.inf
        while True:
            tiles = tuple(pool.map(write, plan.tiles))
            size = sum(ref.bytes for tile in tiles for one in tile.channels for ref in one.files)
            # Many small tiles are no smaller for voxels that lie farther apart.
            if size <= most or size > _GAIN * before:
                return CoarseTiles(tiles, apart)
            before = size
            apart *= max(_STEP, (size / most) ** (1 / 3))


@dataclass(frozen=True, slots=True)
class _Source:
    """What the volumes of a channel are made of."""

    channel: Channel
    coarse: CoarseChannel
    appearance: ComposedAppearance
    holder: Holder | None

    def voxels(
        self, plan: Plan, tile: Tile, apart: float, planes: slice = slice(None)
    ) -> NDArray[np.uint8]:
        """Return a tile's voxels with the apron, window applied, (z, y, x); or some planes."""
        # means before other places: between them, places would miss voxels
        coarse = self.coarse.averaged(int(apart))
        step = [one * apart for one in self.coarse.grid.step]
        z, y, x = places_in(tile.lattice(plan.region), (step[0], step[1], step[2]))
        places = z[planes], y, x
        values = coarse.at(places)
        if self.holder is not None:
            values = self.holder.left_out_at(values, places)
        return to_eight_bits(values, self.appearance.window)


def _estimate(plan: Plan, source: _Source) -> float:
    """Return about how many bytes the volumes of a channel are, where voxels lie as it was read."""
    return sum(_MIPS * found for tile in plan.tiles for found in _sampled(plan, tile, source))


def _sampled(plan: Plan, tile: Tile, source: _Source) -> Iterator[float]:
    count = len(places_in(tile.lattice(plan.region), source.coarse.grid.step)[0])
    for first in range(0, count, _EACH):
        planes = min(_EACH, count - first)
        middle = first + max(0, planes - _SAMPLED) // 2
        part = source.voxels(plan, tile, 1.0, slice(middle, middle + _SAMPLED))
        yield len(encode_3d([part]).data) * planes / len(part)


def _write_tile(
    plan: Plan,
    root: Path,
    tile: Tile,
    appearances: Sequence[ComposedAppearance],
    coarse: Mapping[str, NDArray[np.uint8]],
    sizes: Sizes,
) -> BundleTile:
    lattice = tile.lattice(plan.region)
    first, last = plan.position_um(lattice.start), plan.position_um([n - 1 for n in lattice.stop])
    corners = world_box(first, last)
    low, high = (_point(corner) for corner in corners)
    matrix = np.array(plan.placement).T  # USD's matrices are for row vectors
    channels = []
    for channel, appearance in zip(plan.channels, appearances, strict=True):
        if channel.id not in coarse:
            channels.append(TileChannel(channel.id, (), (), (), None, (), None))
            continue
        voxels = coarse[channel.id]
        depth, height, width = voxels.shape
        volume = _CoarseVolume((width, height, depth), low, high, matrix)
        entry, files, joint = write_volume(root, tile.id, appearance, volume, voxels)
        finer = sizes.get(tile.id, volume.size)
        if prod(finer) > prod(volume.size):
            entry["finer_size"] = list(finer)
        channels.append(TileChannel(channel.id, (), (), (), entry, tuple(files), joint))
    bounds = move_box(*corners, matrix)
    return BundleTile(tile.id, "mesh", _point(bounds[0]), _point(bounds[1]), tuple(channels))


def _point(values: NDArray[np.float64]) -> WorldPoint:
    x, y, z = (float(n) for n in values)
    return x, y, z
