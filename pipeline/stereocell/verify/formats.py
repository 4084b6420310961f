"""Compare a build's files with the rules of their formats: the body of `stereocell check`.

Each check prints one line, and a failed check doesn't stop the others. Most of the work is done by
standard validators: JSON Schema, UsdValidation, the Khronos glTF validator, ktx-parse. The last two
are node packages; where node or a package is missing, their line fails and names the remedy.
"""

import hashlib
import json
import shutil
import struct
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stereocell.building import unit_files
from stereocell.building.input_unchanged import require_added
from stereocell.building.out_folder import INDEX, SURVEY, OutFolder
from stereocell.building.phase import digest_of_manifest
from stereocell.building.sealed_documents import (
    UNITS_AGAIN,
    checks_of,
    find_document_faults,
    has_report,
    has_units,
)
from stereocell.building.survey_file import COMPONENTS, EVIDENCE, WINDOW
from stereocell.building.tissue_files import FOLDER, RECORD, read_whole
from stereocell.bundle.manifest import FILES, MANIFEST, read_manifest
from stereocell.bundle.manifest import REMEDY as _RUN_BUNDLE
from stereocell.bundle.manifest import SCHEMA as _BUNDLE
from stereocell.bundle.write_objects import hash_parts
from stereocell.formats.exr import check_exr
from stereocell.formats.stl import check_stl
from stereocell.formats.tiles3d import CONTENT_HASH, content_hash
from stereocell.formats.tiles3d_walk import Content, walk
from stereocell.formats.vdb import check_vdb
from stereocell.model.errors import CheckError, OutputError, StereoCellError
from stereocell.storage.assets import find_asset
from stereocell.storage.contents import PUBLISHED, require_kind
from stereocell.storage.file_list import DAMAGED, MISSING, measure
from stereocell.storage.json_files import find_sealed, read_json
from stereocell.storage.kinds import Kind
from stereocell.storage.location import Location, require_own
from stereocell.storage.workspace import is_file, sizes_below
from stereocell.transfer.shapes2d import find_fault, shapes_from
from stereocell.usd import written_files
from stereocell.usd.read_stage import dependencies
from stereocell.usd.validate import validate_stage, validate_usdz
from stereocell.usd.write_tile import closed_file, has_mesh
from stereocell.usd.write_usdz import USDZ_NAME
from stereocell.verify.build_records import (
    check_plan,
    check_records,
    check_report,
)
from stereocell.verify.site_files import find_site_faults

_WHOLE = {".exr": check_exr, ".vdb": check_vdb, ".stl": check_stl}
_MAX_SHOWN = 3  # problems printed in one line
_NODE_TIMEOUT_S = 1200.0  # s for one script over all files
_Check = tuple[str, Callable[[], str]]


@dataclass(frozen=True, slots=True)
class CheckLine:
    """One line of the result. `detail`: the checked parts, or the problem."""

    name: str
    ok: bool
    detail: str


def check(out: Path) -> Iterator[CheckLine]:
    """Yield a line for each check of a build's folder (plan, stage and bundle), or of a bundle by
    itself, as on a web host.

    Raises OutputError, before any line, where there is neither.
    """
    found = require_kind(out, (Kind.BUILD, Kind.BUNDLE, Kind.SITE))
    if found.kind is Kind.BUILD:
        checks = [*_checks_of_build(out), *_checks_of_bundle(out / "bundle", OutFolder(out))]
    elif found.kind is not Kind.NOTHING:
        checks = _checks_of_bundle(out, None)
    else:
        raise OutputError(
            f"{out}: holds no build, expected plan.json, stage/ and bundle/, "
            f"or a bundle's {MANIFEST}"
        )
    for name, run in checks:
        try:
            yield CheckLine(name, True, run())
        except StereoCellError as error:
            yield CheckLine(name, False, str(error))


def _checks_of_build(out: Path) -> list[_Check]:
    out_folder = OutFolder(out)
    has_plan = is_file(out_folder.plan_file)
    return [
        ("plan", lambda: check_plan(out_folder)),
        *([("records", lambda: check_records(out_folder))] if has_plan else []),
        *([("tissue", lambda: _check_tissue(out))] if (out / FOLDER).exists() else []),
        *([("units", lambda: _check_units(out_folder))] if has_units(out_folder) else []),
        ("stage hashes", lambda: _check_stage_hashes(out_folder)),
        ("stage", lambda: _check_stage(out)),
        ("stage files", lambda: _check_stage_files(out)),
        ("usdz", lambda: _check_usdz(out / "stage" / USDZ_NAME)),
        *([("report", lambda: check_report(out_folder))] if has_report(out_folder) else []),
    ]


