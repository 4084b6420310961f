"""The inbox: the items that people upload, from the first byte to the finished build.

Requests run in many threads. They change items under one lock, and write the queue file before they
answer. Two more threads start reading and building; the work itself runs in other processes (see
`preparing` and `builds`).
"""

import json
import shutil
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from stereocell.inbox.address import check_address
from stereocell.inbox.choices import parse_choices
from stereocell.inbox.item import Doing, Item, new_id
from stereocell.inbox.limits import InboxLimits
from stereocell.inbox.queue_file import load_items, save_items
from stereocell.inbox.readers import ReaderProcess
from stereocell.inbox.refused import RefusedError
from stereocell.inbox.upload import Announced, Upload, parse_announced
from stereocell.live.build_state import COMMANDS

_BUSY: tuple[Doing, ...] = ("unpacking", "understanding")
_WAITING: tuple[Doing, ...] = ("queued", "building", "paused")
_ASKS_SPACING = "--spacing-um"  # the line of a failure contains this if the voxel size is missing
PREPARED: tuple[Doing, ...] = ("unpacking", "understanding")  # the reader works on one such item
_FREE_STEP = 100_000_000  # bytes; free disk space is rounded, so that the state changes rarely


class Inbox:
    """The items of a folder. All methods may be called from any thread."""

    def __init__(self, folder: Path, limits: InboxLimits) -> None:
        """Load the items of a folder. Raises OutputError if it holds files of anything else."""
        self.folder, self.limits = folder, limits
        self.reader = ReaderProcess()  # reads uploads and makes first views
        self.tile_reader = ReaderProcess()  # reads tiles in view, which must not wait for uploads
        self.prepared: Item | None = None  # the item that is being unpacked or read now
        self._is_closed = False
        self.changed = threading.Condition(threading.RLock())
        self._items = {item.id: item for item in load_items(folder)}
        for item in self._items.values():
            self._resume(item)
        with self.changed:
            self.save()

    def _resume(self, item: Item) -> None:
        """Set the state from which an item continues after a restart of the server."""
        shutil.rmtree(item.view_folder, ignore_errors=True)
        if item.doing == "built" and not (item.out / "bundle" / "manifest.json").exists():
            self._fail(item, "the build is missing: upload the files again")
        elif item.doing == "built" and not item.keep_upload:
            self.remove_upload(item)  # the server ended before it could remove the upload
        elif item.doing in ("building", "paused"):
            item.doing = "queued"  # the item keeps its place, the first one
        if item.doing in ("uploading", *_BUSY, "understood", "queued") and item.upload is None:
            self._fail(item, "the upload was deleted: upload the files again")

    # --- items, by their state

    def find(self, item_id: str) -> Item:
        """Return an item. Raises RefusedError if there is none."""
        with self.changed:
            item = self._items.get(item_id)
        if item is None:
            raise RefusedError(404, "there is no such item: it was deleted, or it expired")
        return item

    def items(self) -> list[Item]:
        """Return all items, in the order of their uploads."""
        with self.changed:
            return list(self._items.values())

    def is_here(self, item: Item) -> bool:
        """Return whether an item still exists, hence was not deleted meanwhile."""
        return self._items.get(item.id) is item

    def set(self, item: Item, doing: Doing, line: str = "") -> None:
        """Change the state of an item and save it. Does nothing if the item was deleted."""
        with self.changed:
            if self.is_here(item):
                item.doing, item.line = doing, line
                self.save()
                self.changed.notify_all()

    def save(self) -> None:
        """Write the queue file; the lock must be held. Raises OutputError."""
        if self._is_closed:  # work that fails because the server ends must not count as failed
            return
        save_items(self.folder, list(self._items.values()))

    def _fail(self, item: Item, line: str) -> None:
        item.doing, item.line, item.queued = "failed", line, 0

    def waiting(self) -> list[Item]:
        """Return the items whose builds run or wait, in the order of the queue."""
        with self.changed:
            found = [item for item in self._items.values() if item.doing in _WAITING]
        return sorted(found, key=lambda item: item.queued)

    def place_of(self, item: Item) -> int:
        """Return the place of an item in the queue, from 1; 0 if its build neither runs nor waits.

        The running build has a place, too.
        """
        waiting = self.waiting()
        return 1 + waiting.index(item) if item in waiting else 0

    # --- uploads

    def announce(self, content: Any, *, is_local: bool) -> tuple[Item, bool]:
        """Register an announced upload; return its item, and whether the item is new.

        If an upload of the same list was interrupted, it continues: the item is not new. Raises
        RefusedError.
        """
        announced = parse_announced(content, self.limits)
        if announced.address:
            address = check_address(announced.address, is_local=is_local)
            announced = Announced(address=address)
        with self.changed:
            for item in self._items.values():
                is_same = item.upload and item.upload.announced.digest == announced.digest
                if item.doing == "uploading" and is_same:
                    return item, False
            if len(self._items) >= self.limits.items:
                raise RefusedError(
                    429,
                    f"the inbox is full with {len(self._items)} items, expected fewer: delete some",
                )
            self._require_room(announced.total)
            item_id = new_id()
            item = Item(item_id, self.folder / item_id, time.time(), is_local)
            item.upload = Upload.create(item.upload_folder, announced)
            if announced.address:
                item.doing = "understanding"
            self._items[item.id] = item
            self.save()
            self.changed.notify_all()
        self.reader.warm()
        return item, True

    def _require_room(self, total: int) -> None:
        """Raise RefusedError if the disk has no room for an upload beside those that have begun."""
        begun = sum(
            item.upload.announced.total - item.upload.offset
            for item in self._items.values()
            if item.doing == "uploading" and item.upload is not None
        )
        free = shutil.disk_usage(self.folder).free - self.limits.reserve - begun
        if total > free:
            raise RefusedError(
                507,
                f"the server's disk has {max(0, free):,} bytes free, expected {total:,} for this "
                "upload: delete some items",
            )

    @contextmanager
    def piece(self, item: Item, offset: int) -> Iterator[Callable[[bytes], None]]:
        """Yield a function that writes the bytes of one piece, as they arrive.

        Bytes that were written stay, however the piece ends. A later piece takes over from an
        earlier one whose connection is lost. Raises RefusedError.
        """
        if item.doing != "uploading" or item.upload is None:
            raise RefusedError(409, "the item expects no more bytes")
        upload, writer = item.upload, object()
        with item.writing:
            if offset != upload.offset:
                raise RefusedError(409, f"Upload-Offset: found {offset}, expected {upload.offset}")
            item.writer = writer

        def write(data: bytes) -> None:
            with item.writing:
                if not self.is_here(item):
                    raise RefusedError(410, "the item was deleted")
                if item.writer is not writer:
                    raise RefusedError(409, "the upload continues over another connection")
                if len(data) > upload.announced.total - upload.offset:
                    raise RefusedError(413, "found more bytes than were announced")
                upload.write(data)

        try:
            yield write
        finally:
            self._end_piece(item)

    def _end_piece(self, item: Item) -> None:
        upload = item.upload
        with self.changed:
            is_whole = upload is not None and upload.is_whole
            if upload is not None and is_whole and item.doing == "uploading":
                upload.finish()
                self.set(item, "unpacking")

    def remove_old(self) -> None:
        """Delete uploads that were interrupted longer ago than the limit."""
        for item in self.items():
            upload = item.upload
            if item.doing == "uploading" and upload and upload.age_h > self.limits.hours:
                self.delete(item)

    def delete(self, item: Item) -> None:
        """Delete an item with its files; stop its reader and its build, and wait for their end."""
        with self.changed:
            if self._items.pop(item.id, None) is None:
                return
            item.is_deleted = True
            self.save()
            self.changed.notify_all()
        for reader in (self.reader, self.tile_reader):
            reader.stop(item)
        if item.build is not None:
            item.build.close()
        # These locks become free soon: a piece stops at its next bytes, and the readers have ended.
        with item.writing, item.reading:
            for _ in range(20):  # a process that is ending may still write a file
                shutil.rmtree(item.folder, ignore_errors=True)
                if not item.folder.exists():
                    return
                time.sleep(0.1)

    def close(self) -> None:
        """Stop the readers. Later changes of items are not saved."""
        with self.changed:
            self._is_closed = True
        self.reader.close()
        self.tile_reader.close()

    def remove_upload(self, item: Item) -> None:
        """Remove an item's upload, the only place that may hold a person's identity.

        A closed inbox keeps the upload: its queue file may still say that a build needs it.
        """
        with self.changed:
            if self._is_closed:
                return
            item.upload = None
        shutil.rmtree(item.upload_folder, ignore_errors=True)

    # --- requests of people

    def understood(self, item: Item) -> dict[str, Any]:
        """Return the facts that the reader found in an item. Raises RefusedError."""
        try:
            found: dict[str, Any] = json.loads(item.understood_file.read_bytes())
        except (OSError, ValueError):
            raise RefusedError(404, "the item has not been read yet") from None
        return found

    def choose(self, item: Item, content: Any) -> None:
        """Change the choices of an item, and have it read again. Raises RefusedError."""
        with self.changed:
            self._require(item, ("understood", "failed", "cancelled", "understanding"), "changed")
            if item.upload is None or (not item.source and not item.address):
                raise RefusedError(409, "the upload is missing or damaged: upload the files again")
            item.choices = parse_choices(content, item.choices)
            item.round += 1
            self.set(item, "understanding")

    def build(self, item: Item, content: Any) -> None:
        """Put an item into the queue. Raises RefusedError."""
        keep = content.get("keep_upload", False) if isinstance(content, dict) else None
        if not isinstance(keep, bool) or not content.keys() <= {"keep_upload"}:
            raise RefusedError(400, 'build: expected {"keep_upload": true or false}, or {}')
        with self.changed:
            self._require(item, ("understood", "failed", "cancelled"), "built")
            if item.upload is None or not item.title:
                raise RefusedError(409, "the item can't be built, since it could not be read")
            item.keep_upload = keep
            self._enqueue(item)

    def command(self, item: Item, command: str) -> None:
        """Pause, continue or cancel the work on an item. Raises RefusedError."""
        with self.changed:
            build = item.build
            if command == "pause":
                self._require(item, ("building",), "paused")
                self.set(item, "paused")
            elif command == "continue" and item.doing in ("cancelled", "failed") and item.title:
                self._enqueue(item)
                return
            elif command == "continue":
                self._require(item, ("paused",), "continued")
                self.set(item, "building")
            else:
                self._require(item, (*_BUSY, *_WAITING), "cancelled")
                item.queued = 0
                self.set(item, "cancelled")
        if command == "cancel":
            self.reader.stop(item)
        if build is not None:
            build.do(next(one for one in COMMANDS if one == command))

    def _enqueue(self, item: Item) -> None:
        if item.upload is None:
            raise RefusedError(409, "the upload was deleted: upload the files again")
        if item.build is not None:
            item.newest = item.build.state.folder or item.newest
            item.build = None
        item.queued = 1 + max((one.queued for one in self._items.values()), default=0)
        self.set(item, "queued")

    def _require(self, item: Item, doings: Iterable[Doing], verb: str) -> None:
        if not self.is_here(item) or item.doing not in doings:
            raise RefusedError(409, f"the item can't be {verb}: its state is {item.doing}")

    # --- the state that pages show

    def state(self, *, may_upload: bool) -> dict[str, Any]:
        """Return the state of all items that a person may see, as the websocket sends it."""
        places = {item.id: place for place, item in enumerate(self.waiting(), start=1)}
        shown = [item for item in self.items() if may_upload or item.page]
        limits = self.limits
        with suppress(OSError):
            free = max(0, shutil.disk_usage(self.folder).free - limits.reserve)
        return {
            "items": [
                {
                    **_shown(item, places.get(item.id, 0), may_upload),
                    "waits": item.doing in PREPARED and item is not self.prepared,
                }
                for item in shown
            ],
            "limits": {
                "bytes": limits.bytes,
                "files": limits.files,
                "piece": limits.piece,
                "free_bytes": free // _FREE_STEP * _FREE_STEP,
                "hours": limits.hours,
            },
            "may_upload": may_upload,
        }


def _shown(item: Item, place: int, may_upload: bool) -> dict[str, Any]:
    upload, build = item.upload, item.build
    state = build.state if build is not None and item.doing in ("building", "paused") else None
    return {
        "id": item.id,
        "title": item.title or item.choices.title,
        "doing": item.doing,
        "line": item.line if may_upload else "",
        "asks": "spacing_um" if item.doing == "failed" and _ASKS_SPACING in item.line else "",
        "bytes": upload.offset if upload else 0,
        "total": upload.announced.total if upload else 0,
        "place": place,
        "share": 1.0 if item.doing == "built" else round(state.share, 3) if state else 0.0,
        "label": state.label if state else "",
        "tiles": state.tiles if state else 0,
        "all_tiles": state.all_tiles if state else 0,
        "left_s": None if state is None or state.left_s is None else round(state.left_s),
        "page": item.page,
        "has_upload": upload is not None,
        "keep_upload": item.keep_upload,
    }
