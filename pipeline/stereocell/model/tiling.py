"""Cut a lattice of voxels into tiles that share their border planes.

Neighbours share ONE plane of lattice points: where another tile follows, a tile's points run from
`start` to `stop` inclusive. So each cell belongs to exactly one tile, and surfaces meet without
cracks and without clipping.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, product


@dataclass(frozen=True, slots=True)
class Box:
    """Half-open box of voxels, (z, y, x), in indices of the level that is built."""

    start: tuple[int, int, int]
    stop: tuple[int, int, int]

    @property
    def shape(self) -> tuple[int, int, int]:
        """The number of voxels, (z, y, x)."""
        z, y, x = (b - a for a, b in zip(self.start, self.stop, strict=True))
        return z, y, x

    @property
    def slices(self) -> tuple[slice, slice, slice]:
        """The box as slices of the whole level, (z, y, x)."""
        z, y, x = (slice(a, b) for a, b in zip(self.start, self.stop, strict=True))
        return z, y, x

    def slab(self, axis: int, start: int, stop: int) -> "Box":
        """Return the part of the box from plane `start` to before plane `stop` along an axis."""
        starts, stops = list(self.start), list(self.stop)
        starts[axis], stops[axis] = start, stop
        (z0, y0, x0), (z1, y1, x1) = starts, stops
        return Box((z0, y0, x0), (z1, y1, x1))

    def slices_in(self, window: "Box") -> tuple[slice, slice, slice]:
        """Return the box as slices of an array that covers `window`."""
        start, stop, first = self.start, self.stop, window.start
        z, y, x = (slice(a - w, b - w) for a, b, w in zip(start, stop, first, strict=True))
        return z, y, x

    def grown(self, halo: tuple[int, int, int], within: "Box") -> "Box":
        """Return the box grown by `halo` voxels on each side, but within another box."""
        start = (max(a - h, low) for a, h, low in zip(self.start, halo, within.start, strict=True))
        stop = (min(b + h, high) for b, h, high in zip(self.stop, halo, within.stop, strict=True))
        z0, y0, x0 = start
        z1, y1, x1 = stop
        return Box((z0, y0, x0), (z1, y1, x1))

    def thinned(self, region: "Box", step: tuple[int, int, int], *, outward: bool = False) -> "Box":
        """Return the box in indices of thinned planes: every `step`-th from the region's first.

        The box ends with the last kept plane inside it. With `outward` it ends with the next kept
        plane, if the region has one, so that boxes that share a plane still share one.
        """
        start, stop = [], []
        ends = zip(self.start, self.stop, region.start, region.stop, step, strict=True)
        for a, b, first, end, k in ends:
            start.append(-(-(a - first) // k))
            last = -(-(b - 1 - first) // k) if outward else (b - 1 - first) // k
            stop.append(min(last, (end - 1 - first) // k) + 1)
        z0, y0, x0 = start
        z1, y1, x1 = stop
        return Box((z0, y0, x0), (z1, y1, x1))


@dataclass(frozen=True, slots=True)
class Tile:
    """A tile of the region.

    id   `r<row>_c<column>`, followed by `_z<k>` if the depth is split
    box  the tile's own voxels
    """

    id: str
    box: Box

    def lattice(self, region: Box) -> Box:
        """Return the box of the lattice points between which the tile's cells lie.

        It has one more plane than `box` at the end of each axis where another tile follows.
        """
        z, y, x = (min(b + 1, end) for b, end in zip(self.box.stop, region.stop, strict=True))
        return Box(self.box.start, (z, y, x))


def cut(region: Box, tile_size: tuple[int, int, int]) -> tuple[Tile, ...]:
    """Return the tiles of a region, row by row. The last tile of an axis may be smaller.

    tile_size  voxels (z, y, x). A single plane that is left at the end has no cells, so it joins
               the last tile
    """
    axes = []
    for low, high, size in zip(region.start, region.stop, tile_size, strict=True):
        edges = list(range(low, high, size))
        if len(edges) > 1 and high - edges[-1] < 2:
            edges.pop()
        axes.append([*edges, high])
    return _between(axes)


def cut_evenly(region: Box, columns: int, rows: int) -> tuple[Tile, ...]:
    """Return columns x rows tiles, row by row. Their sizes differ by at most one voxel.

    The region must have at least two voxels for each tile along y and x.
    """
    axes = [
        [low + i * (high - low) // count for i in range(count + 1)]
        for low, high, count in zip(region.start, region.stop, (1, rows, columns), strict=True)
    ]
    return _between(axes)


def _between(edges: Sequence[Sequence[int]]) -> tuple[Tile, ...]:
    """Return the tiles between the edges of each axis (z, y, x)."""
    depths, rows, columns = (list(enumerate(pairwise(axis))) for axis in edges)
    tiles = []
    for (r, ys), (c, xs), (k, zs) in product(rows, columns, depths):
        box = Box((zs[0], ys[0], xs[0]), (zs[1], ys[1], xs[1]))
        tiles.append(Tile(f"r{r}_c{c}" + (f"_z{k}" if len(depths) > 1 else ""), box))
    return tuple(tiles)
