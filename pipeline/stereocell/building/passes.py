"""Run the passes over a plan's voxels: each runs the steps whose results are missing.

The last pass builds the units. The passes before it find values that all tiles of a channel or a
label map share, such as the level.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product
from typing import TypeVar

from stereocell.building.out_folder import OutFolder
from stereocell.building.run_on_input import run_pass
from stereocell.engine.run import Engine
from stereocell.engine.run_steps import Kept, Results
from stereocell.engine.step import Step
from stereocell.isosurface.level_evidence import TileEvidence
from stereocell.model.tiling import Tile
from stereocell.model.unit import Unit
from stereocell.planning.channels import Channel
from stereocell.planning.level_choice import Found
from stereocell.planning.located_objects import Located, TileGrid, locate, tile_boxes
from stereocell.planning.plan import Plan
from stereocell.planning.survey_steps import components_step, evidence_step, window_step
from stereocell.steps.find_extents import FindExtents
from stereocell.steps.find_window import Window
from stereocell.steps.gather_evidence import GatherEvidence
from stereocell.steps.labels import Labels
from stereocell.steps.sum_components import SumComponents, Sums

R = TypeVar("R")
ByChannel = dict[str, Results[R]]  # results by channel ID, then by tile ID


@dataclass(frozen=True, slots=True)
class Passes:
    """The passes over one plan, with the folder of their results and the workers.

    Each method raises SourceError if an input changed since the plan, TasksFailedError if steps
    fail.
    """

    out_folder: OutFolder
    plan: Plan
    engine: Engine

    def windows(self) -> Results[Window]:
        """Return each channel's window and background, by channel ID."""
        kept = {}
        for channel in self.plan.channels:
            step = window_step(self.plan, channel)
            place = self.out_folder.statistics_file(channel.voxels_id, step.key)
            kept[channel.id] = Kept(channel.base or channel.name, step, place)
        run_pass(self.out_folder, self.plan, self.engine, "windows", kept.values())
        return Results(kept, self.out_folder.out)

    def evidence(self, windows: Mapping[str, Window]) -> ByChannel[TileEvidence]:
        """Return the evidence for a channel's levels in each tile."""

        def step_of(tile: Tile, channel: Channel) -> GatherEvidence | None:
            if channel.source:  # shares of tissue have a known level
                return None
            return evidence_step(self.plan, tile.box, channel=channel, window=windows[channel.id])

        return self._by_tile("evidence", step_of)

    def components(self, found: Mapping[str, Found]) -> list[ByChannel[Sums]]:
        """Return the sums over each tile's components, for each level that a channel may have."""

        def of_level(index: int) -> ByChannel[Sums]:
            def step_of(tile: Tile, channel: Channel) -> SumComponents | None:
                return components_step(self.plan, tile, channel, found[channel.id], index)

            return self._by_tile("components", step_of)

        most = max((len(one.candidates) for one in found.values()), default=0)
        return [of_level(index) for index in range(most)]

    def objects(self, labels: Labels) -> Located:
        """Return which tile builds which object of a label map."""
        kept = {}
        for tile, box in tile_boxes(TileGrid.of(self.plan, labels)).items():
            step = FindExtents(labels.voxels, box)
            place = self.out_folder.tile_result("extents", tile, labels.id, step.key)
            kept[tile] = Kept(f"{tile}/{labels.name}", step, place)
        run_pass(self.out_folder, self.plan, self.engine, "objects", kept.values())
        parts = {tile: one.read() for tile, one in kept.items()}
        return locate(self.plan, labels, parts, self.plan.settings.objects.smallest_voxels)

    def units(self, missing: list[Kept[Unit]]) -> None:
        """Build the missing units. This pass is the last one that reads the inputs."""
        run_pass(self.out_folder, self.plan, self.engine, "units", missing, is_last=True)

    def _by_tile(
        self, name: str, step_of: Callable[[Tile, Channel], Step[R] | None]
    ) -> ByChannel[R]:
        """Run a pass over the tiles of all channels.

        step_of  returns the step for one tile of a channel; None: there is nothing to do
        """
        kept: dict[str, dict[str, Kept[R]]] = {channel.id: {} for channel in self.plan.channels}
        for tile, channel in product(self.plan.tiles, self.plan.channels):
            step = step_of(tile, channel)
            if step is not None:
                place = self.out_folder.tile_result(name, tile.id, channel.voxels_id, step.key)
                title = f"{tile.id}/{channel.base or channel.name}"
                kept[channel.id][tile.id] = Kept(title, step, place)
        every = [one for tile in self.plan.tiles for one in _of_tile(kept, tile.id)]
        run_pass(self.out_folder, self.plan, self.engine, name, every)
        return {id_: Results(by_tile, self.out_folder.out) for id_, by_tile in kept.items()}


def _of_tile(kept: Mapping[str, Mapping[str, Kept[R]]], tile_id: str) -> list[Kept[R]]:
    """Return the results of one tile, in the order of the channels."""
    return [by_tile[tile_id] for by_tile in kept.values() if tile_id in by_tile]
