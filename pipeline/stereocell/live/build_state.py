"""The state of a build behind a page, and the commands that the page sends."""

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
    "unbuilt",  # nobody has asked for a build
    "queued",  # other builds go first
    "building",
    "pausing",
    "paused",
    "cancelled",
    "failed",
    "complete",
    "deleted",  # with its source
]


@dataclass(frozen=True, slots=True)
class State:
    """The state of a build, which the server sends to the page.

    label, done, total  its running tasks
    tiles, all_tiles    how many tiles have their surfaces, and how many there are
    share               how much of the build is done, 0..1
    left_s              s until its end; None: not known yet
    place               in the queue of builds, from 1; 0: it does not wait there
    folder              of the newest view, as `g2/`; empty: the first view is the newest
    has_bundle          whether OUT/bundle is whole, which then is the newest view
    line                why it has failed; or empty
    may_continue        whether a build that was cancelled or has failed can begin again
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
    """A build as a page watches it. All methods may be called from any thread."""

    @property
    def out(self) -> Path:
        """The folder that it writes."""

    @property
    def state(self) -> State:
        """The newest state."""

    @property
    def bundle(self) -> Path | None:
        """The finished bundle; None: there is none yet."""

    def rest(self) -> None:
        """Let the build rest for a moment: frames are late on this machine."""

    def while_someone_waits(self) -> AbstractContextManager[None]:
        """Let the build rest while bricks are made that someone waits for."""

    @property
    def holders(self) -> Mapping[str, Holder]:
        """The air that the later views leave out, by the channel's ID; see `PartialView`."""

    def find_view(self, name: str) -> Path | None:
        """Return the folder of a later view by its name, as `g2`; None: there is no such view."""

    def do(self, command: Command) -> None:
        """Carry out what a user asks for; a command that does not fit the state does nothing."""
