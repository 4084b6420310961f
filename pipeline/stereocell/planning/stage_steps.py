"""Make the steps that write a plan's stage."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from stereocell.model.channel import PaintColors
from stereocell.model.object_table import ObjectTable
from stereocell.model.tile_content import TileContent
from stereocell.model.tiling import Tile
from stereocell.planning.object_tables import appearance_of_labels
from stereocell.planning.plan import Plan
from stereocell.planning.provenance import provenance
from stereocell.planning.survey import Survey
from stereocell.steps.write_stage import Tables, WriteStage
from stereocell.steps.write_stage_tile import TableOfTile, UnitPart, WriteStageTile


def stage_tile_step(
    plan: Plan,
    tile: Tile,
    units: Mapping[str, Path],
    tables: Mapping[str, ObjectTable],
    stage_dir: Path,
    parts_dir: Path | None = None,
) -> WriteStageTile:
    """Return the step that writes one tile.

    units      folder of each unit, by `<tile>/<channel>`
    tables     tables of all objects, by the ID of their label map
    parts_dir  see `WriteStageTile`
    """
    parts = [
        UnitPart(
            channel.id,
            units[f"{tile.id}/{channel.id}"],
            channel.color,
            PaintColors(channel.color, painter.color) if painter else None,
        )
        for channel in plan.channels
        for painter in [plan.painter(channel)]
    ]
    parts += [
        UnitPart(labels.id, units[f"{tile.id}/{labels.id}"], labels.color) for labels in plan.labels
    ]
    lattice = tile.lattice(plan.region)
    content = TileContent(
        id=tile.id,
        spacing_um=plan.spacing_um,
        first_um=plan.position_um(lattice.start),
        last_um=plan.position_um([end - 1 for end in lattice.stop]),
        own_shape=tile.box.shape,
        channels=(),
    )
    own = tuple(
        TableOfTile(id_, table.of_tile(tile.id), table.touching(tile.id))
        for id_, table in tables.items()
    )
    return WriteStageTile(
        content,
        tuple(parts),
        plan.shared_volumes,
        own,
        not plan.settings.volume.without_vdb,
        stage_dir=stage_dir,
        parts_dir=parts_dir,
    )


def stage_step(
    plan: Plan,
    survey: Survey,
    tiles: Sequence[WriteStageTile],
    tables: Mapping[str, ObjectTable],
) -> WriteStage:
    """Return the step that writes the stage over its tiles."""
    appearances = [survey[channel.id].appearance for channel in plan.channels]
    for labels in plan.labels:
        painter = plan.painter(labels)
        appearances.append(appearance_of_labels(labels, painter=painter.id if painter else ""))
    shown = plan.shown_at_first
    appearances = [replace(one, opens=one.id in shown) for one in appearances]
    return WriteStage(
        plan.name,
        tuple(tiles),
        plan.spacing_um,
        tuple(appearances),
        provenance(plan),
        plan.modality,
        plan.placement,
        plan.has_sides,
        plan.opens_cut and any(survey[one.id].is_body for one in plan.channels),
        Tables(tables),
    )
