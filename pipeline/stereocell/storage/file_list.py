"""List written files with their size and SHA-256, so that damage can be found later.

A unit, the stage and the bundle each have such a list. A reader hashes a file before it reads it
(`is_same`), and `stereocell check` hashes all files. To decide whether there is work to do, only
files newer than their list are hashed; of all others the size is enough. SHA-256 processes 1 GB/s,
and BLAKE2b is not faster.
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

# {"bytes": ..., "sha256": ...} by path relative to the list's folder, with forward slashes
FileList = Mapping[str, Mapping[str, Any]]
MISSING, DAMAGED = "missing", "damaged"


def measure(file: Path) -> dict[str, Any]:
    """Return a file's entry in a list."""
    with file.open("rb") as opened:
        digest = hashlib.file_digest(opened, "sha256")
        return {"bytes": os.fstat(opened.fileno()).st_size, "sha256": digest.hexdigest()}


def list_files(*paths: Path, root: Path) -> dict[str, dict[str, Any]]:
    """Return the list of files, and of all files below folders, by path relative to `root`."""
    listed = {}
    for path in paths:
        with cached(path):
            for file in sizes_below(path):
                listed[file.relative_to(root).as_posix()] = measure(file)
    return listed


def encode(listed: FileList) -> bytes:
    """Return a list as JSON, sorted by path."""
    return to_json(dict(sorted(listed.items())))


def to_json(content: object) -> bytes:
    """Return a document as indented JSON in UTF-8, with a newline at its end."""
    return (json.dumps(content, indent=1, ensure_ascii=False) + "\n").encode()


def read_list(path: Path, remedy: str) -> dict[str, Any]:
    """Return the list in a file. Raises OutputError if it is missing or damaged.

    Only the form of its entries is checked, because a schema takes hundreds of times as long.
    """
    listed = read_json(path, None, remedy)
    if not isinstance(listed, dict) or not listed or not all(map(_is_entry, listed.values())):
        raise OutputError(f"{path}: damaged, this is not a list of files: {remedy}")
    return listed


def _is_entry(entry: Any) -> bool:
    return isinstance(entry, dict) and entry.keys() == {"bytes", "sha256"}


def is_same(file: Path, entry: Mapping[str, Any]) -> bool:
    """Return whether a fetched file matches its entry in a list."""
    return file.stat().st_size == entry["bytes"] and measure(file) == entry


def sizes_of(root: Path) -> dict[str, int]:
    """Return the sizes in bytes of all files below a folder, local or stored, by relative path."""
    found = sizes_below(root).items()
    return {file.relative_to(root).as_posix(): size for file, size in found if file != root}


def find_faults(root: Path, listed: FileList, *, since: Path | None = None) -> dict[str, str]:
    """Return the fault of each faulty file of a list, by path: MISSING or DAMAGED.

    since  the file that holds the list. Files that are not newer are compared by size only, and so
           are all files on object storage. None: all files are hashed
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
        with suppress(OSError):  # copied files are newer than the list; so they are hashed once
            os.utime(since)
