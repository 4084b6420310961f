"""Puts a bundle at a target, and no more than has changed since the last time.

What was put there is listed beside it. So a second run knows what it may overwrite and remove: what
somebody else put there is left alone, and refused by name where a file of the bundle would take its
place. Files that lead to others come last, so that whoever opens the page meanwhile sees the
earlier one or the new one.
"""

import gzip
from collections.abc import Callable, Iterable, Mapping, Sequence
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
    REPLACES,
    Entries,
    find_changed,
    list_of,
    read_published,
    require_own,
    require_unchanged,
)
from stereocell.publish.targets import Target, digest, target_of
from stereocell.storage.contents import PUBLISHED, Contents, contents_of
from stereocell.storage.file_list import DAMAGED, find_faults, read_list
from stereocell.storage.kinds import Kind
from stereocell.storage.overwriting import is_forced
from stereocell.storage.workspace import cached

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
class _OfRun:
    """The paths that a run has uploaded, and the specimen that it has published."""

    uploaded: Sequence[str]
    specimen: Mapping[str, str]


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
    files = _files_of(bundle)
    specimen = _specimen_of(bundle, held)
    target = target_of(text, is_public=is_public)
    if isinstance(folder := getattr(target, "folder", None), Path):
        _require_apart(folder, out)
    entries = {path: file.entry for path, file in files.items()}
    changed, gone = _put(target, files, entries, specimen, report)
    address = (url and url.rstrip("/") + "/") or target.address
    faults = (
        fetch_faults(address, entries, report)
        if address
        else {p: "is another" for p in files if digest(target.read(p)) != entries[p]["sha256"]}
    )
    if faults:
        raise _fault_of(target, address, faults, entries, _OfRun(changed, specimen))
    size = sum(entry["bytes"] for entry in entries.values())
    sent = sum(entries[path]["bytes"] for path in changed)
    page = address and find_page(address, entries)
    return Published(page, len(files), size, len(changed), sent, len(gone))


def _put(
    target: Target,
    files: Mapping[str, _File],
    entries: Entries,
    specimen: Mapping[str, str],
    report: Callable[[str], None],
) -> tuple[list[str], list[str]]:
    """Upload what has changed and remove what has gone; return the paths of both.

    Raises OutputError, before anything is written, where the target holds what is not ours.
    """
    there = target.sizes()
    before = read_published(target, there)
    require_own(target, entries, there, before, specimen)
    other = find_changed(target, entries, there, before) if is_forced() else []
    changed = [
        path
        for path, entry in entries.items()
        if before.get(path) != entry or there.get(path) != entry["bytes"] or path in other
    ]
    gone = [path for path in before if path not in files]
    require_unchanged(target, [*changed, *gone], there, before)
    if changed or gone or before != entries:
        # what is about to be there is ours, too, should this run be killed
        unsure = dict.fromkeys((*gone, *changed))
        target.write(PUBLISHED, list_of({**before, **entries, **unsure}, specimen))
        _upload(target, files, changed, report)
        for path in gone:
            if path in there:
                target.remove(path)
        target.write(PUBLISHED, list_of(entries, specimen))
    return changed, gone


def _fault_of(
    target: Target, address: str | None, faults: Mapping[str, str], entries: Entries, run: _OfRun
) -> OutputError:
    """Return the error of files that are not as they were put there, or not sent so.

    What this run has put there and the target has otherwise is put there anew by the next run.
    Anything else that the target has otherwise was changed by somebody: only --force replaces it.
    """
    other = [p for p in faults if digest(target.read(p)) != entries[p]["sha256"]]
    spoilt = [path for path in other if path in run.uploaded]
    if spoilt:
        target.write(PUBLISHED, list_of({**entries, **dict.fromkeys(spoilt)}, run.specimen))
    path, fault = next(iter(sorted(faults.items())))
    remedy = ""
    if path in other:
        remedy = f"{CHANGED}: {REPLACES}"
    if path in spoilt:
        remedy = "the same command puts it there again"
    return OutputError(
        f"{address or target.shown + '/'}{path}: {fault}, expected the bundle's file of "
        f"{entries[path]['bytes']} bytes"
        + (f" ({len(faults)} such)" if len(faults) > 1 else "")
        + (f": {remedy}" if remedy else "")
    )


def _files_of(bundle: Path) -> dict[str, _File]:
    """Return the bundle's files by path, and JSON packed for hosts that send such files."""
    listed = read_list(bundle / FILES, _REMEDY)
    if faults := find_faults(bundle, listed):
        path, fault = next(iter(faults.items()))
        raise OutputError(f"{bundle / path}: {fault}: {_REMEDY}")
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
    with cached(file):
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
