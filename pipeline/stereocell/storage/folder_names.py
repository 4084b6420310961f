"""The names in a folder of this machine."""

import os
from pathlib import Path

from stereocell.model.errors import OutputError


def names_in_folder(folder: Path) -> list[str]:
    """Return the names in a folder, in order; empty if it is no folder.

    Raises OutputError where it can't be listed.
    """
    try:
        return sorted(os.listdir(folder))
    except (FileNotFoundError, NotADirectoryError):
        return []
    except OSError as error:
        raise OutputError(f"{folder}: can't be listed ({error.strerror})") from None
