"""Compare the files of a stage with files.json, which lists the files that the build wrote.

A layer that differs from the list was either edited in place or damaged, and messages name both.
Edits belong in an artist's own layers, but some artists edit in place. If USD can open the layer,
it is used, and never replaced automatically. A binary layer of unchanged size is an exception: it
is not used, since a saved edit rarely has exactly the same size. USD can't find all damage: it
opens most layers with a flipped bit (34 of 40 trials gave a bundle).

Any other file that differs is damaged. Files that are not in the list belong to an artist.
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

FILES, STAGE_NAME, CONTENTS_NAME = "files.json", "stage.usda", "contents.usda"
NVINDEX_NAME = "nvindex.usda"
DISPLAY_NAME = "display.usda"
USDZ_NAME = "specimen.usdz"
LAYER_SUFFIXES = (".usda", ".usdc", ".usd")
CHANGED = "changed since it was written, by an edit or by damage"
DOUBTFUL = "changed since it was written but kept its size, by damage or by an edit"
REMEDY = "run `stereocell stage OUT`"
ADVICE = "put edits into a layer of your own over the stage"


def write_list(stage_dir: Path, tiles: FileList, *others: Path) -> None:
    """Write files.json: the entries `tiles`, and entries for files and folders `others`."""
    listed = {**tiles, **list_files(*others, root=stage_dir)}
    write_bytes(stage_dir / FILES, encode(listed))


def read_stage_list(stage_dir: Path) -> dict[str, Any]:
    """Return the content of files.json. Raises OutputError if it is missing or damaged."""
    return read_list(stage_dir / FILES, REMEDY)


# Content of a stage's files, by suffix. The only .usdc files are those of tiles.
_PARTS = {
    ".vdb": "volumes for other programs",
    ".exr": "volumes for the bundle, and lookup tables",
    ".usdc": "surfaces",
    ".png": "maps and previews",
    ".stl": "closed copies",
    ".usdz": "specimen.usdz",
}


def describe_parts(listed: FileList) -> str:
    """Return a sentence on the size of a stage and of its parts, largest first."""
    sizes = dict.fromkeys((*_PARTS, ""), 0)
    for path, entry in listed.items():
        suffix = Path(path).suffix
        sizes[suffix if suffix in _PARTS else ""] += entry["bytes"]
    largest = sorted(sizes.items(), key=lambda part: -part[1])
    words = [
        f"{size / 1e6:.1f} MB of {_PARTS[suffix]} ({suffix})"
        for suffix, size in largest
        if suffix and size
    ]
    return f"{sum(sizes.values()) / 1e6:.1f} MB: {', '.join(words)}"


def digest_of(listed: FileList) -> str:
    """Return a hash of a list of files, 20 hexadecimal digits."""
    return hashlib.sha256(encode(listed)).hexdigest()[:20]


def find_damage(root: Path, listed: FileList, *, since: Path | None = None) -> dict[str, str]:
    """Return the fault of each faulty file of a list, by path.

    Faults are those of `file_list.find_faults`, and CHANGED or DOUBTFUL for layers.
    """
    faults = find_faults(root, listed, since=since)
    return {
        path: _name_fault(root / path, listed[path]) if fault == DAMAGED else fault
        for path, fault in faults.items()
    }


def _name_fault(file: Path, entry: Mapping[str, Any]) -> str:
    """Return the fault of a file that differs from the list: DAMAGED, CHANGED or DOUBTFUL."""
    from stereocell.usd.layer import is_layer  # USD is slow to import

    if file.suffix not in LAYER_SUFFIXES:
        return DAMAGED
    with cached(file):
        if not is_layer(file):
            return DAMAGED
        is_as_long = file.stat().st_size == entry["bytes"]
    return DOUBTFUL if is_as_long and file.suffix != ".usda" else CHANGED


def require_kept(root: Path, listed: FileList, since: Path) -> None:
    """Raise StageError if a file of a list is missing or damaged, or a layer probably is."""
    for path, fault in find_damage(root, listed, since=since).items():
        if fault != CHANGED:
            raise _error_of(root / path, fault)


def is_kept(root: Path, listed: FileList, since: Path) -> bool:
    """Return whether each file of a list is unchanged, or is a layer that may have been edited."""
    return set(find_damage(root, listed, since=since).values()) <= {CHANGED, DOUBTFUL}


@dataclass(slots=True)
class AsWritten:
    """Compares files with the lists of their stages before they are read.

    lists    list of files for each stage, by its folder; missing lists are read when needed
    changed  layers that differ from their list and were accepted nevertheless
    """

    lists: dict[Path, FileList] = field(default_factory=dict)
    changed: set[Path] = field(default_factory=set)

    def require(self, file: Path) -> Path:
        """Fetch a file and return its path. Raises StageError if it is missing or damaged."""
        fetch(file)
        place = file.parent.resolve() / file.name
        folder, listed = self._list_over(place.parent)
        entry = listed.get(place.relative_to(folder).as_posix())
        if entry is not None:
            self._require(file, entry)
        return file

    def require_layers(self, folder: Path) -> None:
        """Raise StageError if a listed layer directly in a folder is missing or damaged."""
        folder = folder.resolve()
        root, listed = self._list_over(folder)
        for path in listed:
            file = root / path
            if file.parent == folder and file.suffix in LAYER_SUFFIXES:
                self.require(file)

    def _list_over(self, folder: Path) -> tuple[Path, FileList]:
        """Return the list for a folder or the nearest folder above it, and that list's folder.

        Without a list, returns the folder itself and an empty list.
        """
        for parent in (folder, *folder.parents):
            if parent not in self.lists:
                # A files.json alone is not enough: bundles have one, too.
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
    """Return the error for a stage's file that can't be used."""
    if fault == MISSING:
        return StageError(f"{file}: missing: {REMEDY}")
    if fault == DOUBTFUL:
        return StageError(f"{file}: {fault}: remove it and {REMEDY}; {ADVICE}")
    problem = f"damaged, because its size or hash differs from {FILES}"
    return StageError(f"{file}: {problem}: remove it and {REMEDY}")
