"""Unpack and read uploads, and write first views, all in the reader's process."""

import json
import shutil
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import Any

from stereocell.inbox.choices import Choices
from stereocell.inbox.inbox import Inbox
from stereocell.inbox.item import Item
from stereocell.inbox.item_build import ItemBuild
from stereocell.inbox.item_tiles import ItemTiles
from stereocell.inbox.limits import UNPACK_S
from stereocell.inbox.lines import line_of, without_identity
from stereocell.inbox.reader import FirstView, Source, ToBuild
from stereocell.inbox.refused import RefusedError
from stereocell.live.build_process import Coarse
from stereocell.live.reading import Reading
from stereocell.live.show_source import Live
from stereocell.live.view_folders import next_view
from stereocell.model.errors import StereoCellError
from stereocell.storage.json_files import write_json

_FOUND = "found.json"  # file in the upload's folder with the place that an address led to


def prepare(inbox: Inbox, item: Item) -> None:
    """Unpack and read an item; an error becomes the item's line."""
    with item.reading:
        if not item.is_deleted:
            inbox.prepared = item
            try:
                _prepare(inbox, item)
            finally:
                inbox.prepared = None


def _prepare(inbox: Inbox, item: Item) -> None:
    try:
        if item.doing == "unpacking":
            source = inbox.reader.run(item, "arrange", inbox.limits, seconds=UNPACK_S)
            with inbox.changed:
                if item.doing != "unpacking":  # the item was cancelled meanwhile
                    return
                item.source = source
                inbox.set(item, "understanding")
        round_, choices = item.round, item.choices
        shutil.rmtree(item.folder / "slices", ignore_errors=True)
        found = inbox.reader.run(
            item, "understand", source_of(item), choices, str(item.folder / "slices")
        )
        _write_facts(item, found)
    except Exception as error:  # a stranger's files may cause any error in a reader
        with inbox.changed:
            if item.doing in ("unpacking", "understanding"):
                inbox.set(item, "failed", line_of(item, error))
        return
    with inbox.changed:
        if item.round == round_ and item.doing == "understanding":
            item.title = found["title"]
            inbox.set(item, "understood")


def _write_facts(item: Item, found: dict[str, Any]) -> None:
    notes = [without_identity(item, note) for note in found["notes"]]
    write_json(item.understood_file, {**found, "notes": notes})


def source_of(item: Item) -> Source:
    """Return the source of an item, with the place that an earlier process found at its address."""
    source = item.place()
    try:
        content = json.loads((item.upload_folder / _FOUND).read_bytes())
    except (OSError, ValueError):
        return source
    return replace(source, found=content["source"], found_notes=tuple(content["notes"]))


def _titled(item: Item) -> Choices:
    """Return the choices of an item with its displayed title."""
    return replace(item.choices, title=item.title or item.choices.title)


def write_first_view(inbox: Inbox, item: Item, page: Path) -> tuple[Coarse, ToBuild]:
    """Write the first view of an item, unless the item has one with its current choices.

    page  the folder of the viewer

    Returns two inputs: one for the views of a build that follows, one for that build itself. The
    caller holds the item's lock `reading`. Raises the reader's errors.
    """
    item.view_folder.mkdir(parents=True, exist_ok=True)
    round_, bundle = item.round, None if item.page else next_view(item.view_folder)
    choices = _titled(item)
    view: FirstView = inbox.reader.run(
        item, "first_view", source_of(item), choices, None if bundle is None else str(bundle)
    )
    found = view.to_build.found
    if item.address:
        write_json(
            item.upload_folder / _FOUND,
            {"source": found.source, "notes": found.notes},
        )
    if bundle is not None:
        with inbox.changed:
            tiles = ItemTiles(inbox, item, source_of(item), choices)
            item.live = _live_of(page, bundle, tiles, ItemBuild(inbox, item))
            item.viewed_round, item.newest = round_, f"{bundle.name}/"
            inbox.changed.notify_all()
    coarse = Coarse(view.plan, view.read, item.out, item.view_folder, view.sizes)
    return coarse, view.to_build


def _live_of(page: Path, bundle: Path, tiles: ItemTiles, build: ItemBuild) -> Live:
    """Return a first view whose files are already written, in the form that LiveApp serves."""
    first: Future[None] = Future()
    first.set_result(None)
    return Live(page, bundle, first, tiles, build, Reading(lambda _: None))


def view_item(inbox: Inbox, item: Item, page: Path) -> str:
    """Write the first view of an item, unless there is one; return the address of its page.

    page  the folder of the viewer

    Raises RefusedError if the item can't be viewed.
    """
    if item.page:
        return item.page
    if item.doing in ("uploading", "unpacking", "understanding") or not item.title:
        raise RefusedError(409, f"the item can't be viewed: its state is {item.doing}")
    if item.upload is None:
        raise RefusedError(409, "the upload was deleted: upload the files again")
    with item.reading:
        if item.page:  # another request has written the view meanwhile
            return item.page
        if item.is_deleted:
            raise RefusedError(410, "the item was deleted")
        try:
            write_first_view(inbox, item, page)
        except StereoCellError as error:
            raise RefusedError(422, line_of(item, error)) from None
    return item.page
