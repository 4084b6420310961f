"""Keep OUT/exports.json, a list of the files that were exported from a build, with their hashes.

Most formats can't store which program wrote a file. By this list, an export replaces its own
earlier files, but no file that another program wrote or that was edited since.
"""

import hashlib
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from stereocell.building.out_folder import EXPORTS, OutFolder
from stereocell.model.errors import OutputError
from stereocell.storage.file_list import encode, list_files, measure
from stereocell.storage.json_files import find_sealed, write_sealed


def is_own(out: Path, file: Path) -> bool:
    """Return whether a file or folder was exported from OUT and is unchanged since."""
    found = find_sealed(OutFolder(out).exports_file, EXPORTS)
    return found is not None and found["files"].get(_key(file), "") == _digest(file)


def remember(out: Path, files: Iterable[Path]) -> None:
    """Add exported files to OUT's list.

    Does nothing if OUT can't be written, or if it is on object storage, which an export only reads.
    """
    out_folder = OutFolder(out)
    if out_folder.is_stored:
        return
    list_file = out_folder.exports_file
    found = find_sealed(list_file, EXPORTS) or {"files": {}}
    kept = {name: digest for name, digest in found["files"].items() if Path(name).exists()}
    with suppress(OutputError):
        added = {_key(file): _digest(file) for file in files}
        write_sealed(list_file, {"files": dict(sorted({**kept, **added}.items()))})


def _key(file: Path) -> str:
    return str(file.resolve())


def _digest(path: Path) -> str:
    """Return the SHA-256 of a file or of the list of a folder's files, or `nothing` without it."""
    if path.is_dir():
        return hashlib.sha256(encode(list_files(path, root=path))).hexdigest()
    return str(measure(path)["sha256"]) if path.is_file() else "nothing"
