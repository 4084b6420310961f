"""Number the folders of a source's views, `g1`, `g2`, ...

A view is a bundle that is served before or during a build. Each one gets a folder of its own, so
that pages that opened an older one still find its files.
"""

import re
from pathlib import Path

_NAME = re.compile(r"g([1-9][0-9]{0,8})")


def next_view(folder: Path) -> Path:
    """Return the path for the next view in a folder, numbered after all existing ones."""
    numbers = [int(found[1]) for found in map(_number_in, folder.glob("g*")) if found]
    return folder / f"g{1 + max(numbers, default=0)}"


def find_view(folder: Path, name: str) -> Path | None:
    """Return the folder of a view by its name; None if there is no such view."""
    found = folder / name
    return found if _NAME.fullmatch(name) and found.is_dir() else None


def _number_in(path: Path) -> re.Match[str] | None:
    return _NAME.fullmatch(path.name)
