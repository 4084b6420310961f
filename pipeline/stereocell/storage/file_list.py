"""Lists of written files with the size and SHA-256 of each, to compare them with later.

A unit, the stage and the bundle each have one. A reader hashes a file before it reads it
(`is_same`); `stereocell check` hashes all files. A check whether there is work to do hashes no file
that is no newer than its list: there it compares sizes only. SHA-256 hashes 1 GB/s here, BLAKE2b no
more.
"""

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from stereocell.model.errors import OutputError
from stereocell.storage.json_files import read_json
from stereocell.storage.workspace import cached, is_mirrored, sizes_below

# path relative to the list's folder, with forward slashes -> {"bytes": ..., "sha256": ...}
FileList = Mapping[str, Mapping[str, Any]]
MISSING, DAMAGED = "missing", "damaged"


def measure(file: Path) -> dict[str, Any]:
    """Return a file's entry in a list."""
    with file.open("rb") as opened:
        digest = hashlib.file_digest(opened, "sha256")
        return {"bytes": os.fstat(opened.fileno()).st_size, "sha256": digest.hexdigest()}


def list_files(*paths: Path, root: Path) -> dict[str, dict[str, Any]]:
    """Return the list of files, and of all files below folders, by their paths from `root`."""
    listed = {}
    for path in paths:
        with cached(path):
            for file in sizes_below(path):
                listed[file.relative_to(root).as_posix()] = measure(file)
    return listed


def encode(listed: FileList) -> bytes:
    """Return a list as the JSON of a file, in the order of the paths."""
    return to_json(dict(sorted(listed.items())))


def to_json(content: object) -> bytes:
    """Return a document as UTF-8, indented, with a newline at its end."""
    return (json.dumps(content, indent=1, ensure_ascii=False) + "\n").encode()


def read_list(path: Path, remedy: str) -> dict[str, Any]:
    """Return the list in a file. Raises OutputError where it is missing or damaged.

    Only the form of its entries is checked: a schema takes hundreds of times as long.
    """
    listed = read_json(path, None, remedy)
    if not isinstance(listed, dict) or not listed or not all(map(_is_entry, listed.values())):
        raise OutputError(f"{path}: damaged, no list of files: {remedy}")
    return listed


def _is_entry(entry: Any) -> bool:
    return isinstance(entry, dict) and entry.keys() == {"bytes", "sha256"}


def is_same(file: Path, entry: Mapping[str, Any]) -> bool:
    """Return whether a fetched file is the one of the list."""
    return file.stat().st_size == entry["bytes"] and measure(file) == entry


def sizes_of(root: Path) -> dict[str, int]:
    """Return the bytes of all files below a folder, local or stored, by their paths from there."""
    found = sizes_below(root).items()
    return {file.relative_to(root).as_posix(): size for file, size in found if file != root}


def find_faults(root: Path, listed: FileList, *, since: Path | None = None) -> dict[str, str]:
    """Return the fault of each file of a list that has one, by path: MISSING or DAMAGED.

    since  the file that holds the list: a file of the right size passes where it is no newer than
           this, and always on object storage. None: all files are hashed
    """
    return dict(_faults(root, listed, since))


def _faults(root: Path, listed: FileList, since: Path | None) -> Iterator[tuple[str, str]]:
    sizes = sizes_of(root)
    newest = None if since is None or is_mirrored(root) else since.stat().st_mtime_ns
    hashed = faults = 0
    for path, entry in listed.items():
        file = root / path
        if path not in sizes:
            fault = MISSING
        elif sizes[path] != entry["bytes"]:
            fault = DAMAGED
        elif since is not None and (newest is None or file.stat().st_mtime_ns <= newest):
            continue
        else:
            hashed += 1
            with cached(file):
                if is_same(file, entry):
                    continue
            fault = DAMAGED
        faults += 1
        yield path, fault
    if since is not None and hashed and not faults:
        with suppress(OSError):  # copied files have the times of copying: they are hashed once
            os.utime(since)
