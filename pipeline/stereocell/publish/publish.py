"""Publish a bundle at a target; upload only the files that have changed since the last time.

A list of the published files is left at the target. It tells the next run which files it may
replace and remove. Files of somebody else are left alone. If a file of the bundle would take the
place of one, the run is refused. Files that refer to others are uploaded last, so that a person who
opens the page meanwhile sees either the old page or the new one.
"""

import gzip
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from stereocell.building.made_of import require_current
from stereocell.building.out_folder import OutFolder
from stereocell.building.sealed_documents import require_documents
from stereocell.bundle.manifest import FILES, MANIFEST, read_manifest
from stereocell.model.errors import OutputError, UsageError
from stereocell.publish.over_http import INDEX, fetch_faults, find_page
from stereocell.publish.published_page import (
    CHANGED,
    Entries,
    find_changed,
    keep_copy,
    list_of,
    read_published,
    require_own,
    require_unchanged,
)
from stereocell.publish.targets import Target, digest, target_of
from stereocell.storage.contents import PUBLISHED, Contents, contents_of
from stereocell.storage.file_list import DAMAGED, FileList, find_faults, read_list
from stereocell.storage.kinds import Kind
from stereocell.storage.overwriting import is_forced

_LAST = ("sw.js", FILES, MANIFEST, INDEX)
_REMEDY = "run `stereocell bundle OUT` first"
_SMALL_BYTES = 1000  # bytes; smaller JSON files are not compressed


@dataclass(frozen=True, slots=True)
class Published:
    """The result of publishing a bundle once.

    address                   the page's address for browsers; None if it is not known
    files, bytes              all files of the bundle, and their size
    uploaded, uploaded_bytes  files that were uploaded, and their size
    removed                   number of old files that were removed
    """

    address: str | None
    files: int
    bytes: int
    uploaded: int
    uploaded_bytes: int
    removed: int


@dataclass(frozen=True, slots=True)
class _File:
    """A file of the bundle, or a compressed copy of one.

    entry  size (`bytes`) and hash (`sha256`) of the content
    """

    entry: Mapping[str, Any]
    read: Callable[[], bytes]


@dataclass(frozen=True, slots=True)
class _Work:
    """The changes that a run makes at a target.

    there    path -> size in bytes, of each file at the target
    before   the entries of the files that an earlier run has uploaded
    changed  paths to upload
    gone     published paths that the bundle no longer has
    """

    there: Mapping[str, int]
    before: Entries
    changed: Sequence[str]
    gone: Sequence[str]


def publish(
    out: Path, text: str, url: str | None, *, is_public: bool, report: Callable[[str], None]
) -> Published:
    """Publish OUT's bundle at a target, and compare every file there with its hash.

    text       the target: a folder, or an address that fsspec opens
    url        address at which browsers find the target; None for S3's own address, or to read the
               files back from the target instead
    is_public  ask S3 to let everybody read each object (ACL public-read)
    report     called with lines of progress

    Raises UsageError for an invalid `url`. Raises OutputError if the bundle is damaged or not made
    from the plan, units and stage beside it, or if the target can't be written, holds somebody
    else's files in the bundle's place, or sends other bytes.
    """
    if url is not None and not url.startswith(("https://", "http://")):
        raise UsageError(f"--url is {url}, expected an address such as https://me.example/mine")
    held = contents_of(out)
    bundle = out if held.kind in (Kind.BUNDLE, Kind.SITE) else out / "bundle"
    build = held.build if bundle == out else out
    if build is not None:
        require_documents(OutFolder(build), "publish")
        require_current(OutFolder(build))
    listed = read_list(bundle / FILES, _REMEDY)
    files = _files_of(bundle, listed)
    specimen = _specimen_of(bundle, held)
    target = target_of(text, is_public=is_public)
    if isinstance(folder := getattr(target, "folder", None), Path):
        _require_apart(folder, out)
    entries = {path: file.entry for path, file in files.items()}
    work = _compare(target, entries, specimen)
    _require_whole(bundle, listed)  # this comes late, since it hashes the whole bundle
    _put(target, files, work, specimen, report)
    address = (url and url.rstrip("/") + "/") or target.address
    faults = (
        fetch_faults(address, entries, report)
        if address
        else {
            path: "found different bytes"
            for path in files
            if digest(target.read(path)) != entries[path]["sha256"]
        }
    )
    if faults:
        other = {p for p in faults if digest(target.read(p)) != entries[p]["sha256"]}
        _mark_damaged(target, other & {*work.changed}, entries, specimen)
        raise _error_of(address or f"{target.shown}/", faults, entries, other, work)
    size = sum(entry["bytes"] for entry in entries.values())
    sent = sum(entries[path]["bytes"] for path in work.changed)
    page = address and find_page(address, entries)
    return Published(page, len(files), size, len(work.changed), sent, len(work.gone))


def _compare(target: Target, entries: Entries, specimen: Mapping[str, str]) -> _Work:
    """Compare a target with the bundle, and return the changes that are needed there.

    Raises OutputError if the target holds somebody else's files, or files that somebody edited.
    """
    there = target.sizes()
    before = read_published(target, there)
    require_own(target, entries, there, before, specimen)
    edited = find_changed(target, entries, there, before) if is_forced() else []
    changed = [
        path
        for path, entry in entries.items()
        if before.get(path) != entry or there.get(path) != entry["bytes"] or path in edited
    ]
    gone = [path for path in before if path not in entries]
    require_unchanged(target, [*changed, *gone], there, before)
    return _Work(there, before, changed, gone)


