"""Puts a bundle at a target, and no more than has changed since the last time.

What was put there is listed beside it. So a second run knows what it may overwrite and remove: what
somebody else put there is left alone, and refused by name where a file of the bundle would take its
place. Files that lead to others come last, so that whoever opens the page meanwhile sees the
earlier one or the new one.
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
_SMALL_BYTES = 1000  # JSON below is as short as it is


@dataclass(frozen=True, slots=True)
class Published:
    """What a run has done. address: of the page, for browsers, or None."""

    address: str | None
    files: int
    bytes: int
    uploaded: int
    uploaded_bytes: int
    removed: int


@dataclass(frozen=True, slots=True)
class _File:
    """A file of the bundle, or one that is made of it."""

    entry: Mapping[str, Any]  # bytes, sha256
    read: Callable[[], bytes]


@dataclass(frozen=True, slots=True)
class _Work:
    """The changes that a run makes at a target.

    there    bytes of each file at the target
    before   the entries of the files that an earlier run has put there
    changed  paths that are to be uploaded
    gone     paths that the bundle has no more
    """

    there: Mapping[str, int]
    before: Entries
    changed: Sequence[str]
    gone: Sequence[str]


def publish(
    out: Path, text: str, url: str | None, *, is_public: bool, report: Callable[[str], None]
) -> Published:
    """Put OUT's bundle at a target, and hold every file there against its hash.

    text       a folder, or an address that fsspec opens
    url        where browsers find it; None: of S3 its own address, else files are read again
    is_public  ask S3 to let everybody read each object (ACL public-read)
    report     takes lines of progress

    Raises UsageError for a url that is none; OutputError where the bundle is damaged or not made of
    the plan, units and stage beside it, or where the target can't be written, holds files of others
    in the bundle's place, or answers with something else.
    """
    if url is not None and not url.startswith(("https://", "http://")):
        raise UsageError(f"--url is {url}, expected an address as https://me.example/mine")
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
    _require_whole(bundle, listed)  # after the guards: it hashes all of the bundle
    _put(target, files, work, specimen, report)
    address = (url and url.rstrip("/") + "/") or target.address
    faults = (
        fetch_faults(address, entries, report)
        if address
        else {p: "is another" for p in files if digest(target.read(p)) != entries[p]["sha256"]}
    )
    if faults:
        other = {p for p in faults if digest(target.read(p)) != entries[p]["sha256"]}
        _mark_spoilt(target, other & {*work.changed}, entries, specimen)
        raise _error_of(address or f"{target.shown}/", faults, entries, other, work)
    size = sum(entry["bytes"] for entry in entries.values())
    sent = sum(entries[path]["bytes"] for path in work.changed)
    page = address and find_page(address, entries)
    return Published(page, len(files), size, len(work.changed), sent, len(work.gone))


def _compare(target: Target, entries: Entries, specimen: Mapping[str, str]) -> _Work:
    """Return the work that there is to do at a target.

    Raises OutputError where the target holds what is not ours, or what somebody edited.
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
    """Upload what has changed, and remove what the bundle has no more."""
    entries = {path: file.entry for path, file in files.items()}
    if not (work.changed or work.gone or work.before != entries):
        return
    # The list names the coming files first. A run that is killed then finds them as its own.
    unsure = dict.fromkeys((*work.gone, *work.changed))
    target.write(PUBLISHED, list_of({**work.before, **entries, **unsure}, specimen))
    _upload(target, files, work.changed, report)
    for path in work.gone:
        if path in work.there:
            target.remove(path)
    target.write(PUBLISHED, list_of(entries, specimen))


def _mark_spoilt(
    target: Target, spoilt: Iterable[str], entries: Entries, specimen: Mapping[str, str]
) -> None:
    """Note at the target which files the next run is to put there again."""
    if unsure := dict.fromkeys(spoilt):
        target.write(PUBLISHED, list_of({**entries, **unsure}, specimen))


def _error_of(
    where: str, faults: Mapping[str, str], entries: Entries, other: Collection[str], work: _Work
) -> OutputError:
    """Return the error of files that are not sent as they were put there.

    other  the files that the target itself has otherwise: those that this run has put there were
           spoilt on their way, and the next run puts them there again; somebody edited the others
    """
    path, fault = next(iter(sorted(faults.items())))
    remedy = f": {CHANGED}: {keep_copy()}" if path in other else ""
    if path in other and path in work.changed:
        remedy = ": the same command puts it there again"
    more = f" ({len(faults)} such)" if len(faults) > 1 else ""
    size = entries[path]["bytes"]
    return OutputError(
        f"{where}{path}: {fault}, expected the bundle's file of {size} bytes{more}{remedy}"
    )


def _require_whole(bundle: Path, listed: FileList) -> None:
    """Raise OutputError unless each file of the bundle's list has the bytes that it says."""
    _raise_on(bundle, find_faults(bundle, listed))


def _raise_on(bundle: Path, faults: Mapping[str, str]) -> None:
    """Raise OutputError with the first fault, if there is one."""
    if faults:
        path, fault = next(iter(faults.items()))
        raise OutputError(f"{bundle / path}: {fault}: {_REMEDY}")


def _files_of(bundle: Path, listed: FileList) -> dict[str, _File]:
    """Return the bundle's files by path, and JSON packed for hosts that send such files.

    Raises OutputError where a JSON file is damaged.
    """
    documents = {path: one for path, one in listed.items() if path.endswith(".json")}
    _raise_on(bundle, find_faults(bundle, documents))
    files = {path: _File(entry, partial(_content, bundle / path)) for path, entry in listed.items()}
    # the list names all files but itself and the manifest, which names the list
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
    """Return the name of a bundle's specimen, and the fingerprint of its source if it is known."""
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
