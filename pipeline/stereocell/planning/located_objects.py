"""Decide which tile builds which object of a label map.

An object belongs to the tile that holds its centroid. It is built there as a whole if its box
reaches at most half a tile beyond that tile. Otherwise it is cut at the planes between tiles: each
tile builds a piece, and the pieces stay one object.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.gltf_features import MAX_OBJECTS
from stereocell.model.errors import UsageError
from stereocell.model.tiling import Box
from stereocell.objects.extents import Extents, merge_extents
from stereocell.planning.plan import Plan
from stereocell.steps.labels import Labels

AROUND = 0.5  # tiles; farthest that an uncut object reaches beyond its tile
HALO = 42  # voxels; those farther from an interface move it by less than the lattice's step
CUT = -1  # stands in place of a tile's index for an object that is cut


@dataclass(frozen=True, slots=True)
class TileGrid:
    """The tiles of a plan in the voxels of a label map.

    edges  for each axis (z, y, x), ascending voxel indices; tile k reaches from edge k to k + 1
    ids    tile IDs by place in the grid (z, y, x)
    """

    edges: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]
    ids: Mapping[tuple[int, int, int], str]

    @classmethod
    def of(cls, plan: Plan, labels: Labels) -> "TileGrid":
        """Return the tiles of a plan. If the whole image is built, they cover all of the labels."""
        starts = [sorted({tile.box.start[axis] for tile in plan.tiles}) for axis in range(3)]
        is_whole = not plan.settings.plan.region
        edges = []
        for axis in range(3):
            ends = np.array([*starts[axis], plan.region.stop[axis]], np.float64)
            # tile borders lie half-way between two voxels of the image
            at_um = plan.origin_um[axis] + (ends - 0.5) * plan.spacing_um[axis]
            places = (at_um - labels.origin_um[axis]) / labels.spacing_um[axis]
            cut = np.ceil(places - 1e-6).astype(np.int64).clip(0, labels.shape[axis])
            if is_whole:
                cut[0], cut[-1] = 0, labels.shape[axis]
            edges.append(cut)
        ids = {}
        for tile in plan.tiles:
            z, y, x = (starts[axis].index(tile.box.start[axis]) for axis in range(3))
            ids[z, y, x] = tile.id
        z_edges, y_edges, x_edges = edges
        return cls((z_edges, y_edges, x_edges), ids)

    def box(self, place: tuple[int, int, int]) -> Box:
        """Return a tile's voxels; the box may be empty."""
        pairs = [(int(e[k]), int(e[k + 1])) for e, k in zip(self.edges, place, strict=True)]
        (z0, z1), (y0, y1), (x0, x1) = pairs
        return Box((z0, y0, x0), (z1, y1, x1))

    def places(self, voxels: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the places of the tiles (n, 3) that hold these voxels (n, 3) of the region."""
        parts = [
            np.searchsorted(e, v, side="right") - 1
            for e, v in zip(self.edges, voxels.T, strict=True)
        ]
        return np.stack(parts, axis=1)


@dataclass(frozen=True, slots=True)
class Located:
    """The objects of a label map that are built, and their tiles.

    extents  extents of the n objects, by ascending label
    owners   int64 (n,): index into `tiles` of the tile that builds the object, or CUT
    tiles    tile IDs
    small    number of objects left out because they have too few voxels
    parts    labels among each tile's own voxels, by tile ID
    """

    grid: TileGrid
    extents: Extents
    owners: NDArray[np.int64]
    tiles: tuple[str, ...]
    small: int
    parts: Mapping[str, NDArray[np.uint64]]

    def owned(self, tile: str) -> NDArray[np.int64]:
        """Return the indices of the objects that a tile builds: uncut ones, then cut ones."""
        whole = np.flatnonzero(self.owners == self.tiles.index(tile))
        cut = np.flatnonzero((self.owners == CUT) & np.isin(self.extents.labels, self.parts[tile]))
        return np.concatenate([whole, cut])

    def window(self, tile: str) -> Box | None:
        """Return the voxels of a label map that a tile's objects need; None: it has no objects."""
        numbers = self.owned(tile)
        if not len(numbers):
            return None
        own = self.grid.box(next(place for place, id_ in self.grid.ids.items() if id_ == tile))
        low, high = self.extents.low[numbers], self.extents.high[numbers]
        is_cut = self.owners[numbers] == CUT
        low[is_cut] = np.maximum(low[is_cut], own.start)
        high[is_cut] = np.minimum(high[is_cut], own.stop)
        # Voxels outside the region that is built are not read.
        first = [int(edges[0]) for edges in self.grid.edges]
        last = [int(edges[-1]) for edges in self.grid.edges]
        z0, y0, x0 = np.maximum(low.min(axis=0) - HALO, first).tolist()
        z1, y1, x1 = np.minimum(high.max(axis=0) + HALO, last).tolist()
        return Box((z0, y0, x0), (z1, y1, x1))

    def near(self, window: Box) -> NDArray[np.int64]:
        """Return the indices of the objects whose box overlaps a window."""
        low, high = self.extents.low, self.extents.high
        return np.flatnonzero((low < window.stop).all(axis=1) & (high > window.start).all(axis=1))


def locate(
    plan: Plan, labels: Labels, parts: Mapping[str, Extents], smallest_voxels: int
) -> Located:
    """Return the objects of a label map with their tiles.

    parts  extents of the labels in each tile, by tile ID

    Raises UsageError if a tile has more objects than its file can number.
    """
    grid = TileGrid.of(plan, labels)
    whole = merge_extents(list(parts.values()))
    large = whole.voxels >= smallest_voxels
    centres = np.floor(whole.centroids + 0.5).astype(np.int64)
    places = grid.places(centres)
    tiles = tuple(tile.id for tile in plan.tiles)
    number = {place: tiles.index(id_) for place, id_ in grid.ids.items()}
    owners = np.array([number[z, y, x] for z, y, x in places.tolist()], np.int64)
    for place, tile in number.items():
        box = grid.box(place)
        reach = np.maximum(np.array(box.shape) * AROUND, 1)
        mine = owners == tile
        inside = (whole.low >= box.start - reach) & (whole.high <= box.stop + reach)
        owners[mine & ~inside.all(axis=1)] = CUT
    located = Located(
        grid,
        Extents(
            *(getattr(whole, name)[large] for name in ("labels", "voxels", "low", "high", "sums"))
        ),
        owners[large],
        tiles,
        int((~large).sum()),
        {tile: part.labels for tile, part in parts.items()},
    )
    for id_ in tiles:
        if (count := len(located.owned(id_))) > MAX_OBJECTS:
            raise UsageError(
                f"{labels.name}: found {count:,} objects in tile {id_}, expected at most "
                f"{MAX_OBJECTS:,}: build more tiles (--grid COLUMNSxROWS)"
            )
    return located


def tile_boxes(grid: TileGrid) -> dict[str, Box]:
    """Return the voxels of each tile, by ID."""
    return {id_: grid.box(place) for place, id_ in grid.ids.items()}
