"""Recognise a Zarr group in a zip file: OME-Zarr in one file (RFC-9)."""

import os
import zipfile
from collections.abc import Collection
from functools import lru_cache

ARCHIVE_ENDINGS = (".ozx", ".ome.zarr.zip", ".zarr.zip")
ZARR_FILES = ("zarr.json", ".zgroup", ".zattrs", ".zarray")


def zarr_root_in(names: Collection[str]) -> str | None:
    """Return the folder of a Zarr group among the members of a zip file, with a final slash.

    The group lies at the root (empty text), or else in the only folder. None: there is no group.
    """
    if any(file in names for file in ZARR_FILES):
        return ""
    folders = {name.partition("/")[0] for name in names if not name.startswith("__MACOSX/")}
    folder = f"{next(iter(folders))}/" if len(folders) == 1 else ""
    return folder if any(f"{folder}{file}" in names for file in ZARR_FILES) else None


def is_archive(path: str) -> bool:
    """Return whether a file is a zip file that holds a Zarr group, or is named like one."""
    lower = path.lower()
    if not lower.endswith((".zip", ".ozx")) or not os.path.isfile(path):
        return False
    if lower.endswith(ARCHIVE_ENDINGS) and zipfile.is_zipfile(path):
        return True  # the reader reports a missing group
    return zarr_root_in(_members(path, os.path.getmtime(path))) is not None


@lru_cache(maxsize=8)
def _members(path: str, _: float) -> frozenset[str]:
    """Return the names of a zip file's members; empty: it can't be read."""
    try:
        with zipfile.ZipFile(path) as archive:
            return frozenset(archive.namelist())
    except (OSError, zipfile.BadZipFile):
        return frozenset()
