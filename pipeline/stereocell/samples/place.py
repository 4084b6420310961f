"""Check the path of a sample. Other content there is never replaced, except with --force."""

from collections.abc import Mapping
from pathlib import Path

import zarr

from stereocell.storage.overwriting import require_free

EXPECTED = "nothing or the same sample"
SAMPLE = "stereocell_sample"  # attribute of a Zarr group that holds the sample's arguments


def find_group(place: Path) -> zarr.Group | None:
    """Return the Zarr group at a path; None if there is none, or it is damaged."""
    try:
        return zarr.open_group(place, mode="r")
    except (OSError, ValueError, LookupError, TypeError):
        return None


def is_there(place: Path, content: bytes | Mapping[str, bytes]) -> bool:
    """Return whether a file or folder already holds the sample.

    content  bytes of the file, or of a folder's files by relative path

    Returns False for an incomplete folder of the sample. Raises OutputError for other content.
    """
    if isinstance(content, bytes):
        is_same = place.is_file() and place.read_bytes() == content
        require_free(place, expected=EXPECTED, is_ours=is_same)
        return is_same
    found = {
        file.relative_to(place).as_posix(): file for file in place.rglob("*") if file.is_file()
    }
    is_ours = place.is_dir() and all(
        name in content and file.read_bytes() == content[name] for name, file in found.items()
    )
    require_free(place, expected=EXPECTED, is_ours=is_ours)
    return is_ours and found.keys() == content.keys()
