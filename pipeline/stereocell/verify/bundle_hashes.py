"""Check the tilesets of a bundle, and compare all its files and references with their hashes."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from stereocell.building.out_folder import OutFolder
from stereocell.building.phase import digest_of_manifest
from stereocell.bundle.manifest import FILES, MANIFEST, REMEDY, SCHEMA, read_manifest
from stereocell.formats.tiles3d import CONTENT_HASH, content_hash
from stereocell.formats.tiles3d_walk import Content, walk
from stereocell.model.errors import StereoCellError
from stereocell.storage.contents import PUBLISHED
from stereocell.storage.file_list import measure
from stereocell.storage.json_files import read_json
from stereocell.verify.bundle_documents import (
    channels_of,
    objects_of,
    transfer2d_of,
)
from stereocell.verify.check_line import raise_on, raise_on_all
from stereocell.verify.site_files import find_site_faults


def check_tilesets(bundle: Path) -> str:
    """Check that each file that a channel's tileset names exists and has the hash stated there."""
    contents = 0
    problems = []
    for channel in channels_of(bundle):
        if channel["tileset"] is None:
            continue
        try:
            for content in walk(bundle, bundle / channel["tileset"]["path"]):
                contents += not content.is_tileset
                problems += _content_problems(content)
        except StereoCellError as error:
            problems.append(str(error))
    raise_on(problems)
    return f"{contents} contents"


def _content_problems(content: Content) -> list[str]:
    """Return the problems of a file that a tileset names, and of the tileset's entry."""
    uri = content.named["uri"]
    name = f"{content.tileset}: {uri}"
    problems = []
    if content.error_m > content.limit_m:
        problems.append(
            f"{name}: geometricError is {content.error_m:g}, expected at most {content.limit_m:g} "
            "as in its parent"
        )
    try:
        expected = content.named["extras"][CONTENT_HASH]
    except (KeyError, TypeError):
        return [*problems, f"{name}: found no hash, expected extras.{CONTENT_HASH}"]
    if not content.path.is_file():
        if not content.is_tileset:  # `walk` has reported a missing tileset
            problems.append(f"{content.tileset}: found no file at {uri}, expected one")
        return problems
    found = content_hash(measure(content.path)["sha256"])
    if found != expected:
        problems.append(f"{name}: found {CONTENT_HASH} {found}, expected {expected}")
    return problems


def check_hashes(bundle: Path, out_folder: OutFolder | None) -> str:
    """Compare every file and every reference with files.json, and report unlisted files.

    out_folder  OUT of the bundle, which records a hash of the manifest; None if there is no OUT
    """
    manifest = read_manifest(bundle)
    listed = read_json(bundle / FILES, f"{SCHEMA}#FileIndex", REMEDY)
    problems = []
    found = {p.relative_to(bundle).as_posix(): p for p in bundle.rglob("*") if p.is_file()}
    for path, entry in listed.items():
        if path not in found:
            problems.append(f"{path}: missing")
        elif measure(found[path]) != entry:
            problems.append(f"{path}: its size or hash differs from {FILES}")
    unlisted = found.keys() - listed.keys() - {MANIFEST, FILES}
    if PUBLISHED in found:
        problems += find_site_faults(found)
    else:
        problems += [f"{path}: found a file that {FILES} does not list" for path in unlisted]
    references = list(_references(manifest))
    for channel in channels_of(bundle):
        path = bundle / channel["volumes"]["path"]
        references += _references(read_json(path, "volumes.schema.json", REMEDY))
        references += _references(transfer2d_of(bundle, channel))
        references += _references(objects_of(bundle, channel))
    for reference in references:
        entry = {"bytes": reference["bytes"], "sha256": reference["sha256"]}
        expected = listed.get(reference["path"])
        if reference["path"] == FILES:
            expected = measure(bundle / FILES)
        if entry != expected:
            problems.append(f"{reference['path']}: a reference to it has another hash than {FILES}")
    if out_folder is not None and not _is_own_manifest(out_folder):
        problems.append(f"{MANIFEST}: its hash differs from the one that was written")
    raise_on_all(sorted(problems), f"remove the damaged files and {REMEDY}")
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