def _checks_of_bundle(bundle: Path, out_folder: OutFolder | None) -> list[_Check]:
    return [
        ("manifest", lambda: _check_manifest(bundle)),
        ("file list", lambda: _check_json(bundle / FILES, f"{_BUNDLE}#FileIndex", _RUN_BUNDLE)),
        ("volume lists", lambda: _check_volume_lists(bundle)),
        ("2D transfer functions", lambda: _check_transfer2d(bundle)),
        ("object tables", lambda: _check_objects(bundle)),
        ("tilesets", lambda: _check_tilesets(bundle)),
        ("hashes", lambda: _check_hashes(bundle, out_folder)),
        ("bundle usdz", lambda: _check_usdz_of_bundle(bundle)),
        ("glTF validator", lambda: _check_meshes(bundle)),
        ("KTX2 textures", lambda: _run_node("check_ktx2.mjs", _textures(bundle))),
    ]


def _check_manifest(bundle: Path) -> str:
    read_manifest(bundle)
    return f"{MANIFEST} fits {_BUNDLE}, as written"


def _check_json(path: Path, schema: str, remedy: str) -> str:
    read_json(path, schema, remedy)
    return f"{path.name} fits {schema}"


def _check_tissue(out: Path) -> str:
    """Check the files of `stereocell tissue`; the bundle needs none of them."""
    files = read_whole(out / FOLDER)["files"]
    require_added(OutFolder(out).plan())
    return f"{RECORD} and {len(files)} files that it lists"


def _check_units(out_folder: OutFolder) -> str:
    """Check the units' files against the hashes in unit.json, and the survey behind them."""
    told = find_document_faults(out_folder, "units")
    lists = [fault.removesuffix(f": {UNITS_AGAIN}") for fault in told]
    problems, files = _spoilt_survey(out_folder), 0
    index = find_sealed(out_folder.index_file, INDEX) or {}
    for name, key in index.items():
        tile_id, channel_id = name.split("/")
        folder = out_folder.unit_dir(tile_id, channel_id, key)
        files += len(sizes_below(folder))
        problems += [
            f"{(folder / file).relative_to(out_folder.out).as_posix()}: {fault}"
            for file, fault in unit_files.find_damage(folder).items()
        ]
    removal = "remove what is damaged and " if problems else ""
    _raise_on_all([*lists, *problems], f"{removal}{UNITS_AGAIN}")
    return f"{files} files of {len(index)} units"


def _spoilt_survey(out_folder: OutFolder) -> list[str]:
    """Return the faults of the files of windows and levels that the survey names."""
    survey = find_sealed(out_folder.survey_file, SURVEY) or {"channels": {}}
    channels = survey["channels"].values()
    files = {channel["statistics_file"]: WINDOW for channel in channels}
    schemas = {"evidence": EVIDENCE, "components": COMPONENTS}
    for channel in channels:
        for tile in channel["iso"].values():
            files |= {file: schemas[what] for what, file in tile["files"].items()}
    spoilt = [name for name in files if find_sealed(out_folder.out / name, files[name]) is None]
    return [_fault_of(out_folder, out_folder.out / name) for name in spoilt]


def _fault_of(out_folder: OutFolder, file: Path) -> str:
    name = file.relative_to(out_folder.out).as_posix()
    return f"{name}: {DAMAGED if is_file(file) else MISSING}"


def _check_stage_hashes(out_folder: OutFolder) -> str:
    """Check every file that the build wrote against the stage's list; others are an artist's."""
    for require in checks_of(out_folder, "stage"):
        require()
    listed = read_json(out_folder.stage_list, "units.schema.json#FileList", written_files.REMEDY)
    if written_files.STAGE_NAME not in listed:
        path = out_folder.stage_list
        raise CheckError(f"{path}: damaged, not the list that was written: {written_files.REMEDY}")
    problems = written_files.find_damage(out_folder.stage_dir, listed)
    told = [f"stage/{path}: {fault}" for path, fault in problems.items()]
    remedy = f"remove what is damaged and {written_files.REMEDY}"
    if {written_files.CHANGED, written_files.DOUBTFUL} & set(problems.values()):
        remedy += f"; {written_files.ADVICE}"
    _raise_on_all(told, remedy)
    return f"{len(listed)} files"


