"""Check a build's files against the rules of their formats, for `stereocell check`.

Each check prints one line, and a failed check doesn't stop the others. Standard validators do most
of the work: JSON Schema, UsdValidation, the Khronos glTF validator and ktx-parse. The checks are
imported once the kind of the folder is known, because USD is slow to import.
"""

from collections.abc import Callable, Iterator
from pathlib import Path

from stereocell.building.out_folder import OutFolder
from stereocell.building.sealed_documents import has_report, has_units
from stereocell.bundle.manifest import FILES, MANIFEST, REMEDY, SCHEMA
from stereocell.model.errors import OutputError, StereoCellError
from stereocell.steps.tissue_files import FOLDER
from stereocell.storage.contents import require_kind
from stereocell.storage.kinds import Kind
from stereocell.usd.written_files import USDZ_NAME
from stereocell.verify.build_records import check_plan, check_records, check_report
from stereocell.verify.check_line import CheckLine

_Check = tuple[str, Callable[[], str]]


def check(out: Path) -> Iterator[CheckLine]:
    """Yield a line for each check of a build, of a bundle alone, or of a scene in one file.

    Raises OutputError, before any line, if the folder holds none of these.
    """
    found = require_kind(out, (Kind.BUILD, Kind.BUNDLE, Kind.SITE, Kind.SCENE))
    if found.kind is Kind.SCENE:
        from stereocell.verify.scene_file import check_scene

        yield from check_scene(out, lambda bundle: _checks_of_bundle(bundle, None))
        return
    if found.kind is Kind.BUILD:
        checks = [*_checks_of_build(out), *_checks_of_bundle(out / "bundle", OutFolder(out))]
    elif found.kind is not Kind.NOTHING:
        checks = _checks_of_bundle(out, None)
    else:
        raise OutputError(
            f"{out}: found no build, expected plan.json, stage/ and bundle/, "
            f"or a bundle's {MANIFEST}: run `stereocell build INPUT -o OUT` first"
        )
    for name, run in checks:
        try:
            yield CheckLine(name, True, run())
        except StereoCellError as error:
            yield CheckLine(name, False, str(error))


def _checks_of_build(out: Path) -> list[_Check]:
    from stereocell.verify.build_files import (
        check_stage,
        check_stage_files,
        check_stage_hashes,
        check_tissue,
        check_units,
        check_usdz,
    )

    out_folder = OutFolder(out)
    has_plan = out_folder.has(out_folder.plan_file)
    return [
        ("plan", lambda: check_plan(out_folder)),
        *([("records", lambda: check_records(out_folder))] if has_plan else []),
        *([("tissue", lambda: check_tissue(out))] if (out / FOLDER).exists() else []),
        *([("units", lambda: check_units(out_folder))] if has_units(out_folder) else []),
        ("stage hashes", lambda: check_stage_hashes(out_folder)),
        ("stage", lambda: check_stage(out)),
        ("stage files", lambda: check_stage_files(out)),
        ("usdz", lambda: check_usdz(out / "stage" / USDZ_NAME)),
        *([("report", lambda: check_report(out_folder))] if has_report(out_folder) else []),
    ]


def _checks_of_bundle(bundle: Path, out_folder: OutFolder | None) -> list[_Check]:
    from stereocell.verify.bundle_documents import (
        check_json,
        check_manifest,
        check_objects,
        check_transfer2d,
        check_usdz_of_bundle,
        check_volume_lists,
    )
    from stereocell.verify.bundle_hashes import check_hashes, check_tilesets
    from stereocell.verify.node_validators import check_meshes, check_textures

    return [
        ("manifest", lambda: check_manifest(bundle)),
        ("file list", lambda: check_json(bundle / FILES, f"{SCHEMA}#FileIndex", REMEDY)),
        ("volume lists", lambda: check_volume_lists(bundle)),
        ("2D transfer functions", lambda: check_transfer2d(bundle)),
        ("object tables", lambda: check_objects(bundle)),
        ("tilesets", lambda: check_tilesets(bundle)),
        ("hashes", lambda: check_hashes(bundle, out_folder)),
        ("bundle usdz", lambda: check_usdz_of_bundle(bundle)),
        ("glTF validator", lambda: check_meshes(bundle)),
        ("KTX2 textures", lambda: check_textures(bundle)),
    ]
