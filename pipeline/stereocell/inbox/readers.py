"""A process that reads: one item at a time, with bounds of time and memory."""

import threading
import time
from contextlib import suppress
from typing import Any

from stereocell.inbox.item import Item
from stereocell.inbox.limits import MEMORY_SHARE, READ_S
from stereocell.inbox.reader import Reader
from stereocell.inbox.refused import RefusedError
from stereocell.storage.child_process import Bounds, Child, ChildError
from stereocell.storage.processes import available_bytes


class ReaderProcess:
    """Runs methods of `Reader`. All methods may be called from any thread."""

    def __init__(self) -> None:
        self._busy = threading.Lock()
        self._child: Child | None = None
        self._next: Child | None = None  # a process for the next item, which has done its imports
        self._starting = threading.Lock()  # held while it starts
        self._item: Item | None = None
        self._stopped: Child | None = None  # the process that was ended while it may have been idle
        self._is_closed = False
        self._used_s = 0.0  # when it was last asked, by time.monotonic()

    def run(self, item: Item, method: str, *arguments: Any, seconds: float = READ_S) -> Any:
        """Return what a method of the reader of an item returns.

        Raises as it does, ChildError where its process dies or exceeds its bounds, and RefusedError
        where the item has been deleted.
        """
        bounds = Bounds(seconds, int(MEMORY_SHARE * available_bytes()))
        with self._busy:
            if item.is_deleted:
                raise RefusedError(410, "it has been deleted")
            if self._child is self._stopped:
                self._close()
            if self._item is not item:
                if self._item is not None:
                    self._close()
                child = self._child = self._take_next() or Child(Reader)
                self._item = item
                child.call("begin", str(item.upload_folder), not item.is_local)
            assert self._child is not None
            try:
                return self._child.call(method, *arguments, bounds=bounds)
            except BaseException:
                self._close()
                raise
            finally:
                self._used_s = time.monotonic()

    def warm(self) -> None:
        """Start a process for the next item, while its upload comes: imports take seconds."""
        threading.Thread(target=self._warm, daemon=True).start()

    def _warm(self) -> None:
        with self._starting, suppress(ChildError):  # the next item starts one, and has its error
            if self._next is None and not self._is_closed:
                self._next = Child(Reader)
                self._used_s = time.monotonic()

    def _take_next(self) -> Child | None:
        with self._starting:
            child, self._next = self._next, None
        return child

    def stop(self, item: Item) -> None:
        """End what runs for an item: its caller gets ChildError."""
        child = self._child if self._item is item else None
        if child is not None:
            self._stopped = child
            child.close()

    def release(self, idle_s: float) -> None:
        """End the process where nothing has been asked of it for so many seconds."""
        if self._busy.acquire(blocking=False):
            try:
                if time.monotonic() - self._used_s > idle_s:
                    self._close()
                    self._close_next()
            finally:
                self._busy.release()

    def close(self) -> None:
        """End the process for good, whatever it does."""
        self._is_closed = True
        child = self._child
        if child is not None:
            child.close()
        self._close_next()

    def _close_next(self) -> None:
        if (child := self._take_next()) is not None:
            child.close()

    def _close(self) -> None:
        if self._child is not None:
            self._child.close()
        self._child = self._item = None