def _check_stage(out: Path) -> str:
    out_folder = OutFolder(out)
    out_folder.require_finished("stage")
    path = out_folder.stage_file
    dependencies(path, path.parent)  # refuses files outside the stage
    findings = validate_stage(path)
    raise_on([str(finding) for finding in findings])
    return f"{path.name}: nothing found by UsdValidation and by our own rules"


def _check_usdz(path: Path) -> str:
    if not path.parent.is_dir():
        raise CheckError(f"{path.parent}: missing, run `stereocell stage OUT`")
    if not path.is_file():
        return f"no {path.name}: a specimen without surfaces has none"
    dependencies(path, path.parent)
    raise_on([str(finding) for finding in validate_usdz(path)])
    return f"{path.name}: nothing found by the validators of usdz and by our own rules"


def _check_usdz_of_bundle(bundle: Path) -> str:
    """Check specimen.usdz where the manifest names one; its hash is checked with all others."""
    manifest = read_manifest(bundle)
    if manifest.get("usdz") is None:
        return f"no {USDZ_NAME}: {manifest.get('usdz_reason') or 'the manifest names none'}"
    if not (bundle / USDZ_NAME).is_file():
        raise CheckError(f"{USDZ_NAME}: missing, {_RUN_BUNDLE}")
    return _check_usdz(bundle / USDZ_NAME)


def _check_stage_files(out: Path) -> str:
    """Check that volumes, lookup tables and closed copies are whole: USD checks only that the
    first two exist."""
    folder = out / "stage"
    paths = sorted(path for path in folder.rglob("*") if path.suffix in _WHOLE)
    if not paths:
        raise CheckError(f"{folder}: no .exr and no .vdb file, expected those of its volumes")
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
    """Return the problems where the plan requests closed copies, and a surface has none."""
    out_folder = OutFolder(out)
    if not out_folder.plan_file.is_file():  # the line `plan` reports it
        return []
    plan = out_folder.plan()
    if not plan.settings.surface.closed_tiles:
        return []
    return [
        f"{path}: missing, expected as surface.closed_tiles is on: run `stereocell stage OUT`"
        for tile in plan.tiles
        for channel in plan.channels
        for path in [closed_file(out_folder.stage_dir, tile.id, channel.id)]
        if has_mesh(out_folder.stage_dir, tile.id, channel.id) and not path.is_file()
    ]


def _check_volume_lists(bundle: Path) -> str:
    """Check each volumes.json, and its hashes of the levels in the textures."""
    problems = []
    volumes = 0
    for channel in _channels(bundle):
        path = bundle / channel["volumes"]["path"]
        content = read_json(path, "volumes.schema.json", _RUN_BUNDLE)
        for volume in content["volumes"]:
            volumes += 1
            texture = bundle / volume["file"]["path"]
            listed = [(level["offset"], level["length"]) for level in volume["levels"]]
            if _levels_of(texture, len(listed)) != listed:
                problems.append(f"{path}: the levels of {volume['file']['path']} lie elsewhere")
                continue
            problems += _spoilt_levels(texture, volume)
    raise_on(problems)
    return f"{volumes} volumes"


def _levels_of(texture: Path, count: int) -> list[tuple[int, int]]:
    """Return offset and length in bytes of a KTX2 file's levels; empty for another number."""
    try:
        with texture.open("rb") as file:
            head = file.read(80 + 24 * count)
    except OSError as error:
        raise CheckError(f"{texture}: {error.strerror or error}") from error
    if len(head) < 80 + 24 * count or struct.unpack_from("<I", head, 40) != (count,):
        return []
    return [struct.unpack_from("<2Q", head, 80 + 24 * k) for k in range(count)]


def _spoilt_levels(texture: Path, volume: dict[str, Any]) -> list[str]:
    """Return the levels that lie at the right place but don't match their hash."""
    problems = []
    try:
        with texture.open("rb") as file:
            for k, level in enumerate(volume["levels"]):
                file.seek(level["offset"])
                found = hashlib.sha256(file.read(level["length"])).hexdigest()
                if found != level["sha256"]:
                    problems.append(
                        f"{volume['file']['path']}: level {k}: "
                        f"expected SHA-256 {level['sha256']}, found {found}"
                    )
    except OSError as error:
        raise CheckError(f"{texture}: {error.strerror or error}") from error
    return problems


def _channels(bundle: Path) -> list[dict[str, Any]]:
    manifest = read_manifest(bundle)
    channels: list[dict[str, Any]] = manifest["channels"]
    return channels


