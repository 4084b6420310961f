"""The views of a source while it is built: surfaces of finished tiles, coarse volumes elsewhere.

Each view is a bundle in a folder of its own, so that a page can still use an older view. Files that
several views share are hard links.
"""

import os
import shutil
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.bundle.tile_part import BundleTile, TileChannel, read_part
from stereocell.bundle.write import Composed
from stereocell.bundle.write_tile import write_tile
from stereocell.isosurface.holder import Holder
from stereocell.live.coarse_channel import CoarseChannel
from stereocell.live.coarse_tiles import Sizes, write_coarse_tiles
from stereocell.live.first_view import NOT_BUILT, as_surface, write_view
from stereocell.live.view_folders import next_view
from stereocell.model.tiling import Tile
from stereocell.planning.plan import Plan
from stereocell.planning.stage_steps import stage_step, stage_tile_step
from stereocell.planning.unit_steps import unit_steps
from stereocell.steps.unit_files import is_whole
from stereocell.usd.composed_appearance import ComposedAppearance
from stereocell.usd.written_files import STAGE_NAME

REST = 10.0  # default of `rest`: writing views takes at most about a tenth of a build's time


@dataclass(frozen=True, slots=True)
class _Survey:
    """The inputs that all views of a build share. They come from the survey of the build."""

    plan: Plan
    units: Mapping[str, Path]
    appearances: tuple[ComposedAppearance, ...]
    step_m: float
    is_cut: bool
    coarse: Mapping[str, BundleTile]
    apart: float  # see `CoarseTiles`


