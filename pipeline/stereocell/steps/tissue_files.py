"""Write OUT/tissue, the probabilities of the classes and their record, and check it for damage.

The record lists the SHA-256 of every file. The fingerprint is not enough, because it covers a
sample of the voxels. Readers don't notice either: Zarr reads a lost chunk as zeros, and zstd
decodes some damaged data to other voxels without an error.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
    intensity      mean of its voxels after bias correction; None for a class of a network
    probabilities  uint8 (z, y, x), 0..255
    """

    name: str
    color: tuple[float, float, float]
    intensity: float | None
    probabilities: NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class TissueClasses:
    """The classes of a region.

    record      content of tissue.json without the list of files
    start       first voxel (z, y, x) of the region in the source
    shape       voxels (z, y, x) of the whole source
    spacing_um  voxel spacing (z, y, x), um
    origin_um   centre of the source's voxel (0, 0, 0), (z, y, x) in um
    """

    classes: tuple[TissueClass, ...]
    record: Mapping[str, Any]
    start: tuple[int, int, int]
    shape: tuple[int, int, int]
    spacing_um: Spacing
    origin_um: Point


class TissueFolder:
    """The form of the classes in OUT: a volume that other programs can open, and its record."""

    def is_whole(self, place: Path) -> bool:
        """Return whether all files of the folder are there and undamaged."""
        return find_fault(place) is None

    def write(self, place: Path, result: TissueClasses) -> None:
        """Write the folder completely or not at all. Raises OutputError."""
        from stereocell.formats.ome_zarr_write import write_probabilities  # zarr is slow to import

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
    """Return the record in OUT/tissue. Raises OutputError if it is missing or invalid."""
    return dict(read_json(folder / RECORD, _SCHEMA, _AGAIN))


def find_fault(folder: Path) -> str | None:
    """Return a line on the first file that is missing or damaged; None: all are intact."""
    try:
        read_whole(folder)
    except OutputError as fault:
        return str(fault)
    return None


def read_whole(folder: Path) -> dict[str, Any]:
    """Return the record in OUT/tissue, after checking the hashes of all files.

    Raises OutputError for the first file that is missing, damaged or not listed.
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
    """Return the SHA-256 of each file with probabilities in `folder`, by relative path."""
    return {
        file.relative_to(folder).as_posix(): measure(file)["sha256"]
        for file in sorted((folder / VOXELS).rglob("*"))
        if file.is_file()
    }
