"""Check the files of a build's units, tissue classes and stage, and its .usdz."""

from pathlib import Path

from stereocell.building.input_unchanged import require_added
from stereocell.building.out_folder import INDEX, SURVEY, OutFolder
from stereocell.building.sealed_documents import (
    UNITS_AGAIN,
    checks_of,
    find_document_faults,
)
from stereocell.formats.exr import check_exr
from stereocell.formats.stl import check_stl
from stereocell.formats.vdb import check_vdb
from stereocell.model.errors import CheckError, StereoCellError
from stereocell.steps import unit_files
from stereocell.steps.tissue_files import FOLDER, RECORD, read_whole
from stereocell.storage.documents import schema_of
from stereocell.storage.file_list import DAMAGED, MISSING, sizes_of
from stereocell.storage.json_files import find_sealed, read_json
from stereocell.storage.location import Location, require_own
from stereocell.usd import written_files
from stereocell.usd.stage_files import dependencies
from stereocell.usd.validate import validate_stage, validate_usdz
from stereocell.usd.write_tile import closed_file, has_mesh
from stereocell.verify.check_line import raise_on, raise_on_all

_WHOLE = {".exr": check_exr, ".vdb": check_vdb, ".stl": check_stl}


def check_tissue(out: Path) -> str:
    """Check the files of `stereocell tissue`, which the bundle does not use."""
    files = read_whole(out / FOLDER)["files"]
    require_added(OutFolder(out).plan())
    return f"{RECORD} and {len(files)} files that it lists"


def check_units(out_folder: OutFolder) -> str:
    """Check the units' files against the hashes in unit.json, and the survey behind them."""
    faults = find_document_faults(out_folder, "units")
    lists = [fault.removesuffix(f": {UNITS_AGAIN}") for fault in faults]
    problems, files = _damaged_survey(out_folder), 0
    index = find_sealed(out_folder.index_file, INDEX) or {}
    for name, key in index.items():
        folder = out_folder.unit_dir(name, key)
        files += len(sizes_of(folder))
        problems += [
            f"{(folder / file).relative_to(out_folder.out).as_posix()}: {fault}"
            for file, fault in unit_files.find_damage(folder).items()
        ]
    removal = "remove the damaged files and " if problems else ""
    raise_on_all([*lists, *problems], f"{removal}{UNITS_AGAIN}")
    is_planned = not find_document_faults(out_folder, "plan")
    is_open = is_planned and not out_folder.plan().settings.surface.caps
    about = ", whose surfaces are open at the block's faces on purpose (--no-caps)" * is_open
    return f"{files} files of {len(index)} units{about}"


def _damaged_survey(out_folder: OutFolder) -> list[str]:
    """Return the faults of the survey's files, which hold windows and iso-values."""
    survey = find_sealed(out_folder.survey_file, SURVEY) or {"channels": {}}
    channels = survey["channels"].values()
    names = dict.fromkeys(channel["statistics_file"] for channel in channels)
    for channel in channels:
        for tile in channel["iso"].values():
            names |= dict.fromkeys(tile["files"].values())
    files = [out_folder.out / name for name in names]
    return [_fault_of(out_folder, file) for file in files if not _is_whole(file)]


def _is_whole(file: Path) -> bool:
    schema = schema_of(file.name)
    return schema is not None and find_sealed(file, schema) is not None


def _fault_of(out_folder: OutFolder, file: Path) -> str:
    name = file.relative_to(out_folder.out).as_posix()
    return f"{name}: {DAMAGED if out_folder.has(file) else MISSING}"


def check_stage_hashes(out_folder: OutFolder) -> str:
    """Check every file that the build wrote against the stage's list; ignore an artist's files."""
    for require in checks_of(out_folder, "stage"):
        require()
    listed = read_json(out_folder.stage_list, "units.schema.json#FileList", written_files.REMEDY)
    if written_files.STAGE_NAME not in listed:
        raise CheckError(
            f"{out_folder.stage_list}: found no {written_files.STAGE_NAME} in the list, so it is "
            f"damaged: {written_files.REMEDY}"
        )
    problems = written_files.find_damage(out_folder.stage_dir, listed)
    faults = [f"stage/{path}: {fault}" for path, fault in problems.items()]
    remedy = f"remove the damaged files and {written_files.REMEDY}"
    if {written_files.CHANGED, written_files.DOUBTFUL} & set(problems.values()):
        remedy += f"; {written_files.ADVICE}"
    raise_on_all(faults, remedy)
    return f"{len(listed)} files"


def check_stage(out: Path) -> str:
    """Check the composed stage by USD's validators and by StereoCell's own rules."""
    out_folder = OutFolder(out)
    out_folder.require_finished("stage")
    path = out_folder.stage_file
    dependencies(path, path.parent)  # this raises if the stage uses files outside its folder
    findings = validate_stage(path)
    raise_on([str(finding) for finding in findings])
    return f"{path.name}: no fault found by UsdValidation and by StereoCell's own rules"


def check_usdz(path: Path) -> str:
    """Check a .usdz by the validators of its format. A specimen without surfaces has no .usdz."""
    if not path.parent.is_dir():
        raise CheckError(f"{path.parent}: missing: run `stereocell stage OUT`")
    if not path.is_file():
        return f"no {path.name}: a specimen without surfaces has none"
    dependencies(path, path.parent)
    raise_on([str(finding) for finding in validate_usdz(path)])
    return f"{path.name}: no fault found by the validators of usdz and by StereoCell's own rules"


def check_stage_files(out: Path) -> str:
    """Check that volumes, lookup tables and closed copies are whole.

    USD checks only that volumes and lookup tables exist.
    """
    folder = out / "stage"
    paths = sorted(path for path in folder.rglob("*") if path.suffix in _WHOLE)
    if not paths:
        raise CheckError(
            f"{folder}: found no .exr and no .vdb file, expected the files of its volumes: "
            f"{written_files.REMEDY}"
        )
    problems = _lost_copies(out)
    for path in paths:
        try:
            require_own(path, [Location.of(folder).folder], named=str(path), raised=CheckError)
            _WHOLE[path.suffix](path)
        except StereoCellError as error:
            problems.append(str(error))
    raise_on(problems)
    copies = sum(path.suffix == ".stl" for path in paths)
    closed = f" and {copies} closed .stl" if copies else ""
    return f"{len(paths) - copies} volumes and lookup tables{closed} are whole"


def _lost_copies(out: Path) -> list[str]:
    """Return a problem for each surface without the closed copy that the plan requests."""
    out_folder = OutFolder(out)
    if not out_folder.plan_file.is_file():  # the check `plan` reports the missing file
        return []
    plan = out_folder.plan()
    if not plan.settings.surface.closed_tiles:
        return []
    return [
        f"{path}: missing, expected because surface.closed_tiles is on: run `stereocell stage OUT`"
        for tile in plan.tiles
        for channel in plan.channels
        for path in [closed_file(out_folder.stage_dir, tile.id, channel.id)]
        if has_mesh(out_folder.stage_dir, tile.id, channel.id) and not path.is_file()
    ]
