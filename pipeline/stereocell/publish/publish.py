"""Puts a bundle at a target, and no more than has changed since the last time.

What was put there is listed beside it. So a second run knows what it may overwrite and remove: what
somebody else put there is left alone, and refused by name where a file of the bundle would take its
place. Files that lead to others come last, so that whoever opens the page meanwhile sees the
earlier one or the new one.
"""

import gzip
import json
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any

from stereocell.building.made_of import require_current
from stereocell.building.out_folder import OutFolder
from stereocell.model.errors import OutputError, UsageError
from stereocell.publish.over_http import INDEX, fetch_faults, find_page
from stereocell.publish.targets import Target, digest, target_of
from stereocell.storage.contents import PUBLISHED, Contents, contents_of, words_for
from stereocell.storage.file_list import DAMAGED, FileList, find_faults, read_list, to_json
from stereocell.storage.json_files import read_json
from stereocell.storage.kinds import Kind
from stereocell.storage.overwriting import is_forced, or_force, refused
from stereocell.storage.workspace import cached

FILES, MANIFEST = "files.json", "manifest.json"
_LAST = ("sw.js", FILES, MANIFEST, INDEX)
_REMEDY = "run `stereocell bundle OUT` first"
_OF_HOSTS = ("CNAME", "README.md", "LICENSE", "robots.txt", "404.html")
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
        require_current(OutFolder(build))
    listed = read_list(bundle / FILES, _REMEDY)
    files = _files_of(bundle, listed)
    specimen = _specimen_of(bundle, held)
    target = target_of(text, is_public=is_public)
    if isinstance(folder := getattr(target, "folder", None), Path):
        _require_apart(folder, out)
    there = target.sizes()
    before = _read_published(target, there)
    _require_own(target, files, there, before, specimen)
    _require_whole(bundle, listed)  # after the guards: it hashes all of the bundle
    changed = [
        path
        for path, file in files.items()
        if before.get(path) != file.entry or there.get(path) != file.entry["bytes"]
    ]
    gone = [path for path in before if path not in files]
    entries = {path: file.entry for path, file in files.items()}
    if changed or gone or before != entries:
        # what is about to be there is ours, too, should this run be killed
        unsure = dict.fromkeys((*gone, *changed))
        target.write(PUBLISHED, _list({**before, **entries, **unsure}, specimen))
        _upload(target, files, changed, report)
        for path in gone:
            if path in there:
                target.remove(path)
        target.write(PUBLISHED, _list(entries, specimen))
    address = (url and url.rstrip("/") + "/") or target.address
    faults = (
        fetch_faults(address, entries, report)
        if address
        else {p: "is another" for p in files if digest(target.read(p)) != entries[p]["sha256"]}
    )
    if faults:
        # what the target itself has otherwise is put there anew by the next run
        spoilt = [p for p in faults if digest(target.read(p)) != entries[p]["sha256"]]
        target.write(PUBLISHED, _list({**entries, **dict.fromkeys(spoilt)}, specimen))
        path, fault = next(iter(sorted(faults.items())))
        raise OutputError(
            f"{address or target.shown + '/'}{path}: {fault}, expected the bundle's file of "
            f"{entries[path]['bytes']} bytes"
            + (f" ({len(faults)} such)" if len(faults) > 1 else "")
            + (": the same command puts it there again" if path in spoilt else "")
        )
    size = sum(entry["bytes"] for entry in entries.values())
    sent = sum(entries[path]["bytes"] for path in changed)
    page = address and find_page(address, entries)
    return Published(page, len(files), size, len(changed), sent, len(gone))


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
    manifest = read_json(bundle / MANIFEST, None, _REMEDY)
    if not isinstance(manifest, dict) or manifest.get("files") != {"path": FILES, **index.entry}:
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
    """Return the name of a bundle's specimen, and its source's fingerprint; empty: unknown."""
    fingerprint = held.fingerprint
    if held.build is not None:
        fingerprint = contents_of(held.build).fingerprint
    return {"name": contents_of(bundle).name, "fingerprint": fingerprint}


def _list(entries: Mapping[str, Any], specimen: Mapping[str, str]) -> bytes:
    content = {
        "format": "stereocell-published",
        "version": 1,
        "specimen": specimen,
        "files": dict(sorted(entries.items())),
    }
    return to_json(content)


def _read_published(target: Target, there: Mapping[str, int]) -> dict[str, Any]:
    """Return what an earlier run has put there; of what it may have put: None."""
    if PUBLISHED not in there:
        return {}
    where = f"{target.shown}/{PUBLISHED}"
    try:
        found = json.loads(target.read(PUBLISHED))
        files = dict(found["files"])
        is_known = found["format"] == "stereocell-published" and found["version"] == 1
    except (ValueError, TypeError, KeyError, RecursionError):
        is_known, files = False, {}
    # the list says what may be removed: a path in it may lead nowhere else
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


def _require_own(
    target: Target,
    files: Mapping[str, _File],
    there: Mapping[str, int],
    before: Mapping[str, Any],
    specimen: Mapping[str, str],
) -> None:
    """Raise OutputError where the target holds another page, or files that were not published.

    Files for the web host, such as CNAME, may lie in a target before the first run.
    """
    if is_forced():
        return
    for path, file in files.items():
        if path in there and path not in before and not _is_same(target, path, file, there):
            raise OutputError(
                f"{target.shown}/{path}: is there, and was not put there by this command, "
                f"expected a place of the bundle's own: {or_force('choose another place')}"
            )
    others = [path for path in there if path not in files and not _is_of_host(path)]
    if not before and others:
        raise refused(target.shown, words_for(others), "nothing or a published page")
    earlier = _published_specimen(target, there)
    if before and earlier and not _is_same_specimen(earlier, specimen):
        found, expected = (_shown_specimen(one) for one in (earlier, specimen))
        raise refused(target.shown, f"a published page of {found}", f"one of {expected}")


def _is_same_specimen(one: Mapping[str, str], other: Mapping[str, str]) -> bool:
    """Return whether names are equal, and fingerprints where both are known."""
    prints = {each.get("fingerprint", "") for each in (one, other)} - {""}
    return one.get("name") == other.get("name") and len(prints) <= 1


def _shown_specimen(specimen: Mapping[str, str]) -> str:
    fingerprint = specimen.get("fingerprint", "")
    shown = f" ({fingerprint[:12]})" if fingerprint else ""
    return f"{specimen.get('name')!r:.80}{shown}"


def _is_same(target: Target, path: str, file: _File, there: Mapping[str, int]) -> bool:
    has_size = there[path] == file.entry["bytes"]
    return has_size and digest(target.read(path)) == file.entry["sha256"]


def _is_of_host(path: str) -> bool:
    """Return whether a file in a target is for the web host, which reads it to serve the folder."""
    return path in _OF_HOSTS or path.startswith(".")


def _published_specimen(target: Target, there: Mapping[str, int]) -> dict[str, str]:
    """Return the specimen of the page at a target; an earlier version's page has only its name."""
    for path in (PUBLISHED, MANIFEST):
        if path not in there:
            continue
        try:
            found = json.loads(target.read(path))["specimen"]
            return {key: str(found[key]) for key in ("name", "fingerprint") if key in found}
        except (ValueError, TypeError, KeyError, RecursionError):
            continue
    return {}


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