def _transfer2d(bundle: Path, channel: dict[str, Any]) -> dict[str, Any]:
    path = bundle / channel["transfer_functions_2d"]["file"]["path"]
    content: dict[str, Any] = read_json(path, "transfer2d.schema.json", _RUN_BUNDLE)
    return content


def _check_transfer2d(bundle: Path) -> str:
    """Check each transfer2d.json: its names, and rules of its shapes beyond the schema."""
    problems = []
    count = 0
    for channel in _channels(bundle):
        listed, known = channel["transfer_functions_2d"], channel["transfer_functions"]
        functions = _transfer2d(bundle, channel)["functions"]
        if list(functions) != listed["names"] or not set(functions) <= set(known):
            problems.append(
                f"{listed['file']['path']}: functions are {', '.join(functions) or 'none'}, the "
                f"manifest says {', '.join(listed['names']) or 'none'} of {', '.join(known)}"
            )
        for name, content in functions.items():
            count += len(content)
            problems += [
                f"{listed['file']['path']}: {name}: shape {i}: {fault}"
                for i, shape in enumerate(shapes_from(content))
                if (fault := find_fault(shape))
            ]
    raise_on(problems)
    return f"{count} shapes"


def _objects(bundle: Path, channel: dict[str, Any]) -> dict[str, Any] | None:
    """Return the table of a channel that is a label map; None: it is an image's."""
    if "objects" not in channel:
        return None
    path = bundle / channel["objects"]["path"]
    content: dict[str, Any] = read_json(path, "objects.schema.json", _RUN_BUNDLE)
    return content


def _check_objects(bundle: Path) -> str:
    """Check each objects.json: that its files have a value a row, and its tiles rows there are."""
    problems = []
    objects = 0
    for channel in _channels(bundle):
        content = _objects(bundle, channel)
        if content is None:
            continue
        count, name = content["count"], channel["objects"]["path"]
        objects += count
        sizes = [(content["labels"], content["label_bytes"]), (content["boxes"], 24)]
        sizes += [(column["bytes"], 1) for column in content["columns"]]
        sizes += [(column["exact"], 4) for column in content["columns"]]
        problems += [
            f"{name}: {ref['path']} has {ref['bytes']} bytes, expected {count * width}"
            for ref, width in sizes
            if ref["bytes"] != count * width
        ]
        problems += [
            f"{name}: {column['exact']['path']}: parts have other SHA-256 than stated"
            for column in content["columns"]
            if "parts" in column and not _has_parts(bundle / column["exact"]["path"], column)
        ]
        for tile, rows in content["tiles"].items():
            if max([rows["first"] + rows["count"] - 1, *rows.get("more", [])]) >= max(count, 1):
                problems.append(f"{name}: {tile}: names rows beyond the {count} that there are")
    raise_on(problems)
    return f"{objects} objects"


def _has_parts(file: Path, column: dict[str, Any]) -> bool:
    try:
        return bool(column["parts"] == hash_parts(file.read_bytes()))
    except OSError as error:
        raise CheckError(f"{file}: {error.strerror or error}") from error


def _check_tilesets(bundle: Path) -> str:
    contents = 0
    problems = []
    for channel in _channels(bundle):
        if channel["tileset"] is None:
            continue
        try:
            for content in walk(bundle, bundle / channel["tileset"]["path"]):
                contents += not content.is_tileset
                problems += _spoilt_content(content)
        except StereoCellError as error:
            problems.append(str(error))
    raise_on(problems)
    return f"{contents} contents"


def _spoilt_content(content: Content) -> list[str]:
    """Return the problems of a file that a tileset names, and of the tileset's entry."""
    uri = content.named["uri"]
    name = f"{content.tileset}: {uri}"
    problems = []
    if content.error_m > content.limit_m:
        problems.append(f"{name} has a larger geometricError than its parent")
    try:
        expected = content.named["extras"][CONTENT_HASH]
    except (KeyError, TypeError):
        return [*problems, f"{name} has no hash, expected extras.{CONTENT_HASH}"]
    if not content.path.is_file():
        if not content.is_tileset:  # the walk reports missing tilesets
            problems.append(f"{content.tileset}: no file at {uri}")
        return problems
    found = content_hash(measure(content.path)["sha256"])
    if found != expected:
        problems.append(f"{name}: expected {CONTENT_HASH} {expected}, found {found}")
    return problems


