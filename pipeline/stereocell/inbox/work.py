"""The threads of an inbox: one reads uploads, one builds."""

import threading
import time
from contextlib import suppress
from pathlib import Path

from stereocell.inbox.builds import Builds, MakeBuild
from stereocell.inbox.inbox import PREPARED, Inbox
from stereocell.inbox.preparing import prepare
from stereocell.model.errors import OutputError

_LOOK_S = 0.25  # s between two checks of the running build
_OLD_S = 60.0  # s between two searches for uploads that were interrupted too long ago
_IDLE_S = 120.0  # s after which an idle reader ends


class Work:
    """The two threads. They run from start() to close()."""

    def __init__(self, inbox: Inbox, page: Path, make: MakeBuild) -> None:
        """page: the folder of the viewer; make: returns the build of a source."""
        self._inbox = inbox
        self._builds = Builds(inbox, page, make)
        self._is_over = threading.Event()
        self._threads = [
            threading.Thread(target=run, name=name, daemon=True)
            for name, run in {"inbox-prepare": self._prepare, "inbox-build": self._build}.items()
        ]

    def start(self) -> None:
        """Start the threads."""
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Stop the threads and wait for them. Unfinished work continues at the next start."""
        self._is_over.set()
        with self._inbox.changed:
            self._inbox.changed.notify_all()
        self._inbox.close()
        for thread in self._threads:
            thread.join()
        self._builds.close()

    def _prepare(self) -> None:
        inbox = self._inbox
        while not self._is_over.is_set():
            with inbox.changed:
                items = [item for item in inbox.items() if item.doing in PREPARED]
                if not items:
                    inbox.changed.wait(_IDLE_S / 4)
            if items and not self._is_over.is_set():
                if len(items) > 1:
                    inbox.reader.warm()
                # If the queue file can't be written now, the next change writes it.
                with suppress(OutputError):
                    prepare(inbox, items[0])
            for reader in (inbox.reader, inbox.tile_reader):
                reader.release(_IDLE_S)

    def _build(self) -> None:
        next_s = 0.0
        while not self._is_over.wait(_LOOK_S):
            with suppress(OutputError):  # the next change writes the queue file
                self._builds.step()
            if time.monotonic() > next_s:
                with suppress(OutputError):
                    self._inbox.remove_old()
                next_s = time.monotonic() + _OLD_S
