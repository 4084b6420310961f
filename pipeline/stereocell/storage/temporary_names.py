"""Recognise and remove temporary files and folders by their names."""

import os
import re
import shutil
from pathlib import Path

# A file is named .STEM.TOKEN.SUFFIX, a folder .NAME.TOKEN.partial or .NAME.TOKEN.old.
_TEMPORARY = re.compile(r"\.(?P<name>.+)\.[0-9a-f]{8}(?P<suffix>\.partial|\.old|\.\w+|)")


def clear_remains(out: Path) -> None:
    """Remove all temporary files that a killed command left in its OUT."""
    for path in out.rglob(".*"):
        if _TEMPORARY.fullmatch(path.name):
            remove_remains(path)


def clear_beside(path: Path) -> None:
    """Remove the temporary files of `path` that a killed worker left beside it."""
    if path.parent.is_dir():
        for name in os.listdir(path.parent):
            found = _TEMPORARY.fullmatch(name)
            if found and path.name in (found["name"], f"{found['name']}{found['suffix']}"):
                remove_remains(path.parent / name)


def remove_remains(path: Path) -> None:
    """Remove a temporary file or folder, if it exists."""
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)  # a worker that was cut off may still write there
    else:
        path.unlink(missing_ok=True)