def _check_hashes(bundle: Path, out_folder: OutFolder | None) -> str:
    """Compare every file and every reference with files.json, and report unlisted files.

    out_folder  the OUT of the bundle, which has a hash of the manifest; None: a bundle by itself
    """
    manifest = read_manifest(bundle)
    listed = read_json(bundle / FILES, f"{_BUNDLE}#FileIndex", _RUN_BUNDLE)
    problems = []
    found = {p.relative_to(bundle).as_posix(): p for p in bundle.rglob("*") if p.is_file()}
    for path, entry in listed.items():
        if path not in found:
            problems.append(f"{path}: missing")
        elif measure(found[path]) != entry:
            problems.append(f"{path}: not the bytes that {FILES} says")
    unlisted = found.keys() - listed.keys() - {MANIFEST, FILES}
    if PUBLISHED in found:
        problems += find_site_faults(found)
    else:
        problems += [f"{path}: not in {FILES}" for path in unlisted]
    references = list(_references(manifest))
    for channel in _channels(bundle):
        path = bundle / channel["volumes"]["path"]
        references += _references(read_json(path, "volumes.schema.json", _RUN_BUNDLE))
        references += _references(_transfer2d(bundle, channel))
        references += _references(_objects(bundle, channel))
    for reference in references:
        entry = {"bytes": reference["bytes"], "sha256": reference["sha256"]}
        expected = listed.get(reference["path"])
        if reference["path"] == FILES:
            expected = measure(bundle / FILES)
        if entry != expected:
            problems.append(f"{reference['path']}: a reference to it has another hash")
    if out_folder is not None and not _is_own_manifest(out_folder):
        problems.append(f"{MANIFEST}: not the bytes that were written")
    _raise_on_all(sorted(problems), f"remove what is damaged and {_RUN_BUNDLE}")
    return f"{len(listed)} files, {len(references)} references"


def _is_own_manifest(out_folder: OutFolder) -> bool:
    wrote = out_folder.phases().get("bundle", {"key": ""})
    return not wrote["key"] or bool(wrote["results"].endswith(digest_of_manifest(out_folder)))


def _references(content: Any) -> Iterator[dict[str, Any]]:
    if isinstance(content, list):
        for item in content:
            yield from _references(item)
    elif isinstance(content, dict):
        if content.keys() == {"path", "bytes", "sha256"}:
            yield content
        for item in content.values():
            yield from _references(item)


def _check_meshes(bundle: Path) -> str:
    paths = sorted(bundle.rglob("*.glb"))
    if not paths and all(channel["tileset"] is None for channel in _channels(bundle)):
        return "0 files: no channel has a surface"
    return _run_node("check_glb.mjs", paths)


def _textures(bundle: Path) -> list[Path]:
    return sorted([*bundle.rglob("*.ktx2"), *bundle.rglob("*.glb")])


def _run_node(script_name: str, paths: list[Path]) -> str:
    """Run one script of viewer_gltf/tools over all files at once. Raises CheckError."""
    if not paths:
        raise CheckError("no file to check, expected some in the bundle")
    try:
        script = find_asset(f"viewer_gltf/tools/{script_name}")
    except FileNotFoundError as error:
        raise CheckError(f"{script_name} comes with a checkout of StereoCell only") from error
    node = shutil.which("node")
    if node is None:
        raise CheckError(f"no `node` to run {script_name}: install Node 20.19 or newer")
    try:
        answer = subprocess.run(
            [node, str(script)],
            input=json.dumps([str(path) for path in paths]),
            capture_output=True,
            encoding="utf-8",
            timeout=_NODE_TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise CheckError(f"{script_name} was not done after {_NODE_TIMEOUT_S:g} s") from error
    if "ERR_MODULE_NOT_FOUND" in answer.stderr:
        raise CheckError(f"{script.parent.parent}: its node packages are missing: run `make setup`")
    if answer.returncode != 0:
        raise CheckError(f"{script_name} failed: {' '.join(answer.stderr.split())[-300:]}")
    results = json.loads(answer.stdout)
    raise_on([f"{result['path']}: {p}" for result in results for p in result["problems"]])
    return f"{len(results)} files"


def _raise_on_all(problems: list[str], remedy: str) -> None:
    """Raise CheckError with all of the problems, if there are any."""
    if problems:
        raise CheckError(f"{'; '.join(problems)}: {remedy}")


def raise_on(problems: list[str]) -> None:
    """Raise CheckError with the first few of the problems, if there are any."""
    if problems:
        more = f" (and {len(problems) - _MAX_SHOWN} more)" if len(problems) > _MAX_SHOWN else ""
        raise CheckError("; ".join(problems[:_MAX_SHOWN]) + more)
