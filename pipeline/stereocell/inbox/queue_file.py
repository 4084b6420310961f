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
    """Write the items in one step, so that a crash leaves the old file. Raises OutputError."""
    records = [item.to_record() for item in items]
    write_sealed(folder / NAME, {"format": _FORMAT, "version": _VERSION, "items": records})


def load_items(folder: Path) -> list[Item]:
    """Return the items of a folder; remove the folders of items that are not listed.

    Raises OutputError if the folder holds files of anything but an inbox.
    """
    if not (folder / NAME).exists():
        others = [one.name for one in folder.iterdir() if one.name != LOCK]
        if others:
            raise OutputError(
                f"--inbox {folder}: found {len(others)} other files or folders, expected an empty "
                "folder or an inbox"
            )
        return []
    remedy = "choose another folder, or remove this file and lose the inbox's uploads and builds"
    content = read_sealed(folder / NAME, _SCHEMA, remedy)
    items = [Item.from_record(record, folder) for record in content["items"]]
    known = {item.id for item in items}
    for one in folder.iterdir():  # a server that was killed may leave folders of deleted items
        if ID.fullmatch(one.name) and one.name not in known:
            shutil.rmtree(one, ignore_errors=True)
    return items