def _put(
    target: Target,
    files: Mapping[str, _File],
    work: _Work,
    specimen: Mapping[str, str],
    report: Callable[[str], None],
) -> None:
    """Upload the changed files, and remove published files that the bundle no longer has."""
    entries = {path: file.entry for path, file in files.items()}
    if not (work.changed or work.gone or work.before != entries):
        return
    # The list names the files before they are uploaded. If this run is killed, the next one
    # recognises them as published.
    unsure = dict.fromkeys((*work.gone, *work.changed))
    target.write(PUBLISHED, list_of({**work.before, **entries, **unsure}, specimen))
    _upload(target, files, work.changed, report)
    for path in work.gone:
        if path in work.there:
            target.remove(path)
    target.write(PUBLISHED, list_of(entries, specimen))


def _mark_damaged(
    target: Target, damaged: Iterable[str], entries: Entries, specimen: Mapping[str, str]
) -> None:
    """Note in the target's list the files that the next run must upload again."""
    if unsure := dict.fromkeys(damaged):
        target.write(PUBLISHED, list_of({**entries, **unsure}, specimen))


def _error_of(
    where: str, faults: Mapping[str, str], entries: Entries, other: Collection[str], work: _Work
) -> OutputError:
    """Return the error for files that the host does not send correctly.

    other  files that differ at the target itself. If this run uploaded such a file, it was damaged
           on the way, and the next run uploads it again. Otherwise somebody edited it.
    """
    path, fault = next(iter(sorted(faults.items())))
    remedy = f": {CHANGED}: {keep_copy()}" if path in other else ""
    if path in other and path in work.changed:
        remedy = ": run the same command to upload it again"
    more = f" ({len(faults)} such files)" if len(faults) > 1 else ""
    size = entries[path]["bytes"]
    return OutputError(
        f"{where}{path}: {fault}, expected the bundle's file of {size} bytes{more}{remedy}"
    )


def _require_whole(bundle: Path, listed: FileList) -> None:
    """Raise OutputError unless each file of the bundle has the size and hash in the list."""
    _raise_on(bundle, find_faults(bundle, listed))


def _raise_on(bundle: Path, faults: Mapping[str, str]) -> None:
    """Raise OutputError with the first fault, if there is one."""
    if faults:
        path, fault = next(iter(faults.items()))
        raise OutputError(f"{bundle / path}: {fault}: {_REMEDY}")


def _files_of(bundle: Path, listed: FileList) -> dict[str, _File]:
    """Return the bundle's files by path, and gzip copies of JSON for hosts that send such copies.

    Raises OutputError if a JSON file is damaged.
    """
    documents = {path: one for path, one in listed.items() if path.endswith(".json")}
    _raise_on(bundle, find_faults(bundle, documents))
    files = {path: _File(entry, partial(_content, bundle / path)) for path, entry in listed.items()}
    # The list names all files except itself and the manifest. The manifest names the list.
    index = _made(_content(bundle / FILES))
    manifest = read_manifest(bundle, _REMEDY)
    if manifest["files"] != {"path": FILES, **index.entry}:
        raise OutputError(f"{bundle / MANIFEST}: {DAMAGED}, names another {FILES}: {_REMEDY}")
    files |= {FILES: index, MANIFEST: _made(_content(bundle / MANIFEST))}
    for path, file in list(files.items()):
        is_long = file.entry["bytes"] >= _SMALL_BYTES
        if path.endswith(".json") and is_long and f"{path}.gz" not in files:
            files[f"{path}.gz"] = _made(gzip.compress(file.read(), 9, mtime=0))
    return files


def _content(file: Path) -> bytes:
    return file.read_bytes()


def _made(content: bytes) -> _File:
    return _File({"bytes": len(content), "sha256": digest(content)}, lambda: content)


def _require_apart(folder: Path, out: Path) -> None:
    if folder.resolve().is_relative_to(out.resolve()):
        raise OutputError(f"TARGET is {folder}, inside OUT, expected a folder elsewhere")


def _specimen_of(bundle: Path, held: Contents) -> dict[str, str]:
    """Return the name of a bundle's specimen, and its source's fingerprint or an empty text."""
    found = contents_of(bundle)
    fingerprint = found.fingerprint
    if not fingerprint and held.build is not None:
        fingerprint = contents_of(held.build).fingerprint
    return {"name": found.name, "fingerprint": fingerprint or held.fingerprint}


def _upload(
    target: Target,
    files: Mapping[str, _File],
    paths: Iterable[str],
    report: Callable[[str], None],
) -> None:
    paths = list(paths)
    done = 0

    def put(path: str) -> None:
        nonlocal done
        target.write(path, files[path].read())
        done += 1
        if done % max(1, len(paths) // 10) == 0:
            report(f"{done}/{len(paths)} files")

    with ThreadPoolExecutor(target.at_once) as pool:
        list(pool.map(put, (path for path in paths if path not in _LAST)))
    for path in _LAST:
        if path in paths:
            put(path)
