"""OUT/tissue: probabilities of the classes and their record, and a check that both are whole.

The record lists the SHA-256 of every file, since the fingerprint covers a sample of the voxels
only: Zarr reads a lost chunk as zeros, and zstd decodes some damage to other voxels without error.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.ome_zarr_write import write_probabilities
from stereocell.model.errors import OutputError
from stereocell.model.spacing import Point, Spacing
from stereocell.storage.atomic_write import replacing_folder
from stereocell.storage.file_list import measure
from stereocell.storage.json_files import read_json, write_json
from stereocell.storage.workspace import fetch

FOLDER, VOXELS, RECORD = "tissue", "classes.ome.zarr", "tissue.json"
_SCHEMA = "tissue.schema.json"
_AGAIN = "run `stereocell tissue OUT` again"


@dataclass(frozen=True, slots=True)
class TissueClass:
    """A class that becomes a channel.

    color          linear RGB, 0..1
    intensity      mean of its voxels, bias removed; None: a network does not know it
    probabilities  uint8 (z, y, x), 0..255
    """

    name: str
    color: tuple[float, float, float]
    intensity: float | None
    probabilities: NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class TissueClasses:
    """The classes of a region.

    record      the content of tissue.json, without its files
    start       voxel (z, y, x) of the source at which the region begins
    shape       voxels (z, y, x) of the whole source
    spacing_um  (z, y, x), um
    origin_um   (z, y, x), um: centre of the source's voxel (0, 0, 0)
    """

    classes: tuple[TissueClass, ...]
    record: Mapping[str, Any]
    start: tuple[int, int, int]
    shape: tuple[int, int, int]
    spacing_um: Spacing
    origin_um: Point


class TissueFolder:
    """The form of the classes in OUT: a volume that other programs open, and its record."""

    def is_whole(self, place: Path) -> bool:
        """Return whether all files of the folder are as written."""
        return find_fault(place) is None

    def write(self, place: Path, result: TissueClasses) -> None:
        """Write the folder, whole or not at all. Raises OutputError."""
        with replacing_folder(place) as folder:
            write_probabilities(
                folder / VOXELS,
                [one.probabilities for one in result.classes],
                channels=[(one.name, one.color) for one in result.classes],
                start=result.start,
                shape=result.shape,
                spacing_um=result.spacing_um,
                origin_um=result.origin_um,
            )
            write_json(folder / RECORD, {**result.record, "files": _digests_of(folder)})


TISSUE_FOLDER = TissueFolder()


def read_record(folder: Path) -> dict[str, Any]:
    """Return the record in OUT/tissue. Raises OutputError where it is missing or invalid."""
    return dict(read_json(folder / RECORD, _SCHEMA, _AGAIN))


def find_fault(folder: Path) -> str | None:
    """Return a line on the first file that is missing or damaged; None: all are as written."""
    try:
        read_whole(folder)
    except OutputError as fault:
        return str(fault)
    return None


def read_whole(folder: Path) -> dict[str, Any]:
    """Return the record in OUT/tissue after a check that all its files are as written.

    Raises OutputError for the first file that isn't.
    """
    record = read_record(folder)
    fetch(folder)
    found, written = _digests_of(folder), record["files"]
    for name in sorted(written.keys() | found.keys()):
        if found.get(name) != written.get(name):
            fault = "missing" if name not in found else "damaged"
            if name not in written:
                fault = "not of this build"
            raise OutputError(f"{folder / name}: {fault}: {_AGAIN}")
    return record


def _digests_of(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each file of the probabilities in `folder`, by relative path."""
    return {
        file.relative_to(folder).as_posix(): measure(file)["sha256"]
        for file in sorted((folder / VOXELS).rglob("*"))
        if file.is_file()
    }
