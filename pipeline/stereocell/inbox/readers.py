"""A process that reads one item at a time, within limits of time and memory."""

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
    """Runs methods of `Reader` in a process. Any thread may call these methods."""

    def __init__(self) -> None:
        self._busy = threading.Lock()
        self._child: Child | None = None
        self._next: Child | None = None  # a process for the next item, with its imports done
        self._starting = threading.Lock()  # held while the next process starts
        self._item: Item | None = None
        self._stopped: Child | None = None  # a process that `stop` has ended
        self._is_closed = False
        self._used_s = 0.0  # s, time.monotonic() of the last call

    def run(self, item: Item, method: str, *arguments: Any, seconds: float = READ_S) -> Any:
        """Call a method of an item's reader; return its result.

        Raises the method's errors, ChildError if the process dies or exceeds a limit, and
        RefusedError if the item was deleted.
        """
        bounds = Bounds(seconds, int(MEMORY_SHARE * available_bytes()))
        with self._busy:
            if item.is_deleted:
                raise RefusedError(410, "the item was deleted")
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
        """Start a process for the next item during its upload, since imports take seconds."""
        threading.Thread(target=self._warm, daemon=True).start()

    def _warm(self) -> None:
        # If this fails, the next item tries again and reports the error.
        with self._starting, suppress(ChildError):
            if self._next is None and not self._is_closed:
                self._next = Child(Reader)
                self._used_s = time.monotonic()

    def _take_next(self) -> Child | None:
        with self._starting:
            child, self._next = self._next, None
        return child

    def stop(self, item: Item) -> None:
        """End the process if it reads this item; the caller of `run` gets ChildError."""
        child = self._child if self._item is item else None
        if child is not None:
            self._stopped = child
            child.close()

    def release(self, idle_s: float) -> None:
        """End the process if it has been idle for more than `idle_s` seconds."""
        if self._busy.acquire(blocking=False):
            try:
                if time.monotonic() - self._used_s > idle_s:
                    self._close()
                    self._close_next()
            finally:
                self._busy.release()

    def close(self) -> None:
        """End the process for good, even in the middle of a call."""
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
