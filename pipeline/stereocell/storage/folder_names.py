"""List the names in a local folder."""

import os
from pathlib import Path

from stereocell.model.errors import OutputError


def names_in_folder(folder: Path) -> list[str]:
    """Return the sorted names in a folder; empty: it is missing or not a folder.

    Raises OutputError if it can't be listed.
    """
    try:
        return sorted(os.listdir(folder))
    except (FileNotFoundError, NotADirectoryError):
        return []
    except OSError as error:
        raise OutputError(f"{folder}: can't be listed ({error.strerror})") from None
