"""The phases of a build, from top to bottom: plan -> units -> stage -> bundle. A report follows.

Before the units, passes find values that all tiles of a channel share: windows -> evidence ->
levels -> components. Each phase is a function on OUT and skips finished work, because the name of a
result is a key of everything that the result depends on.

A phase imports its steps once it has read its inputs, because their libraries are slow to import.
So a command reports a missing input at once, and a plan needs no USD.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from stereocell.building.out_folder import OutFolder
from stereocell.building.own_parts import require_own_places
from stereocell.building.phase import phase_of
from stereocell.building.replaced_plan import replace_plan, replaced_plan, require_own_settings
from stereocell.building.required_stage import require_stage
from stereocell.building.running_pass import remove_mixed
from stereocell.bundle.manifest import require_bundle
from stereocell.engine.run import Engine, console
from stereocell.engine.run_steps import Kept, run_missing
from stereocell.planning.input_files import require_table
from stereocell.planning.plan import Plan
from stereocell.planning.plan_notes import changes_of, print_notes, summary_of
from stereocell.planning.provenance import provenance_record
from stereocell.planning.settings import Settings, to_readable_toml
from stereocell.planning.settle import settle
from stereocell.read.image import printable
from stereocell.read.source_place import require_apart
from stereocell.storage.assets import viewer_dist
from stereocell.storage.json_files import write_sealed
from stereocell.storage.overwriting import is_forced
from stereocell.storage.sealed_text import write_sealed_text
from stereocell.usd.written_files import USDZ_NAME, describe_parts, read_stage_list


def make_plan(
    source: str,
    out: Path,
    settings: Settings,
    *,
    choice: Sequence[str] = (),
    title: str = "",
    engine: Engine | None = None,
) -> Plan:
    """Write OUT/plan.json and the settings used (TOML). The same plan again changes nothing.

    choice  notes on how the preset was chosen; see `load_for`
    title   name of the specimen; empty: the source's name for it
    engine  workers of the other phases, if these follow at once. Then a cluster is joined, and the
            places of all phases are checked, before anything is written. None: only the plan is
            made

    Raises StereoCellError, and leaves OUT unchanged then.
    """
    require_apart(source, out)
    out_folder = OutFolder(out)
    out_folder.require_name()
    with phase_of(out_folder, "plan") as phase:
        if engine is not None:
            require_own_places(out_folder, is_same_plan=True)  # fails before the input is read
        plan = settle(source, settings, choice, title=title)
        from stereocell.planning.level_estimate import notes_on_levels

        plan = replace(plan, notes=(*plan.notes, *notes_on_levels(plan)))
        text = to_readable_toml(plan.settings)
        out_folder.require_writable()
        there = replaced_plan(out_folder, plan)
        require_own_settings(out_folder, plan, there)
        if engine is not None:
            require_own_places(out_folder, is_same_plan=there == plan)
            engine.join()
        print_notes(plan)  # printed late, so that an error would stand alone
        if there is not None and (changes := changes_of(there, plan)):
            phase.print(changes)
        phase.is_up_to_date = not replace_plan(out_folder, plan)
        write_sealed_text(out_folder.settings_file, text)
        write_sealed(out_folder.provenance_file, provenance_record(plan))
    console.print(f"plan: {summary_of(plan)}")
    return plan


def run_units(out: Path, engine: Engine, *, only: str | None = None) -> None:
    """Find windows and levels for all units, then build the units, or one of them.

    only  `<tile>/<channel>` of the unit to build; None: all units

    Raises SourceError if the source changed since the plan, TasksFailedError if units fail.
    """
    out_folder = OutFolder(out)
    plan = out_folder.plan()
    from stereocell.building.find_survey import find_survey
    from stereocell.building.object_records import save_notes
    from stereocell.building.passes import Passes
    from stereocell.building.surface_cover import notes_on_cover
    from stereocell.planning.label_numbers import notes_on_objects
    from stereocell.planning.object_steps import object_steps
    from stereocell.planning.unit_steps import choose_units, longest_first, unit_steps

    with phase_of(out_folder, "units") as phase:
        remove_mixed(out_folder, plan)
        wanted = choose_units(plan, only)
        passes = Passes(out_folder, plan, engine)
        survey = find_survey(passes, phase)
        for labels in plan.labels:
            save_notes(out_folder, plan, labels)
        located = {labels.id: passes.objects(labels) for labels in plan.labels}
        steps = {**unit_steps(plan, survey), **object_steps(plan, located, survey)}
        units = {
            name: Kept(wanted.get(name, name), step, out_folder.unit_dir(name, step.key))
            for name, step in steps.items()
        }
        missing = {name: unit for name, unit in units.items() if not unit.is_whole()}
        asked = (name for name in missing if name in wanted)
        to_build = [missing[name] for name in longest_first(plan, survey, asked)]
        if to_build:
            for labels in plan.labels:
                phase.print(*notes_on_objects(labels, located[labels.id]))
        passes.units(to_build)
        phase.is_up_to_date = not to_build
        if len(to_build) < len(units):
            phase.about = f"{len(to_build)} of {len(units)} units"
        phase.is_whole = len(missing) == len(to_build)
        if not phase.is_whole:
            phase.print(f"{len(missing) - len(to_build)} of {len(units)} units are not built yet")
        else:
            out_folder.save_units(plan, {name: step.key for name, step in steps.items()})
            if to_build:
                phase.print(*notes_on_cover(out_folder, plan))
    require_table(plan.settings.objects.table)


def run_stage(out: Path, engine: Engine) -> None:
    """Write OUT/stage from the units.

    It holds the layers, looks/, tiles/, and specimen.usdz if there is a surface. Their list,
    files.json, is written last. Other files stay.

    Raises OutputError if units are missing or damaged, TasksFailedError if tiles fail.
    """
    out_folder = OutFolder(out)
    plan = out_folder.plan()
    from stereocell.building.object_records import table_of_objects
    from stereocell.building.passes import Passes
    from stereocell.building.survey_file import read_survey
    from stereocell.planning.stage_steps import stage_step, stage_tile_step

    with phase_of(out_folder, "stage") as phase:
        out_folder.require_units_of(plan)
        survey, stage_dir = read_survey(out_folder), out_folder.stage_dir
        units = {name: out_folder.unit_dir(name, key) for name, key in out_folder.index().items()}
        tables = {}
        for labels in plan.labels:
            located = Passes(out_folder, plan, engine).objects(labels)
            tables[labels.id], remarks = table_of_objects(out_folder, plan, labels, located)
            phase.print(*remarks)
        parts_dir = out_folder.stage_parts_dir
        steps = [
            stage_tile_step(plan, tile, units, tables, stage_dir, parts_dir) for tile in plan.tiles
        ]
        tiles = {
            tile.id: Kept(tile.id, step, out_folder.tile_file(tile.id), step.inputs)
            for tile, step in zip(plan.tiles, steps, strict=True)
        }
        stage = stage_step(plan, survey, steps, tables)
        if phase.is_done(stage):
            return
        out_folder.remove(stage_dir / USDZ_NAME)
        out_folder.remove(out_folder.stage_list)  # lists the files of the earlier stage
        to_write = [step for step in steps if not tiles[step.content.id].is_whole()]
        out_folder.remove_other_folders(parts_dir, {step.key for step in to_write})
        run_missing(engine, "stage", [part for step in to_write for part in step.part_tasks()])
        run_missing(engine, "tiles", [tiles[step.content.id] for step in to_write])
        phase.print(stage.write(stage_dir))
        out_folder.remove_other_folders(stage_dir / "tiles", {*tiles})
        made = {id_: tile.read() for id_, tile in tiles.items()}
        files = {
            f"tiles/{id_}/{name}": entry
            for id_, one in made.items()
            for name, entry in one.files.items()
        }
        if measured := sum(one.measured_bytes for one in made.values()):
            whole = sum(entry["bytes"] for entry in files.values())
            phase.print(
                f"{measured / 1e6:.1f} of {whole / 1e6:.1f} MB are voxels as measured, which other "
                "windows need; --bits 8 leaves them out"
            )
        stage.write_list(stage_dir, files, engine)
        phase.print(describe_parts(read_stage_list(stage_dir)))
        out_folder.remove(parts_dir)


def run_bundle(
    out: Path, engine: Engine, *, stage: Path | None = None, is_strict: bool = False
) -> None:
    """Write OUT/bundle from the composed stage.

    stage      layer over the stage, with edits; None: OUT/stage/stage.usda
    is_strict  whether an edit that the bundle does not take over is an error

    Raises OutputError if the stage is missing, StageError if it can't be read.
    """
    out_folder = OutFolder(out)
    with phase_of(out_folder, "bundle") as phase:
        path = require_stage(out_folder, stage)
        from stereocell.building import bundle_inputs
        from stereocell.steps.write_bundle import bundle_part_tasks, opened_stage, write_bundle

        viewer = viewer_dist()
        step = bundle_inputs.bundle_step(out_folder, path, viewer)
        bundle_inputs.require_kept_stage(out_folder)
        bundle_inputs.remove_half_bundle(out_folder)
        if not is_forced():
            require_bundle(out_folder.bundle_dir)  # fails before the phase is recorded as begun
        if is_strict:  # checked even for a finished bundle, which may be made without --strict
            with opened_stage(path) as composed:
                composed.require_all_taken()
        if not phase.is_done(step):
            out_folder.remove_other_folders(out_folder.parts_dir, {step.key})
            parts = out_folder.parts_dir / step.key
            with opened_stage(path) as composed:
                phase.print(*composed.notes(out_folder.stage_file))
                run_missing(engine, "bundle", bundle_part_tasks(composed, parts))
                for note in write_bundle(composed, parts, out_folder.bundle_dir, viewer):
                    phase.print(note)
            phase.about = "" if stage is None else f"of {printable(path.name)}"
        elif stage is not None:  # lost edits are reported again, although nothing is written
            with opened_stage(path) as composed:
                phase.print(*composed.notes(out_folder.stage_file))
    out_folder.remove(out_folder.parts_dir)
    if viewer is None and not phase.is_up_to_date:
        phase.print("the viewer is not built, so the bundle has no page: run `make setup`")
