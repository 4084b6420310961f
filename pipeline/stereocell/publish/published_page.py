"""Compare a target with the files that an earlier run published there, and protect other files.

Publishing leaves a list at the target, with the specimen and a hash of each file. It reveals a page
of another specimen, files that somebody has changed since, and files of somebody else. The run then
names such a file and stops. Only --force replaces it.
"""

import json
from collections.abc import Iterable, Mapping
from pathlib import PurePosixPath
from typing import Any

from stereocell.bundle.manifest import MANIFEST
from stereocell.model.errors import OutputError
from stereocell.publish.targets import Target, digest
from stereocell.storage.contents import PUBLISHED, words_for
from stereocell.storage.file_list import to_json
from stereocell.storage.overwriting import is_forced, or_force, refused

# path -> entry with size (`bytes`) and hash (`sha256`); the entry is None if a run was stopped that
# may or may not have uploaded the file
Entries = Mapping[str, Any]
_OF_HOSTS = ("CNAME", "README.md", "LICENSE", "robots.txt", "404.html")
CHANGED = "changed since it was published"


def list_of(entries: Entries, specimen: Mapping[str, str]) -> bytes:
    """Return the content of the list that is left at the target."""
    content = {
        "format": "stereocell-published",
        "version": 1,
        "specimen": specimen,
        "files": dict(sorted(entries.items())),
    }
    return to_json(content)


def read_published(target: Target, there: Mapping[str, int]) -> dict[str, Any]:
    """Return the entries of the files that an earlier run has uploaded.

    Raises OutputError if the list is damaged.
    """
    if PUBLISHED not in there:
        return {}
    where = f"{target.shown}/{PUBLISHED}"
    try:
        found = json.loads(target.read(PUBLISHED))
        files = dict(found["files"])
        is_known = found["format"] == "stereocell-published" and found["version"] == 1
    except (ValueError, TypeError, KeyError, RecursionError):
        is_known, files = False, {}
    # Listed files may be removed, so no path in the list may lead out of the target.
    if not is_known or not all(_is_inside(path) for path in files):
        raise OutputError(f"{where}: damaged, expected a list of published files; remove it")
    return files


def _is_inside(path: str) -> bool:
    parts = PurePosixPath(path).parts
    return (
        bool(parts)
        and not path.startswith("/")
        and not {"..", ".git"} & {*parts}
        and "\\" not in path
    )


def require_own(
    target: Target,
    entries: Entries,
    there: Mapping[str, int],
    before: Entries,
    specimen: Mapping[str, str],
) -> None:
    """Raise OutputError if the target holds another page, or files that no run has uploaded.

    Files for the host, such as CNAME, may lie in a new target.

    entries   the files of the bundle
    there     path -> size in bytes, of each file at the target
    before    the entries of the files that an earlier run has uploaded
    specimen  name and fingerprint of the bundle's specimen
    """
    if is_forced():
        return
    for path, entry in entries.items():
        if path in there and path not in before and not _is_same(target, path, entry, there):
            raise OutputError(
                f"{target.shown}/{path}: this file exists and was not uploaded by this command, "
                f"expected a place without other files: {or_force('choose another place')}"
            )
    others = [path for path in there if path not in entries and not _is_of_host(path)]
    if not before and others:
        raise refused(target.shown, words_for(others), "nothing or a published page")
    earlier = _published_specimen(target, there)
    if before and not _is_one(earlier, specimen):
        raise refused(
            target.shown, f"a published page of {_words(earlier)}", f"one of {_words(specimen)}"
        )


def find_changed(
    target: Target, paths: Iterable[str], there: Mapping[str, int], before: Entries
) -> list[str]:
    """Return the paths whose files at the target differ from those that an earlier run uploaded."""
    return [
        path
        for path in paths
        if path in there
        and before.get(path) is not None
        and not _is_same(target, path, before[path], there)
    ]


def require_unchanged(
    target: Target, paths: Iterable[str], there: Mapping[str, int], before: Entries
) -> None:
    """Raise OutputError if a file that a run would replace or remove was changed at the target.

    Only these files are read, since reading a whole page from object storage takes as long as
    uploading it.
    """
    changed = [] if is_forced() else find_changed(target, paths, there, before)
    if changed:
        more = f" ({len(changed)} such files)" if len(changed) > 1 else ""
        raise OutputError(f"{target.shown}/{min(changed)}: {CHANGED}{more}: {keep_copy()}")


def keep_copy() -> str:
    """Return the remedy for a file of the page that was edited at the target."""
    return or_force("keep a copy of the edited file elsewhere and remove it there")


def _is_same(target: Target, path: str, entry: Mapping[str, Any], there: Mapping[str, int]) -> bool:
    has_size = there[path] == entry["bytes"]
    return has_size and digest(target.read(path)) == entry["sha256"]


def _is_of_host(path: str) -> bool:
    """Return whether a file in a target configures the host or describes the repository."""
    return path in _OF_HOSTS or path.startswith(".")


def _is_one(earlier: Mapping[str, str], specimen: Mapping[str, str]) -> bool:
    """Return whether two specimens are surely the same: equal names and source fingerprints."""
    known = earlier.get("fingerprint", "")
    return bool(
        known and known == specimen["fingerprint"] and earlier.get("name") == specimen["name"]
    )


def _words(specimen: Mapping[str, str]) -> str:
    source = specimen.get("fingerprint", "")[:12] or "its source is not known"
    return f"{specimen.get('name', '')!r:.80} ({source})"


def _published_specimen(target: Target, there: Mapping[str, int]) -> dict[str, str]:
    """Return the specimen of the page at a target, from its list or else from its manifest."""
    for path in (PUBLISHED, MANIFEST):
        if path not in there:
            continue
        try:
            found = json.loads(target.read(path))["specimen"]
            return {key: str(found[key]) for key in ("name", "fingerprint") if key in found}
        except (ValueError, TypeError, KeyError, RecursionError):
            continue
    return {}
