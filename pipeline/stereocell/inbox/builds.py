"""Build the items of the queue, one at a time, each in a process of its own."""

import shutil
from pathlib import Path
from typing import Protocol

from stereocell.inbox.choices import Choices
from stereocell.inbox.inbox import Inbox
from stereocell.inbox.item import Doing, Item
from stereocell.inbox.lines import line_of, without_identity
from stereocell.inbox.preparing import write_first_view
from stereocell.inbox.refused import RefusedError
from stereocell.live.build_process import Build, BuildProcess
from stereocell.read.addresses.resolved import Resolved


class MakeBuild(Protocol):
    """Returns the build of a source into the folder `out`, with a person's choices.

    The build can be pickled and prints nothing. If `is_stranger`, it uses no credentials of this
    machine.
    """

    def __call__(
        self, source: str, found: Resolved, choices: Choices, out: Path, *, is_stranger: bool
    ) -> Build: ...


class Builds:
    """The builds of an inbox. Only one thread calls `step`."""

    def __init__(self, inbox: Inbox, page: Path, make: MakeBuild) -> None:
        self._inbox, self._page, self._make = inbox, page, make
        self._running: tuple[Item, BuildProcess] | None = None

    def step(self) -> None:
        """Update the item of the running build, or start the next build."""
        if self._running is not None:
            self._update(*self._running)
        if self._running is None:
            waiting = [one for one in self._inbox.waiting() if one.doing == "queued"]
            if waiting:
                self._start(waiting[0])

    def close(self) -> None:
        """Stop the running build; the next start of the server continues it."""
        if self._running is not None:
            self._running[1].close()

    def _start(self, item: Item) -> None:
        inbox = self._inbox
        try:
            inbox.set(item, "building")
            _require_room(inbox, item)
            with item.reading:
                if item.is_deleted:
                    return
                coarse, inputs = write_first_view(inbox, item, self._page)
            build = BuildProcess(
                self._make(
                    inputs.source,
                    inputs.found,
                    inputs.choices,
                    item.out,
                    is_stranger=not item.is_local,
                ),
                item.out,
            )
            with inbox.changed:
                if item.doing not in ("building", "paused") or not inbox.is_here(item):
                    return  # the item was cancelled or deleted meanwhile
                if item.doing == "paused":
                    build.do("pause")
                item.build = build
                self._running = item, build
            build.start(coarse)
        except Exception as error:  # a stranger's files may cause any error in a reader
            with inbox.changed:
                if item.doing in ("building", "paused"):
                    item.queued = 0
                    inbox.set(item, "failed", line_of(item, error))

    def _update(self, item: Item, build: BuildProcess) -> None:
        inbox, state = self._inbox, build.state
        is_current = inbox.is_here(item) and item.build is build
        # The item was cancelled, deleted or queued again.
        if not is_current or item.doing not in ("building", "paused"):
            self._end(build)
        elif state.doing == "complete":
            self._end(build)
            item.queued = 0
            inbox.set(item, "built")
            if not item.keep_upload:
                inbox.remove_upload(item)
        elif state.doing == "failed":
            self._end(build)
            item.queued = 0
            inbox.set(item, "failed", without_identity(item, state.line))
        elif (doing := _doing_of(state.doing)) != item.doing:
            inbox.set(item, doing)

    def _end(self, build: BuildProcess) -> None:
        build.close()
        self._running = None


def _doing_of(doing: str) -> Doing:
    return "paused" if doing in ("pausing", "paused") else "building"


def _require_room(inbox: Inbox, item: Item) -> None:
    """Raise RefusedError if the disk has no room for a build."""
    needed = inbox.understood(item)["bytes_estimate"]
    free = shutil.disk_usage(inbox.folder).free - inbox.limits.reserve
    if needed > free:
        raise RefusedError(
            507,
            f"the server's disk has {max(0, free):,} bytes free, expected about {needed:,} for "
            "this build: delete some items, then build it again",
        )
