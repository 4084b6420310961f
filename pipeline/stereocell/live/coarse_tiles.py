"""Write the coarse volumes of a bundle's tiles, within a limit of bytes.

A volume's voxels are the means of blocks (coarse_channel.py). Their compression differs tenfold
between specimens; hence the limit is on bytes, not on voxels. If a view would be too large, values
are rounded to fewer greys, beginning with those that the chosen transfer function leaves invisible.
This helps because noise, which compresses badly, is mostly in the last bits. If rounding is not
enough, the voxels of all tiles lie farther apart than the blocks, which makes small bright
structures fainter.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
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
from stereocell.transfer.opacity import evaluate, invisible_below
from stereocell.usd.composed_appearance import ComposedAppearance

BYTES = 1_000_000  # bytes, limit for the files of a view, all channels and tiles together
_OTHERS = 22_000  # bytes of a channel's other files: tables, histogram, lists
# Steps of grey between black and white, for visible and for invisible values, in order of trial.
_ALL = (255, 255)
_GREYS = (_ALL, (255, 15), (127, 15), (63, 15))
_SAMPLED, _EACH = (
    6,
    48,
)  # to estimate bytes, the first number of planes is compressed of each group of the second
# Bytes of a texture with all mip levels, as a multiple of the finest level's bytes. Measured: 1.14
# for noise, 1.2 for tissue.
_MIPS = 1.17
_STEP = 1.02  # smallest factor by which the distance of voxels grows in another attempt
_GAIN = 0.98  # attempts end if the last one left more than this share of the bytes
_Greys = tuple[int, int]
_Sample = tuple[NDArray[np.uint8], float]  # planes, and the number of planes that each stands for
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
    """The coarse volumes of all tiles after they were written.

    apart  distance of two voxels, as a multiple of that in the coarse channel; at least 1
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
    """Write the coarse volumes of all tiles into a bundle of at most BYTES.

    With hundreds of tiles or channels the bundle may become a little larger.

    sizes    see `first_view.write_first_view`
    holders  pieces that a build replaces by air, by the channel's ID

    Raises OutputError if a file can't be written.
    """
    volumes = [
        _Source(channel, read[channel.voxels_id], appearance, holders.get(channel.id))
        for channel, appearance in zip(plan.channels, appearances, strict=True)
        if channel.id not in plan.shared_volumes
    ]

    def write(tile: Tile) -> BundleTile:
        voxels = {one.channel.id: one.voxels(plan, tile, apart) for one in volumes}
        stored = {one.channel.id: one.rounded(voxels[one.channel.id], greys) for one in volumes}
        return _write_tile(plan, root, tile, appearances, stored, voxels, sizes)

    with ThreadPoolExecutor(cores()) as pool:
        most = max(BYTES - len(plan.channels) * _OTHERS, BYTES // 2)
        sampled = list(pool.map(partial(_sampled, plan), volumes))
        for greys in _GREYS:
            estimate = sum(pool.map(partial(_estimate, greys), volumes, sampled))
            if estimate <= most:
                break
        apart = max(1.0, (estimate / most) ** (1 / 3))
        before = np.inf
        while True:
            tiles = tuple(pool.map(write, plan.tiles))
            size = sum(ref.bytes for tile in tiles for one in tile.channels for ref in one.files)
            # Tiles that are already small do not shrink much when their voxels lie farther apart.
            if size <= most or size > _GAIN * before:
                return CoarseTiles(tiles, apart)
            before = size
            apart *= max(_STEP, (size / most) ** (1 / 3))


@dataclass(frozen=True, slots=True)
class _Source:
    """The inputs from which the volumes of a channel are sampled.

    coarse      voxels of the whole specimen at a coarse level
    appearance  its window becomes 0 to 255
    holder      pieces, such as a CT's table, that are left out; None: there are none
    """

    channel: Channel
    coarse: CoarseChannel
    appearance: ComposedAppearance
    holder: Holder | None

    def voxels(
        self, plan: Plan, tile: Tile, apart: float, planes: slice = slice(None)
    ) -> NDArray[np.uint8]:
        """Return a tile's voxels with the apron, uint8 (z, y, x): 0 to 255 over the display window.

        apart   distance of two voxels, as a multiple of that in the coarse channel
        planes  the planes along z to return
        """
        # Averaging comes before interpolation, which would skip voxels between distant places.
        coarse = self.coarse.averaged(int(apart))
        step = [one * apart for one in self.coarse.grid.step]
        z, y, x = places_in(tile.lattice(plan.region), (step[0], step[1], step[2]))
        places = z[planes], y, x
        values = coarse.at(places)
        if self.holder is not None:
            values = self.holder.left_out_at(values, places)
        return to_eight_bits(values, self.appearance.window)

    def rounded(self, voxels: NDArray[np.uint8], greys: _Greys) -> NDArray[np.uint8]:
        """Round 8-bit values to fewer greys. Visible values stay visible, invisible ones do not
        become visible.
        """
        if greys == _ALL:
            return voxels
        points = self.appearance.transfer_functions[self.appearance.chosen]
        last = invisible_below(np.rint(evaluate(points) * 255).astype(np.uint8))
        values = np.arange(256)
        shown, hidden = (_steps(values, count) for count in greys)
        shown, hidden = np.maximum(shown, last + 1), np.minimum(hidden, max(last, 0))
        return np.where(values > last, shown, hidden).astype(np.uint8)[voxels]


def _sampled(plan: Plan, source: _Source) -> list[_Sample]:
    """Return a few planes from each group of _EACH planes of a channel's volumes."""
    found = []
    for tile in plan.tiles:
        count = len(places_in(tile.lattice(plan.region), source.coarse.grid.step)[0])
        for first in range(0, count, _EACH):
            planes = min(_EACH, count - first)
            middle = first + max(0, planes - _SAMPLED) // 2
            part = source.voxels(plan, tile, 1.0, slice(middle, middle + _SAMPLED))
            found.append((part, planes / len(part)))
    return found


def _estimate(greys: _Greys, source: _Source, sampled: Sequence[_Sample]) -> float:
    """Return about how many bytes a channel's volumes take when rounded to these greys."""
    return sum(
        _MIPS * share * len(encode_3d([source.rounded(part, greys)]).data)
        for part, share in sampled
    )


def _steps(values: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Round values of 0 to 255 to the nearest of `count` steps; 0 and 255 stay."""
    return np.rint(np.rint(values * (count / 255)) * (255 / count)).astype(np.int64)


def _write_tile(
    plan: Plan,
    root: Path,
    tile: Tile,
    appearances: Sequence[ComposedAppearance],
    stored: Mapping[str, NDArray[np.uint8]],
    counted: Mapping[str, NDArray[np.uint8]],
    sizes: Sizes,
) -> BundleTile:
    """Write the volumes of a tile.

    stored   voxels by channel, rounded to fewer greys
    counted  the same voxels before rounding, for histograms
    """
    lattice = tile.lattice(plan.region)
    first, last = plan.position_um(lattice.start), plan.position_um([n - 1 for n in lattice.stop])
    corners = world_box(first, last)
    low, high = (_point(corner) for corner in corners)
    matrix = np.array(plan.placement).T  # USD's matrices multiply row vectors
    channels = []
    for channel, appearance in zip(plan.channels, appearances, strict=True):
        if channel.id not in stored:
            channels.append(TileChannel(channel.id, (), (), (), None, (), None))
            continue
        voxels = stored[channel.id]
        depth, height, width = voxels.shape
        volume = _CoarseVolume((width, height, depth), low, high, matrix)
        all_greys = counted[channel.id]
        entry, files, joint = write_volume(root, tile.id, appearance, volume, voxels, all_greys)
        finer = sizes.get(tile.id, volume.size)
        if prod(finer) > prod(volume.size) or (tile.id in sizes and voxels is not all_greys):
            entry["finer_size"] = list(finer)
        channels.append(TileChannel(channel.id, (), (), (), entry, tuple(files), joint))
    bounds = move_box(*corners, matrix)
    return BundleTile(tile.id, "mesh", _point(bounds[0]), _point(bounds[1]), tuple(channels))


def _point(values: NDArray[np.float64]) -> WorldPoint:
    x, y, z = (float(n) for n in values)
    return x, y, z