class PartialView:
    """Writes views as tiles are finished.

    plan     the plan of the first view
    read     coarse voxels of the first view, by the ID of the voxels
    out      the folder of the build
    scratch  the folder of the views
    sizes    see `write_first_view`
    rest     least time between two views, as a multiple of the time that the last one took; with
             many tiles, not every tile leads to a view
    """

    def __init__(
        self,
        plan: Plan,
        read: Mapping[str, CoarseChannel],
        out: Path,
        scratch: Path,
        *,
        sizes: Sizes | None = None,
        rest: float = REST,
    ) -> None:
        self._plan, self._read, self._out, self._scratch = plan, read, out, scratch
        self._sizes = sizes or {}
        self._rest, self._next_s, self._has_unseen = rest, 0.0, False
        self._survey: _Survey | None = None
        self._finished: dict[str, BundleTile] = {}
        self.holders: Mapping[str, Holder] = {}  # pieces that the build leaves out, by channel ID

    @property
    def finished(self) -> int:
        """Number of finished tiles."""
        return len(self._finished)

    def add(self, tile_id: str | None) -> Path | None:
        """Write a view if a tile has new surfaces, and return its folder; else return None.

        tile_id  the tile whose unit was just built; None to check all tiles, and to write a view
                 without waiting, as at the start and the end of a build

        A label map without an image gets no views: its objects show once all are built. There are
        no views either if the build has another plan than the first view, because the source or
        its metadata changed meanwhile.
        """
        survey = self._survey or self._begin()
        if survey is None:
            return None
        new = [
            tile
            for tile in survey.plan.tiles
            if tile_id in (None, tile.id)
            and tile.id not in self._finished
            and all(is_whole(folder) for folder in _units_of(survey, tile))
        ]
        for tile in new:
            self._finished[tile.id] = self._export(survey, tile)
        self._has_unseen |= bool(new)
        began_s = time.monotonic()
        if not self._has_unseen or (tile_id is not None and began_s < self._next_s):
            return None
        root = self._write(survey)
        end_s = time.monotonic()
        self._has_unseen, self._next_s = False, end_s + self._rest * (end_s - began_s)
        return root

    def _begin(self) -> _Survey | None:
        """Prepare the views: write the stage that all tiles share, and the coarse volumes again.

        The coarse volumes now use the survey's windows, which come from all voxels.
        """
        if not self._plan.channels:
            return None
        out_folder = OutFolder(self._out)
        plan = replace(out_folder.plan(), labels=())
        if (plan.fingerprint, plan.region) != (self._plan.fingerprint, self._plan.region):
            return None
        survey = read_survey(out_folder)
        found = {channel.id: survey[channel.id].holder for channel in plan.channels}
        self.holders = {name: holder for name, holder in found.items() if holder is not None}
        # An earlier build that was stopped may have left these folders. Its views stay.
        for leftover in ("coarse", "parts", "stage"):
            shutil.rmtree(self._scratch / leftover, ignore_errors=True)
        steps = unit_steps(plan, survey)
        units = {name: out_folder.unit_dir(name, step.key) for name, step in steps.items()}
        folder = self._stage.parent
        tiles = [stage_tile_step(plan, tile, units, {}, folder) for tile in plan.tiles]
        stage_step(plan, survey, tiles, {}).write(folder)
        composed = Composed.open(self._stage)
        coarse = write_coarse_tiles(
            plan,
            self._scratch / "coarse",
            self._read,
            composed.appearances,
            self._sizes,
            self.holders,
        )
        self._survey = _Survey(
            plan,
            units,
            composed.appearances,
            composed.step_m,
            plan.opens_cut and any(survey[one.id].is_body for one in plan.channels),
            {tile.id: tile for tile in coarse.tiles},
            coarse.apart,
        )
        return self._survey

    @property
    def _stage(self) -> Path:
        return self._scratch / "stage" / STAGE_NAME

    def _export(self, survey: _Survey, tile: Tile) -> BundleTile:
        """Export a tile's surfaces through the stage; return the tile with its coarse volumes."""
        step = stage_tile_step(survey.plan, tile, survey.units, {}, self._stage.parent)
        # The volumes are most of the work. They are not written, since the coarse ones stay.
        replace(step, shared=frozenset(unit.channel_id for unit in step.units)).run()
        part = self._scratch / "parts" / tile.id
        looks, step_m = survey.appearances, survey.step_m
        write_tile(self._stage, tile.id, part, appearances=looks, step_m=step_m)
        built = read_part(part, tile.id)
        shutil.rmtree(self._stage.parent / "tiles" / tile.id)
        coarse = survey.coarse[tile.id]
        merged = map(_merge, built.channels, coarse.channels)
        return replace(coarse, channels=tuple(merged))

    def _write(self, survey: _Survey) -> Path:
        root = next_view(self._scratch)
        tiles = [self._finished.get(tile.id, survey.coarse[tile.id]) for tile in survey.plan.tiles]
        for tile in tiles:
            for ref in (ref for channel in tile.channels for ref in channel.files):
                own = self._scratch / "parts" / tile.id / ref.path
                _link(own if own.exists() else self._scratch / "coarse" / ref.path, root / ref.path)
        appearances = survey.appearances
        if len(self._finished) < len(tiles):
            coarse = [self._read[channel.voxels_id] for channel in survey.plan.channels]
            appearances = tuple(
                as_surface(appearance, one, survey.apart)
                for appearance, one in zip(appearances, coarse, strict=True)
            )
        write_view(
            survey.plan,
            root,
            [_with_built_surface(one, i, tiles) for i, one in enumerate(appearances)],
            tiles,
            is_cut=survey.is_cut,
            finished=self._finished,
        )
        return root


def _units_of(survey: _Survey, tile: Tile) -> list[Path]:
    return [survey.units[f"{tile.id}/{channel.id}"] for channel in survey.plan.channels]


def _with_built_surface(
    appearance: ComposedAppearance, channel: int, tiles: Sequence[BundleTile]
) -> ComposedAppearance:
    """Return a channel's appearance in a view: without a surface until some tile has one."""
    if appearance.surface == "none" or any(tile.channels[channel].lods for tile in tiles):
        return appearance
    return replace(appearance, surface="none", surface_reason=NOT_BUILT)


def _merge(built: TileChannel, coarse: TileChannel) -> TileChannel:
    """Combine the surfaces of a tile's built channel with the volume of its coarse channel."""
    return replace(
        coarse,
        lods=built.lods,
        triangles=built.triangles,
        distances=built.distances,
        files=(*built.files, *coarse.files),
    )


def _link(file: Path, place: Path) -> None:
    """Link a file to a second place; copy it if the system allows no link."""
    place.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(file, place)
    except OSError:
        shutil.copyfile(file, place)
