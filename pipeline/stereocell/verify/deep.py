"""`stereocell check OUT --deep`: compare stage with source and bundle with stage, as a table."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path

from stereocell.building.input_unchanged import require_added, require_input, require_labels
from stereocell.building.out_folder import OutFolder
from stereocell.building.surface_cover import SurfaceCover, lifted_by_tile, sum_lifted
from stereocell.building.survey_file import read_survey
from stereocell.bundle.manifest import MANIFEST
from stereocell.engine.run import Engine
from stereocell.engine.run_steps import with_inputs
from stereocell.isosurface.lifted_by_noise import Lifted
from stereocell.model.counted import counted
from stereocell.model.errors import OutputError, StageError, StereoCellError
from stereocell.model.unit import Cover
from stereocell.planning.channels import Channel
from stereocell.planning.plan import Plan
from stereocell.planning.unit_steps import unit_steps
from stereocell.steps.write_bundle import opened_stage
from stereocell.usd.read_appearances import read_appearances
from stereocell.usd.read_attributes import shortest
from stereocell.usd.read_stage import open_stage, tile_prims
from stereocell.usd.stage_files import dependencies
from stereocell.verify.bundle_against_stage import bundle_tasks, compare_part
from stereocell.verify.bundle_manifest import compare_histograms, compare_manifest
from stereocell.verify.check_line import CheckLine, raise_on
from stereocell.verify.objects_against_source import compare_objects
from stereocell.verify.stage_against_source import SourceTask, UnitFinding, compare_unit


def check_deep(out: Path, engine: Engine, stage: Path | None = None) -> Iterator[CheckLine]:
    """Yield a line for each comparison of stage with source and of bundle with stage.

    stage  the layer that the bundle was exported from; None for OUT's own stage

    A missing source gives one failed line. The bundle is then still compared with the stage. Raises
    OutputError if OUT is a bundle without its build, or has no plan.
    """
    out_folder = OutFolder(out)
    if not out_folder.plan_file.exists() and (out / MANIFEST).is_file():
        raise OutputError(
            f"{out}: found a bundle without its build, expected OUT with its plan.json, because "
            "--deep compares a bundle with its stage: name the OUT of the build"
        )
    if out.is_file():
        raise OutputError(
            f"{out}: found a scene in one file, expected OUT with its plan.json, because --deep "
            "compares a bundle with its stage: name the OUT of the build"
        )
    plan = out_folder.plan()
    exported, bundle = stage or out_folder.stage_file, out_folder.bundle_dir
    try:
        for path in (out_folder.stage_file, exported):
            dependencies(path, out_folder.stage_dir)
    except StageError as error:
        yield CheckLine("files of the stage", False, _one_line(error))
        return
    yield _line("tiles of the stage", lambda: _compare_tiles(out_folder, plan))
    try:
        out_folder.require_units_of(plan)
        require_input(plan)
        require_added(plan)
        require_labels(plan)
        odd = list(_odd_values(out_folder, plan))
        findings = engine.run(
            "source",
            partial(with_inputs, compare_unit),
            list(_source_tasks(out_folder, plan)),
            needs=(compare_unit.__module__,),
        )
    except StereoCellError as error:
        yield CheckLine("stage against source", False, _one_line(error))
    else:
        for channel in plan.channels if findings else ():
            lifted = lifted_by_tile(out_folder, plan, read_survey(out_folder)[channel.id])
            yield from _channel_lines(channel, findings, odd, lifted)
        for labels in plan.labels:
            yield _line(
                f"{labels.name} against source",
                partial(compare_objects, out_folder, plan, labels, engine),
            )
    yield from _edit_lines(exported, out_folder.stage_file)
    of_layer = "" if stage else out_folder.phases().get("bundle", {}).get("about", "")
    remedy = of_layer and f"; the bundle is {of_layer}: check it with --stage LAYER"
    yield _line("manifest against stage", lambda: _compare_manifest(exported, bundle), remedy)
    yield _line("bundle against stage", lambda: _compare_bundle(exported, bundle, engine), remedy)


def _edit_lines(stage: Path, built: Path) -> Iterator[CheckLine]:
    """Yield a line on each edit that bundles can't contain. Such a line is not a failure."""
    with suppress(StereoCellError), opened_stage(stage) as composed:  # other lines show the error
        for note in list(composed.notes(built)):
            yield CheckLine("edits of the stage", True, note)


def _line(name: str, run: Callable[[], str], remedy: str = "") -> CheckLine:
    try:
        return CheckLine(name, True, run())
    except StereoCellError as error:
        return CheckLine(name, False, _one_line(error) + remedy)


def _one_line(error: StereoCellError) -> str:
    return "; ".join(str(error).splitlines())


def _tiles_in(path: Path) -> list[str]:
    stage = open_stage(path)  # this reference keeps the stage alive, which its prims need
    return [str(prim.GetName()) for prim in tile_prims(stage)]


