"""The state of a build whose page is open, and the commands that the page sends."""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from stereocell.isosurface.holder import Holder

Command = Literal["pause", "continue", "cancel"]
LATE = "late"  # the frames of a page are late, and the build rests for a moment
COMMANDS: tuple[Command, ...] = ("pause", "continue", "cancel")
Doing = Literal[
    "unbuilt",  # no build was requested
    "queued",  # the build waits for other builds of an inbox
    "building",
    "pausing",
    "paused",
    "cancelled",
    "failed",
    "complete",
    "deleted",  # the build was deleted together with its source
]


@dataclass(frozen=True, slots=True)
class State:
    """The state of a build, which the server sends to the page.

    label, done, total  running phase, its finished tasks and all its tasks
    tiles, all_tiles    number of tiles with finished surfaces, and of all tiles
    share               share of the build that is done, 0..1
    left_s              s until the end; None if not yet known
    place               place in the queue of builds, from 1; 0 outside the queue
    folder              folder of the newest view, such as `g2/`; empty for the first view
    has_bundle          whether OUT/bundle is complete, and hence the newest view
    line                reason of a failure, or empty
    may_continue        whether a build that was cancelled or failed can begin again
    """

    doing: Doing = "building"
    label: str = ""
    done: int = 0
    total: int = 0
    tiles: int = 0
    all_tiles: int = 0
    share: float = 0.0
    left_s: float | None = None
    place: int = 0
    folder: str = ""
    has_bundle: bool = False
    line: str = ""
    may_continue: bool = True


class WatchedBuild(Protocol):
    """A build that a page watches. Any thread may call these methods."""

    @property
    def out(self) -> Path:
        """The folder that the build writes."""

    @property
    def state(self) -> State:
        """The current state."""

    @property
    def bundle(self) -> Path | None:
        """The finished bundle; None until there is one."""

    def rest(self) -> None:
        """Let the build rest for a moment, since frames are late on this machine."""

    def while_someone_waits(self) -> AbstractContextManager[None]:
        """Return a context in which the build rests, while bricks are made for a waiting client."""

    @property
    def holders(self) -> Mapping[str, Holder]:
        """Table, pads and cables of a CT that later views leave out, by the channel's ID."""

    def find_view(self, name: str) -> Path | None:
        """Return the folder of a later view by its name, such as `g2`; None if there is none."""

    def do(self, command: Command) -> None:
        """Carry out a user's command; ignore a command that does not fit the state."""
