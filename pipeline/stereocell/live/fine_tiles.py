"""Read one tile of a source as finely as a build does, in 8 bits over a display window."""

from dataclasses import dataclass, replace
from math import prod
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from stereocell.isosurface.holder import Holder
from stereocell.live.coarse_channel import find_grid, places_in, read_coarse
from stereocell.model.errors import SourceError
from stereocell.model.lattice import Lattice
from stereocell.model.tile_content import APRON
from stereocell.model.tiling import Tile
from stereocell.planning.input_files import first_states
from stereocell.planning.plan import Plan
from stereocell.planning.plan_source import source_of
from stereocell.read import Dataset
from stereocell.steps.cut_voxels import cut_voxels
from stereocell.transfer.joint_histogram import to_eight_bits

# Voxels of the largest tile that is read at the planned level. It takes about 350 MB of memory
# while its tree is made.
PLANNED_VOXELS = 1 << 26
COARSER_VOXELS = 1 << 24  # voxels to which a larger tile is reduced


class ReadFine(Protocol):
    """Reads one tile as finely as a build does; see `FineTiles.read`."""

    def read(
        self, tile_id: str, channel_id: str, window: tuple[float, float], holder: Holder | None
    ) -> NDArray[np.uint8]: ...


@dataclass(frozen=True, slots=True)
class FineTiles:
    """The tiles of a plan's source."""

    plan: Plan
    dataset: Dataset

    def sizes(self) -> dict[str, tuple[int, int, int]]:
        """Return the number of voxels (x, y, z) of each tile, with the apron, by the tile's ID.

        The result is empty for a label map without an image: its objects are not read by tiles.
        """
        if not self.plan.channels:
            return {}
        return {tile.id: self._size(tile) for tile in self.plan.tiles}

    def read(
        self, tile_id: str, channel_id: str, window: tuple[float, float], holder: Holder | None
    ) -> NDArray[np.uint8]:
        """Return a tile's voxels with the apron, uint8 (z, y, x), as fine as a build's if they fit.

        window  voxel values that become 0 and 255
        holder  pieces that a build replaces by air, or None

        Raises SourceError if the source can't be read, or has changed since it was planned.
        """
        try:
            voxels = self._read(tile_id, channel_id, holder)
        except SourceError:
            self._require_unchanged()
            raise
        self._require_unchanged()
        return to_eight_bits(voxels, window)

    def _read(self, tile_id: str, channel_id: str, holder: Holder | None) -> NDArray[Any]:
        plan, tile = self.plan, self.plan.tile(tile_id)
        channel = next(one for one in plan.channels if one.id == channel_id)
        own = tile.lattice(plan.region)
        if self._is_planned(tile):
            box = own.grown((APRON, APRON, APRON), plan.region)
            lattice = Lattice(box, own, plan.region, plan.spacing_um, plan.origin_um)
            read = self.dataset.read(channel.index, box, plan.level).voxels
            return cut_voxels(read, lattice, holder)
        coarse = read_coarse(self.dataset, replace(plan, region=own), channel, COARSER_VOXELS)
        places = places_in(own, coarse.grid.step)
        voxels = coarse.at(places)
        return voxels if holder is None else holder.left_out_at(voxels, places)

    def change(self) -> str:
        """Return an error's line if the source has changed since it was planned, else ''."""
        states = first_states(source_of(self.plan))
        if states is None or not states.changed():
            return ""
        return (
            f"{self.plan.source}: changed since it was opened, expected a source that does not "
            "change while it is shown: end the command and run it again"
        )

    def _require_unchanged(self) -> None:
        if line := self.change():
            raise SourceError(line)

    def _is_planned(self, tile: Tile) -> bool:
        return prod(tile.lattice(self.plan.region).shape) <= PLANNED_VOXELS

    def _size(self, tile: Tile) -> tuple[int, int, int]:
        own = tile.lattice(self.plan.region)
        if self._is_planned(tile):
            depth, height, width = (n + 2 * APRON for n in own.shape)
        else:
            grid = find_grid(self.dataset, replace(self.plan, region=own), COARSER_VOXELS)
            depth, height, width = (len(along) for along in places_in(own, grid.step))
        return width, height, depth
