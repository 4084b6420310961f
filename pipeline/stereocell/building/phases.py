"""The first phases of a build, each a function on OUT: plan -> units -> stage.

The bundle and the report follow: bundle_phase.py, report/phase.py. Every phase skips finished
work: a result is named by everything that it depends on.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from stereocell.building.channel_colors import choose_colors, is_lone, lies_at_bone, shows_stain
from stereocell.building.channels import PALETTE, Channel, with_surfaces
from stereocell.building.hounsfield import believe, settle_modality
from stereocell.building.input_files import open_anew, require_table, watch_table
from stereocell.building.intensities import doubt_of, require_intensities
from stereocell.building.label_maps import Labels, are_alone, find_labels
from stereocell.building.level_estimate import notes_on_levels
from stereocell.building.object_passes import locate_objects, read_notes, told_before
from stereocell.building.object_tables import (
    appearance_of_labels,
    make_table,
    require_color_by,
    table_of,
)
from stereocell.building.open_source import as_asked
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
from stereocell.building.plan import Plan, choose_level, make_plan, parse_region
from stereocell.building.plan_notes import (
    changes_of,
    ignored_notes,
    print_notes,
    told_of_absent,
    told_of_gaps,
    words_of_spacing,
)
from stereocell.building.settings import INTENSITY, Settings, to_dict, to_readable_toml
from stereocell.building.steps.build_unit import BuildUnit
from stereocell.building.steps.find_window import FindWindow
from stereocell.building.steps.gather_evidence import GatherEvidence
from stereocell.building.steps.sum_components import SumComponents
from stereocell.building.steps.write_stage import Tables, WriteStage
from stereocell.building.steps.write_stage_tile import WriteStageTile, stage_tile_step
from stereocell.building.surface_cover import notes_on_cover
from stereocell.building.survey_file import read_survey
from stereocell.building.unit_files import load_objects
from stereocell.engine.run import Engine, console
from stereocell.engine.run_steps import Kept, run_missing
from stereocell.engine.step_record import libraries_of
from stereocell.meshes.alpha_wrap import find_wrapper
from stereocell.model.counted import counted
from stereocell.model.errors import UsageError
from stereocell.model.extra_packages import version_of
from stereocell.model.object_table import ObjectTable
from stereocell.model.tiling import Box
from stereocell.model.version import GENERATOR
from stereocell.read.known_formats import format_of
from stereocell.read.remarks import CAST
from stereocell.read.source_place import require_apart
from stereocell.storage.file_list import FileList
from stereocell.storage.json_files import write_sealed
from stereocell.storage.location import Location
from stereocell.storage.sealed_text import write_sealed_text
from stereocell.storage.workspace import remove
from stereocell.textures.map_packages import (
    UNWRAPPER,
    require_map_packages,
)

# the steps whose libraries stand in the provenance of a stage
_STEPS = tuple(
    step.__name__ for step in (FindWindow, GatherEvidence, SumComponents, BuildUnit, WriteStageTile)
)


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


def settle(source: str, settings: Settings, choice: Sequence[str] = ()) -> Plan:
    """Return the plan of a build, with its notes. Nothing is written or printed.

    choice  notes on how the settings were chosen; see `load_for`

    Raises StereoCellError where the source can't be read, or the settings don't fit it.
    """
    location = Location.of(source).source
    options = settings.plan
    if settings.surface.wrap == "alpha-wrap":
        find_wrapper()
    if settings.unwrap.maps:
        require_map_packages()
    _require_labels(settings)
    dataset = believe(open_anew(as_asked(location, options)), options.taken_as)
    alone = are_alone(settings.labels)
    settings, modality = settle_modality(dataset, settings, are_labels=alone)
    indices = dataset.find_channels(options.channels) if options.channels else None
    chosen = range(0 if alone else len(dataset.channels)) if indices is None else indices
    wanted = [dataset.channels[index] for index in chosen]
    colors = choose_colors(
        [(one.name, one.color) for one in wanted],
        modality=modality.code,
        is_alone=is_lone([one.name for one in dataset.channels]),
        is_bone=lies_at_bone(settings.iso_values, is_hounsfield=modality.is_hounsfield),
        is_stained=shows_stain(dataset.levels[0].spacing_um, is_dark=options.dark),
    )
    channels = [
        Channel(index, one.name, color)
        for index, one, color in zip(chosen, wanted, colors, strict=True)
    ]
    channels = with_surfaces(channels, settings.surfaces)
    level = choose_level(dataset.levels, len(channels), settings)
    found = find_labels(
        dataset,
        location,
        settings.labels,
        settings=settings,
        colors=PALETTE[len(channels) :] + PALETTE[: len(channels)],
        taken=[channel.name for channel in channels],
    )
    if options.taken_as != INTENSITY and channels:
        whole = Box((0, 0, 0), dataset.levels[level[0]].shape)
        require_intensities(dataset, chosen, parse_region(options.region, whole), level[0])
    origin = dataset.levels[level[0]].origin_um
    plan = make_plan(
        location,
        dataset.name,
        fingerprint=dataset.fingerprint,
        levels=dataset.levels,
        origin_um=origin,
        channels=channels,
        level=level,
        settings=settings,
        modality=modality.code,
        placement=dataset.placement,
        slice_axis=dataset.slice_axis(level[0]),
        has_sides=dataset.has_sides,
        labels=found.labels,
        formats={
            format_of(one).name
            for one in (location, *(labels.ref.source for labels in found.labels))
        },
    )
    if settings.objects.table:
        watch_table(settings.objects.table)
    objects = list(found.notes)
    for one in plan.labels:
        # a table that can't be read, or lacks a column, ends the command before the build
        table = table_of(plan, one)
        require_color_by(plan, one, table)
        objects += [f"table: {note}" for note in table.notes] if table else []
    gaps = told_of_absent(dataset, plan) + told_of_gaps(dataset, plan)
    objects += told_before(plan)
    objects += filter(None, map(doubt_of, plan.labels))
    if settings.objects.table and len(plan.labels) > 1:
        objects.append(f"the table is joined to {plan.labels[0].name} alone, the first label map")
    # numbers of objects are read as they are
    read = (note for note in dataset.notes if not (alone and note.startswith(CAST)))
    kind = [modality.note] if modality.note else []
    notes = (*read, *choice, *kind, *gaps, *objects, *ignored_notes(settings, channels))
    return replace(plan, notes=notes, is_hounsfield=modality.is_hounsfield)


def _require_labels(settings: Settings) -> None:
    """Raise UsageError where something is said of objects that nobody asked for."""
    options = settings.objects
    for flag, value in {
        "--table": options.table,
        "--table-key": options.table_key,
        "--columns": ",".join(options.columns),
        "--color-by": options.color_by,
        "--background": str(options.background or ""),
    }.items():
        if value and not settings.labels:
            raise UsageError(f"{flag} is {value!r:.60}: of no objects, expected --labels with it")
        if value and not options.table and flag in ("--table-key", "--columns"):
            raise UsageError(f"{flag} is {value!r:.60}: of no table, expected --table with it")


def provenance(plan: Plan) -> dict[str, Any]:
    """Return the provenance that results carry: settings and versions, no paths, no identities."""
    settings = _without_places(to_dict(plan.settings))
    # by the plan's formats, since the sources may be gone when a stage is written; an added
    # channel's source lies in OUT
    formats = {*plan.formats, *(format_of(c.source).name for c in plan.channels if c.source)}
    return {
        "generator": GENERATOR,
        "fingerprint": plan.fingerprint,
        "level": plan.level,
        "spacing_um": list(plan.spacing_um),
        "settings": settings,
        "libraries": {
            **libraries_of(*_STEPS, *sorted(formats)),
            **({UNWRAPPER: version_of(UNWRAPPER)} if plan.settings.unwrap.maps else {}),
        },
        **_added(plan),
    }


def provenance_record(plan: Plan) -> dict[str, Any]:
    """Return the content of provenance.json: the provenance, and the notes on reading the source.

    The notes stay beside the plan, because some name the source's files.
    """
    return {**provenance(plan), "notes": list(plan.notes)}


def _without_places(settings: dict[str, Any]) -> dict[str, Any]:
    """Return settings without the paths in them, which may name a patient or a person."""
    labels = dict.fromkeys(settings["labels"], "")
    objects = {**settings["objects"], "table": "table" if settings["objects"]["table"] else ""}
    return {**settings, "labels": labels, "objects": objects}


def _added(plan: Plan) -> dict[str, Any]:
    """Return the channels with a source of their own, and that source's fingerprint."""
    added = {c.name: c.fingerprint for c in plan.channels if c.source}
    return {"added_channels": added} if added else {}


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
            stage_tile_step(out_folder, plan, index=index, tile=tile, tables=tables)
            for tile in plan.tiles
        ]
        places = {tile.id: out_folder.tile_file(tile.id) for tile in plan.tiles}
        stage = WriteStage(
            plan.name,
            tuple(tiles),
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
        kept = zip(places.items(), tiles, strict=True)
        run_missing(engine, "stage", [Kept(id_, step, place) for (id_, place), step in kept])
        stage.write(out_folder.stage_dir)
        out_folder.remove_other_folders(
            out_folder.stage_dir / "tiles", {tile.id for tile in plan.tiles}
        )
        lists = [tile.listed(places[tile.content.id]) for tile in tiles]
        files = {path: entry for listed, _ in lists for path, entry in listed.items()}
        _tell_size(files, sum(measured for _, measured in lists))
        stage.write_list(out_folder.stage_dir, files)


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
