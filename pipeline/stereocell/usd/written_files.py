"""files.json of a stage lists the files that the build wrote, to detect damage and edits.

A layer that differs from the list but can be opened may have been edited in place (although edits
belong in an artist's own layers), or be damaged; messages name both. It is never rebuilt
automatically, and it is used, except for a binary layer of unchanged size. USD opens most layers
with a flipped bit (34 of 40 tried gave a bundle), and a saved edit seldom has the same length to
the byte. Any other file that differs is damaged. Files outside the list are an artist's own.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stereocell.model.errors import StageError
from stereocell.storage.atomic_write import write_bytes
from stereocell.storage.file_list import (
    DAMAGED,
    MISSING,
    FileList,
    encode,
    find_faults,
    is_same,
    list_files,
    read_list,
)
from stereocell.storage.workspace import cached, fetch, is_file
from stereocell.usd.layer import LAYER_SUFFIXES, is_layer

FILES, STAGE_NAME, CONTENTS_NAME = "files.json", "stage.usda", "contents.usda"
NVINDEX_NAME = "nvindex.usda"
DISPLAY_NAME = "display.usda"
CHANGED = "changed since it was written: edited in place, or damaged"
DOUBTFUL = "changed since it was written, not in size: damaged, or edited in place"
REMEDY = "run `stereocell stage OUT`"
ADVICE = "edits belong in a layer of your own over the stage"


def write_list(stage_dir: Path, tiles: FileList, *others: Path) -> None:
    """Write files.json: the given entries of `tiles`, and new ones of all files at `others`."""
    listed = {**tiles, **list_files(*others, root=stage_dir)}
    write_bytes(stage_dir / FILES, encode(listed))


def read_stage_list(stage_dir: Path) -> dict[str, Any]:
    """Return the content of files.json. Raises OutputError where it is missing or damaged."""
    return read_list(stage_dir / FILES, REMEDY)


# This table says what the files of a stage hold, by suffix. Tiles have no other .usdc.
_PARTS = {
    ".vdb": "volumes for other programs",
    ".exr": "volumes for the bundle, and looks",
    ".usdc": "surfaces",
    ".png": "maps and previews",
    ".stl": "closed copies",
    ".usdz": "specimen.usdz",
}


def describe_parts(listed: FileList) -> str:
    """Return a line on how large a stage is, and each of its parts, the largest first."""
    sizes = dict.fromkeys((*_PARTS, ""), 0)
    for path, entry in listed.items():
        suffix = Path(path).suffix
        sizes[suffix if suffix in _PARTS else ""] += entry["bytes"]
    largest = sorted(sizes.items(), key=lambda part: -part[1])
    words = [
        f"{size / 1e6:.1f} {_PARTS[suffix]} ({suffix})"
        for suffix, size in largest
        if suffix and size
    ]
    return f"{sum(sizes.values()) / 1e6:.1f} MB: {', '.join(words)}"


def digest_of(listed: FileList) -> str:
    """Return a digest of a list."""
    return hashlib.sha256(encode(listed)).hexdigest()[:20]


def find_damage(root: Path, listed: FileList, *, since: Path | None = None) -> dict[str, str]:
    """Return the fault of each file of a list that has one, by path: as `file_list.find_faults`, or
    CHANGED or DOUBTFUL for a layer."""
    faults = find_faults(root, listed, since=since)
    return {
        path: _name_fault(root / path, listed[path]) if fault == DAMAGED else fault
        for path, fault in faults.items()
    }


def _name_fault(file: Path, entry: Mapping[str, Any]) -> str:
    """Return the fault of a file that differs from the list."""
    if file.suffix not in LAYER_SUFFIXES:
        return DAMAGED
    with cached(file):
        if not is_layer(file):
            return DAMAGED
        is_as_long = file.stat().st_size == entry["bytes"]
    return DOUBTFUL if is_as_long and file.suffix != ".usda" else CHANGED


def require_kept(root: Path, listed: FileList, since: Path) -> None:
    """Raise StageError where a file of a list is missing or damaged, or a layer most likely is."""
    for path, fault in find_damage(root, listed, since=since).items():
        if fault != CHANGED:
            raise _error_of(root / path, fault)


def is_kept(root: Path, listed: FileList, since: Path) -> bool:
    """Return whether every file of a list is unchanged or a layer that may have been edited."""
    return set(find_damage(root, listed, since=since).values()) <= {CHANGED, DOUBTFUL}


@dataclass(slots=True)
class AsWritten:
    """Compares files with the lists of their stages before they are read.

    lists    of each stage by its folder; other lists are read there on first use
    changed  layers that differ from their list and were accepted
    """

    lists: dict[Path, FileList] = field(default_factory=dict)
    changed: set[Path] = field(default_factory=set)

    def require(self, file: Path) -> Path:
        """Fetch a file and return it. Raises StageError where it is missing or damaged."""
        fetch(file)
        place = file.parent.resolve() / file.name
        folder, listed = self._list_over(place.parent)
        entry = listed.get(place.relative_to(folder).as_posix())
        if entry is not None:
            self._require(file, entry)
        return file

    def require_layers(self, folder: Path) -> None:
        """Raise StageError where a layer directly in a folder of a stage is missing or damaged."""
        folder = folder.resolve()
        root, listed = self._list_over(folder)
        for path in listed:
            file = root / path
            if file.parent == folder and file.suffix in LAYER_SUFFIXES:
                self.require(file)

    def _list_over(self, folder: Path) -> tuple[Path, FileList]:
        """Return the folder of the list that covers `folder`, and the list; or an empty one."""
        for parent in (folder, *folder.parents):
            if parent not in self.lists:
                # a bundle has a files.json, too
                has_one = is_file(parent / FILES) and is_file(parent / STAGE_NAME)
                self.lists[parent] = read_stage_list(parent) if has_one else {}
            if self.lists[parent]:
                return parent, self.lists[parent]
        return folder, {}

    def _require(self, file: Path, entry: Mapping[str, Any]) -> None:
        if not file.is_file():
            raise _error_of(file, MISSING)
        if is_same(file, entry):
            return
        fault = _name_fault(file, entry)
        if fault != CHANGED:
            raise _error_of(file, fault)
        self.changed.add(file)


def _error_of(file: Path, fault: str) -> StageError:
    """Return the error of a file of the stage that can't be used."""
    if fault == MISSING:
        return StageError(f"{file}: missing: {REMEDY}")
    if fault == DOUBTFUL:
        return StageError(f"{file}: {fault}: remove it and {REMEDY}; {ADVICE}")
    problem = f"damaged, not the bytes that {FILES} says"
    return StageError(f"{file}: {problem}: remove it and {REMEDY}")
