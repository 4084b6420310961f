"""OUT/tissue: probabilities of the classes and their record, and a check that both are whole.

The record lists the SHA-256 of every file, since the fingerprint covers a sample of the voxels
only: Zarr reads a lost chunk as zeros, and zstd decodes some damage to other voxels without error.
"""

from pathlib import Path
from typing import Any

from stereocell.model.errors import OutputError
from stereocell.storage.file_list import measure
from stereocell.storage.json_files import read_json
from stereocell.storage.workspace import fetch

FOLDER, VOXELS, RECORD = "tissue", "classes.ome.zarr", "tissue.json"
_SCHEMA = "tissue.schema.json"
_AGAIN = "run `stereocell tissue OUT` again"


def digests_of(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each file of the probabilities in `folder`, by relative path."""
    return {
        file.relative_to(folder).as_posix(): measure(file)["sha256"]
        for file in sorted((folder / VOXELS).rglob("*"))
        if file.is_file()
    }


def read_record(folder: Path) -> dict[str, Any]:
    """Return the record in OUT/tissue. Raises OutputError where it is missing or invalid."""
    return dict(read_json(folder / RECORD, _SCHEMA, _AGAIN))


def read_whole(folder: Path) -> dict[str, Any]:
    """Return the record in OUT/tissue after a check that all its files are as written.

    Raises OutputError for the first file that isn't.
    """
    record = read_record(folder)
    fetch(folder)
    found, written = digests_of(folder), record["files"]
    for name in sorted(written.keys() | found.keys()):
        if found.get(name) != written.get(name):
            fault = "missing" if name not in found else "damaged"
            if name not in written:
                fault = "not of this build"
            raise OutputError(f"{folder / name}: {fault}: {_AGAIN}")
    return record
