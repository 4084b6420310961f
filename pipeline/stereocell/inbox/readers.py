"""The process that reads: one at a time, of one item at a time, with bounds of time and memory."""

import threading
from typing import Any

from stereocell.inbox.item import Item
from stereocell.inbox.limits import MEMORY_SHARE, READ_S
from stereocell.inbox.reader import Reader
from stereocell.storage.child_process import Bounds, Child
from stereocell.storage.processes import available_bytes


class ReaderProcess:
    """Runs methods of `Reader`. All methods may be called from any thread."""

    def __init__(self) -> None:
        self._busy = threading.Lock()
        self._child: Child | None = None
        self._item: Item | None = None

    def run(self, item: Item, method: str, *arguments: Any, seconds: float = READ_S) -> Any:
        """Return what a method of the reader of an item returns.

        Raises as it does, and ChildError where its process dies or exceeds its bounds.
        """
        with self._busy:
            if self._item is not item or self._child is None:
                self._close()
                bounds = Bounds(seconds, int(MEMORY_SHARE * available_bytes()))
                folder = str(item.upload_folder)
                is_stranger = not item.is_local
                self._child = Child(Reader, folder, is_stranger, bounds=bounds)
                self._item = item
            memory = int(MEMORY_SHARE * available_bytes())
            try:
                return self._child.call(method, *arguments, bounds=Bounds(seconds, memory))
            except BaseException:
                self._close()
                raise

    def stop(self, item: Item) -> None:
        """End what runs for an item: its caller gets ChildError."""
        child = self._child if self._item is item else None
        if child is not None:
            child.close()

    def release(self) -> None:
        """End the process where it is idle."""
        if self._busy.acquire(blocking=False):
            try:
                self._close()
            finally:
                self._busy.release()

    def close(self) -> None:
        """End the process, whatever it does."""
        child = self._child
        if child is not None:
            child.close()

    def _close(self) -> None:
        if self._child is not None:
            self._child.close()
        self._child = self._item = None
