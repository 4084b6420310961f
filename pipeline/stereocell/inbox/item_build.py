"""The build of an item for the page of its view, which watches the build and sends it commands.

The page may be open before the build exists. The build may wait in the queue, fail and begin again.
"""

from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from stereocell.inbox.item import Item
from stereocell.inbox.refused import RefusedError
from stereocell.isosurface.holder import Holder
from stereocell.live.build_state import Command, State
from stereocell.live.view_folders import find_view

if TYPE_CHECKING:
    from stereocell.inbox.inbox import Inbox


class ItemBuild:
    """A `WatchedBuild` that stays valid whatever happens to the item and its build."""

    def __init__(self, inbox: "Inbox", item: Item) -> None:
        self._inbox, self._item = inbox, item

    @property
    def out(self) -> Path:
        """The folder that the build writes."""
        return self._item.out

    @property
    def state(self) -> State:
        """The current state."""
        item = self._item
        with self._inbox.changed:
            if item.is_deleted:
                return State(doing="deleted")
            running = State() if item.build is None else item.build.state
            shown = replace(
                running,
                folder=running.folder or item.newest,
                place=self._inbox.place_of(item),
                line="",
                may_continue=bool(item.upload and item.title),
            )
            match item.doing:
                case "queued":
                    return replace(shown, doing="queued")
                case "cancelled":
                    return replace(shown, doing="cancelled", left_s=None)
                case "failed":
                    return replace(shown, doing="failed", line=item.line, left_s=None)
                case "built":
                    return replace(shown, doing="complete", share=1.0, has_bundle=True)
                case "building" | "paused":
                    # A build that has just ended keeps its old state until the queue has noticed.
                    has_ended = item.build is None or running.doing in ("failed", "cancelled")
                    return replace(shown, doing=item.doing) if has_ended else shown
                case _:
                    return replace(shown, doing="unbuilt")

    @property
    def bundle(self) -> Path | None:
        """The finished bundle; None until there is one."""
        return self._item.out / "bundle" if self.state.has_bundle else None

    @property
    def holders(self) -> Mapping[str, Holder]:
        """Table, pads and cables of a CT that the build's views leave out, by the channel's ID."""
        build = self._item.build
        return {} if build is None else build.holders

    def rest(self) -> None:
        """Let the build rest for a moment, since frames are late on this machine."""
        if (build := self._item.build) is not None:
            build.rest()

    def while_someone_waits(self) -> AbstractContextManager[None]:
        """Return a context in which the build rests, while bricks are made for a waiting client."""
        build = self._item.build
        return nullcontext() if build is None else build.while_someone_waits()

    def find_view(self, name: str) -> Path | None:
        """Return the folder of a view by its name; None if there is no such view."""
        return find_view(self._item.view_folder, name)

    def do(self, command: Command) -> None:
        """Carry out a user's command; ignore a command that does not fit the state."""
        with suppress(RefusedError):
            self._inbox.command(self._item, command)
