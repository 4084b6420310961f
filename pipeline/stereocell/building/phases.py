"""The first phases of a build, each a function on OUT: plan -> units -> stage.

The bundle and the report follow: bundle_phase.py, report/phase.py. Every phase skips finished
work: a result is named by everything that it depends on.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from stereocell.building.object_passes import locate_objects, read_notes
from stereocell.building.out_folder import OutFolder
from stereocell.building.own_parts import (
    require_own_places,
    require_own_stage,
)
from stereocell.building.passes import run_passes
from stereocell.building.phase import (
    digest_of_stage,
    phase_of,
)
from stereocell.building.surface_cover import notes_on_cover
from stereocell.building.survey_file import read_survey
from stereocell.engine.run import Engine, console
from stereocell.engine.run_steps import run_missing
from stereocell.model.channel import PaintColors
from stereocell.model.counted import counted
from stereocell.model.object_table import ObjectTable
from stereocell.model.tile_content import TileContent
from stereocell.model.tiling import Tile
from stereocell.planning.input_files import require_table
from stereocell.planning.level_estimate import notes_on_levels
from stereocell.planning.object_tables import (
    appearance_of_labels,
    make_table,
    table_of,
)
from stereocell.planning.plan import Plan
from stereocell.planning.plan_notes import (
    changes_of,
    print_notes,
    words_of_spacing,
)
from stereocell.planning.provenance import provenance, provenance_record
from stereocell.planning.settings import Settings, to_readable_toml
from stereocell.planning.settle import settle
from stereocell.steps.labels import Labels
from stereocell.steps.unit_files import load_objects
from stereocell.steps.write_stage import Tables, WriteStage
from stereocell.steps.write_stage_tile import (
    StageTile,
    TableOfTile,
    UnitPart,
    WriteStageTile,
)
from stereocell.storage.file_list import FileList
from stereocell.storage.json_files import write_sealed
from stereocell.storage.location import require_apart
from stereocell.storage.sealed_text import write_sealed_text
from stereocell.storage.workspace import remove


def make(
    source: str,
    out: Path,
    settings: Settings,
    *,
    choice: Sequence[str] = (),
    engine: Engine | None = None,
) -> Plan:
    """Write OUT/plan.json and the settings used (TOML). The same plan again changes nothing.

    choice  notes on how the settings were chosen; see `load_for`
    engine  the workers of all other phases, where these follow at once: before anything is written,
            a cluster is joined, and the places of the phases are guarded; None: the plan alone

    Raises StereoCellError; OUT is unchanged then.
    """
    require_apart(source, out)
    out_folder = OutFolder(out)
    out_folder.require_name()
    with phase_of(out_folder, "plan") as phase:
        if engine is not None:
            require_own_places(out_folder, is_same_plan=True)  # what no plan may replace
        plan = settle(source, settings, choice)
        plan = replace(plan, notes=(*plan.notes, *notes_on_levels(plan)))
        text = to_readable_toml(plan.settings)
        out_folder.require_writable()
        there = out_folder.replaced_plan(plan)
        out_folder.require_own_settings(plan, there)
        if engine is not None:
            require_own_places(out_folder, is_same_plan=there == plan)
            engine.join()
        print_notes(plan)  # an error stands alone
        if there is not None and (changes := changes_of(there, plan)):
            console.print(f"plan: {changes}", markup=False, soft_wrap=True)
        phase.is_up_to_date = not out_folder.save_plan(plan)
        write_sealed_text(out_folder.settings_file, text)
        write_sealed(out_folder.provenance_file, provenance_record(plan))
    shape = " x ".join(str(n) for n in plan.region.shape)
    console.print(
        f"plan: {plan.name}, level {plan.level} ({plan.level_reason}); {shape} voxels (z, y, x) of "
        f"{words_of_spacing(plan.spacing_um)}, "
        f"{counted(len(plan.tiles), 'tile')} x {counted(len(plan.channels), 'channel')}"
        + "".join(f", objects of {one.name}" for one in plan.labels)
    )
    return plan


def run_units(out: Path, engine: Engine, *, only: str | None = None) -> None:
    """Find windows and levels for all units, then build the units, or `only` one of them.

    only  `<tile>/<channel>`; None: all units

    Raises SourceError where the source changed since the plan, TasksFailedError where units fail.
    """
    out_folder = OutFolder(out)
    plan = out_folder.plan()
    with phase_of(out_folder, "units") as phase:
        built, missing = run_passes(out_folder, plan, engine=engine, only=only)
        phase.is_up_to_date = not built
        phase.is_whole = not missing
        units = len(plan.tiles) * (len(plan.channels) + len(plan.labels))
        phase.about = "" if built == units else f"{built} of {units} units"
        if missing:
            console.print(f"units: {missing} of {units} are still to be built")
        elif built:
            for note in notes_on_cover(out_folder, plan):
                console.print(f"units: {note}", markup=False, soft_wrap=True)
    require_table(plan.settings.objects.table)


def run_stage(out: Path, engine: Engine) -> None:
    """Write OUT/stage from the units: stage.usda, looks/, tiles/ and, where there is a surface,
    specimen.usdz; last their list, files.json. Other files stay.

    Raises OutputError where units are missing or damaged, TasksFailedError where tiles fail.
    """
    out_folder = OutFolder(out)
    plan = out_folder.plan()
    with phase_of(out_folder, "stage") as phase:
        out_folder.require_units_of(plan)
        index, survey = out_folder.index(), read_survey(out_folder)
        appearances = [survey[channel.id].appearance for channel in plan.channels]
        opens_cut = plan.opens_cut and any(survey[one.id].is_body for one in plan.channels)
        appearances += [
            appearance_of_labels(labels, painter=painter.id if painter else "")
            for labels in plan.labels
            for painter in [plan.painter(labels)]
        ]
        tables = {
            labels.id: _table(out_folder, plan, labels, index, engine) for labels in plan.labels
        }
        tiles = [
            _stage_tile(out_folder, plan, index=index, tile=tile, tables=tables)
            for tile in plan.tiles
        ]
        stage = WriteStage(
            plan.name,
            tuple(tile.step for tile in tiles),
            plan.spacing_um,
            tuple(appearances),
            provenance(plan),
            plan.modality,
            plan.placement,
            plan.has_sides,
            opens_cut,
            Tables(tables),
        )
        done = partial(digest_of_stage, out_folder)
        if phase.is_done(stage.key, done, require_own=require_own_stage):
            return
        remove(out_folder.stage_list)  # the list of the earlier stage
        run_missing(engine, "stage", tiles)
        stage.write(out_folder.stage_dir)
        out_folder.remove_other_folders(
            out_folder.stage_dir / "tiles", {tile.id for tile in plan.tiles}
        )
        lists = [tile.listed() for tile in tiles]
        files = {path: entry for listed, _ in lists for path, entry in listed.items()}
        _tell_size(files, sum(measured for _, measured in lists))
        stage.write_list(out_folder.stage_dir, files)


def _stage_tile(
    out_folder: OutFolder,
    plan: Plan,
    *,
    index: Mapping[str, str],
    tile: Tile,
    tables: Mapping[str, ObjectTable],
) -> StageTile:
    """Return the task that writes one tile.

    index   the units' keys, by `<tile>/<channel>`
    tables  of all objects, by the ID of their label map
    """

    def part(channel_id: str, paint: PaintColors | None = None) -> UnitPart:
        name = f"{tile.id}/{channel_id}"
        return UnitPart(channel_id, out_folder.unit_dir(name, index[name]), paint)

    units = [
        part(channel.id, PaintColors(channel.color, painter.color) if painter else None)
        for channel in plan.channels
        for painter in [plan.painter(channel)]
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
    units += [part(labels.id) for labels in plan.labels]
    step = WriteStageTile(content, tuple(units), plan.shared_volumes, own)
    return StageTile(step, out_folder.tile_file(tile.id), out_folder.stage_dir)


def _table(
    out_folder: OutFolder, plan: Plan, labels: Labels, index: Mapping[str, str], engine: Engine
) -> ObjectTable:
    """Return the table of a label map's objects, and print what did not fit it."""
    names = {tile.id: f"{tile.id}/{labels.id}" for tile in plan.tiles}
    facts = {
        tile: load_objects(out_folder.unit_dir(name, index[name])) for tile, name in names.items()
    }
    located = locate_objects(out_folder, plan, labels, engine)
    notes = read_notes(out_folder, plan, labels)
    table, remarks = make_table(plan, labels, located, facts, notes, table_of(plan, labels))
    for remark in remarks:
        console.print(f"stage: {remark}", markup=False, soft_wrap=True)
    return table


def _tell_size(tiles: FileList, measured: int) -> None:
    """Say what the voxels as measured take, in bytes, of the files of all tiles."""
    if measured:
        whole = sum(entry["bytes"] for entry in tiles.values())
        console.print(
            f"stage: {measured / 1e6:.1f} of {whole / 1e6:.1f} MB are voxels as measured, for "
            "other windows; --bits 8 leaves them out"
        )
