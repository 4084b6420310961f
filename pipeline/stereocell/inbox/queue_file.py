"""The file that lets the items of an inbox survive a restart."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from stereocell.inbox.item import ID, Item
from stereocell.model.errors import OutputError
from stereocell.storage.claim import LOCK
from stereocell.storage.json_files import read_sealed, write_sealed

NAME = "inbox.json"
_SCHEMA = "inbox.schema.json"
_FORMAT, _VERSION = "stereocell-inbox", 1


def save_items(folder: Path, items: Sequence[Item]) -> None:
    """Write the items, whole or not at all. Raises OutputError."""
    records = [item.to_record() for item in items]
    write_sealed(folder / NAME, {"format": _FORMAT, "version": _VERSION, "items": records})


def load_items(folder: Path) -> list[Item]:
    """Return the items of a folder, and remove what belongs to none of them.

    Raises OutputError where the folder holds something else than an inbox.
    """
    if not (folder / NAME).exists():
        others = [one.name for one in folder.iterdir() if one.name != LOCK]
        if others:
            raise OutputError(
                f"--inbox {folder}: found {len(others)} files or folders that are not of an inbox, "
                "expected an empty folder, or an inbox"
            )
        return []
    remedy = "take another folder, or remove this file: uploads and builds in it are then lost"
    content = read_sealed(folder / NAME, _SCHEMA, remedy)
    items = [Item.from_record(record, folder) for record in content["items"]]
    known = {item.id for item in items}
    for one in folder.iterdir():  # a server that was killed leaves them
        if ID.fullmatch(one.name) and one.name not in known:
            shutil.rmtree(one, ignore_errors=True)
    return items
