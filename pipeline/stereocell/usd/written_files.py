"""files.json of a stage: what the build wrote there, to be told from damage and from edits.

A layer that is not as it was written and can still be opened may have been edited in place, though
layers of an artist's own are where edits belong, or be damaged: both are said. It is never made
anew by itself, and it is used: but for a binary one of the very size that it had. USD opens most of
those in which a bit flipped (34 of 40 tried gave a bundle), and an edit that is saved is seldom as
long to the byte. Any other file that differs is damaged. Files that are not listed are an artist's
own.
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
    FileList,
    encode,
    find_faults,
    is_same,
    list_files,
    read_list,
)
from stereocell.storage.workspace import cached, fetch, is_file
from stereocell.usd.layer import LAYER_SUFFIXES, is_layer

FILES, STAGE_NAME = "files.json", "stage.usda"
CHANGED = "changed since it was written: edited in place, or damaged"
DOUBTFUL = "changed since it was written, not in size: damaged, or edited in place"
REMEDY = "run `stereocell stage OUT`"
ADVICE = "edits belong in a layer of your own over the stage"


def write_list(stage_dir: Path, tiles: FileList, *others: Path) -> None:
    """Write files.json: the files of `tiles`, which are known, and all that is at `others`."""
    listed = {**tiles, **list_files(*others, root=stage_dir)}
    write_bytes(stage_dir / FILES, encode(listed))


def read_stage_list(stage_dir: Path) -> dict[str, Any]:
    """Return what files.json holds. Raises OutputError."""
    return read_list(stage_dir / FILES, REMEDY)


def digest_of(listed: FileList) -> str:
    """Return a digest of a list."""
    return hashlib.sha256(encode(listed)).hexdigest()[:20]


def find_damage(root: Path, listed: FileList, since: Path | None = None) -> dict[str, str]:
    """Return what is wrong with the files of a list, by path: as `file_list.find_faults` says, or
    CHANGED or DOUBTFUL for a layer."""
    faults = find_faults(root, listed, since)
    return {
        path: _name_fault(root / path, listed[path]) if fault == DAMAGED else fault
        for path, fault in faults.items()
    }


def _name_fault(file: Path, entry: Mapping[str, Any]) -> str:
    """Return what is to be said of a file that is not the one of the list."""
    if file.suffix not in LAYER_SUFFIXES:
        return DAMAGED
    with cached(file):
        if not is_layer(file):
            return DAMAGED
        is_as_long = file.stat().st_size == entry["bytes"]
    return DOUBTFUL if is_as_long and file.suffix != ".usda" else CHANGED


def is_kept(root: Path, listed: FileList, since: Path) -> bool:
    """Return whether no file of a list is lost or damaged but a layer that may have been edited."""
    return set(find_damage(root, listed, since).values()) <= {CHANGED, DOUBTFUL}


@dataclass(slots=True)
class AsWritten:
    """What the lists of the stages say of the files that are read from them.

    lists    of each stage by its folder; those of others are read there once they are needed
    changed  layers that are not as they were written, and were let through
    """

    lists: dict[Path, FileList] = field(default_factory=dict)
    changed: set[Path] = field(default_factory=set)

    def require(self, file: Path) -> Path:
        """Return a file, which is at hand. Raises StageError for a damaged one."""
        place = file.parent.resolve() / file.name
        folder, listed = self._list_over(place.parent)
        entry = listed.get(place.relative_to(folder).as_posix())
        if entry is not None:
            self._require(file, entry)
        return file

    def require_layers(self, folder: Path) -> None:
        """Raise StageError if a layer right in a folder of a stage is damaged or lost."""
        folder = folder.resolve()
        root, listed = self._list_over(folder)
        for path, entry in listed.items():
            file = root / path
            if file.parent == folder and file.suffix in LAYER_SUFFIXES:
                fetch(file)
                self._require(file, entry)

    def _list_over(self, folder: Path) -> tuple[Path, FileList]:
        """Return the list that holds what lies in a folder, and where it lies; an empty one."""
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
            raise StageError(f"{file}: missing: {REMEDY}")
        if is_same(file, entry):
            return
        fault = _name_fault(file, entry)
        if fault == CHANGED:
            self.changed.add(file)
        elif fault == DOUBTFUL:
            raise StageError(f"{file}: {fault}: remove it and {REMEDY}; {ADVICE}")
        else:
            said = f"damaged, not the bytes that {FILES} says"
            raise StageError(f"{file}: {said}: remove it and {REMEDY}")