def _compare_tiles(out_folder: OutFolder, plan: Plan) -> str:
    there = set(_tiles_in(out_folder.stage_file))
    planned = {tile.id for tile in plan.tiles}
    raise_on(
        [f"{name} is missing" for name in sorted(planned - there)]
        + [f"{name} is not in the plan" for name in sorted(there - planned)]
    )
    return f"{counted(len(there), 'tile')}, as planned"


def _odd_values(out_folder: OutFolder, plan: Plan) -> Iterator[str]:
    """Yield the channels of the stage whose values differ from those found in the source.

    The window is not compared, since an artist may set it. The volumes' window is compared.
    """
    stage = open_stage(out_folder.stage_file)
    survey = read_survey(out_folder)
    appearances = {appearance.id: appearance for appearance in read_appearances(stage)}
    for channel in plan.channels:
        built, appearance = survey[channel.id].appearance, appearances.get(channel.id)
        if appearance is None:
            yield f"{channel.id}: missing in the stage"
            continue
        for name, found, wanted in (
            ("isoValue", (appearance.iso_value,), (built.iso_value,)),
            ("threshold", (appearance.threshold,), (built.threshold,)),
            ("volumeWindow", appearance.volume_window, built.window),
        ):
            if found != tuple(None if value is None else shortest(value) for value in wanted):
                stated, expected = (", ".join(map(str, one)) for one in (found, wanted))
                yield f"{channel.id}: {name} is {stated}, expected {expected} as in the build"


def _source_tasks(out_folder: OutFolder, plan: Plan) -> Iterator[tuple[str, SourceTask]]:
    there = set(_tiles_in(out_folder.stage_file))
    index = out_folder.index()
    for name, unit in unit_steps(plan, read_survey(out_folder)).items():
        tile_id, channel_id = name.split("/")
        if tile_id not in there:
            continue  # the comparison of tiles reports a missing tile
        tile = plan.tile(tile_id)
        yield (
            name,
            SourceTask(
                unit,
                # The folder may be that of a unit that an earlier version has built.
                out_folder.unit_dir(name, index[name]),
                out_folder.stage_file,
                tile_id,
                channel_id,
                plan.position_um(tile.lattice(plan.region).start),
                tile.box.shape,
                plan.spacing_um,
                plan.placement,
                plan.settings.lod.samples,
                channel_id in plan.shared_volumes,
                not plan.settings.volume.without_vdb,
            ),
        )


def _channel_lines(
    channel: Channel,
    findings: Sequence[UnitFinding],
    odd: Sequence[str],
    lifted: Mapping[str, Lifted],
) -> Iterator[CheckLine]:
    """Yield a row for each level of a channel's surface, and one for its volumes and problems.

    lifted  estimated number of voxels that noise lifts above the iso-value, by tile ID
    """
    units = [unit for unit in findings if unit.name.split("/")[1] == channel.id]
    for level in range(max(len(unit.levels) for unit in units)):
        rows = [unit.levels[level] for unit in units if level < len(unit.levels)]
        stated, found, largest = (max(row[k] for row in rows) for k in range(3))
        yield CheckLine(
            f"{channel.name} lod{level} against source",
            not any(line.startswith(f"lod{level}: ") for unit in units for line in unit.problems),
            f"{len(rows)} surfaces within {found:.4g} um (the stage states {stated:.4g}); largest "
            f"distance {largest:.4g} um",
        )
    problems = [problem for problem in odd if problem.startswith(f"{channel.id}: ")]
    problems += [f"{unit.name}: {problem}" for unit in units for problem in unit.problems]

    def sum_up() -> str:
        raise_on(problems)
        total = sum((unit.cover for unit in units if unit.cover is not None), Cover(0, 0, 0))
        tiles = {unit.name.split("/")[0] for unit in units}
        noise = sum_lifted(lifted[tile] for tile in tiles & set(lifted))
        shares = f"; {SurfaceCover.of(total, noise).words}" if total.source else ""
        return (
            f"{len(units)} units: surfaces within the stated distances, "
            f"volumes equal to the source{shares}"
        )

    yield _line(f"{channel.name} against source", sum_up)


def _compare_manifest(stage: Path, bundle: Path) -> str:
    raise_on(compare_manifest(stage, bundle))
    return "names, colours, windows, transfer functions, tiles"


def _compare_bundle(stage: Path, bundle: Path, engine: Engine) -> str:
    tasks = [
        (task.tile_id if task.channel_id is None else f"{task.tile_id}/{task.channel_id}", task)
        for task in bundle_tasks(stage, bundle, _tiles_in(stage))
    ]
    parts = engine.run("bundle", compare_part, tasks)
    raise_on([problem for part in parts for problem in part.problems])
    raise_on(list(compare_histograms(bundle, [part.joints for part in parts])))
    surfaces, volumes = (
        sum(part.surfaces for part in parts),
        sum(bool(part.joints) for part in parts),
    )
    edits = "; ".join(part.edit for part in parts if part.edit)
    worst = max((part.worst for part in parts), default=0.0)
    return (
        f"{surfaces} surfaces within {worst:.2f} lattice steps, their colours and maps; "
        f"{volumes} volumes, all voxels of all resolution levels, their bricks and histograms"
        + (f"; {edits}" if edits else "")
    )
