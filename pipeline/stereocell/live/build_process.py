"""Build a source in a process of its own, of lower priority, behind the page that shows it.

The two processes talk over a pipe: the build reports its tasks and the views that it writes; it is
asked to pause, to continue and to end. A pause begins when the running tasks have ended. Between
pauses the build rests for moments, while someone waits for a picture; see `rests`.
"""

import errno
import multiprocessing
import os
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stereocell.engine.interrupts import children_ignore_interrupts
from stereocell.engine.run import Watch, console
from stereocell.engine.worker_process import end_with_parent
from stereocell.isosurface.holder import Holder
from stereocell.live.build_state import Command, State
from stereocell.live.coarse_channel import CoarseChannel
from stereocell.live.coarse_tiles import Sizes
from stereocell.live.rests import Rests, lead_group
from stereocell.model.counted import counted
from stereocell.model.errors import StereoCellError
from stereocell.planning.plan import Plan

if TYPE_CHECKING:
    from stereocell.live.partial_view import PartialView

# builds, and is watched; returns the line of an error, empty where there is none
Build = Callable[[Watch], str]

# Share of each part of a build in its time: of one tile of 194 x 512 x 512 voxels, three channels
SHARES = {
    "windows": 0.08,
    "evidence": 0.13,
    "components": 0.08,
    "units": 0.3,
    "stage": 0.2,
    "bundle": 0.08,
    "report": 0.13,
}
_TELLING = 0.15  # share of a build from which its pace tells when it ends: it starts slowly
_NICE = 10  # of 19, the lowest priority
_END_S = 15  # s that a cancelled build has to remove what is half written
_KILLED = "the build was stopped from outside"


@dataclass(frozen=True, slots=True)
class _Task:
    label: str
    done: int
    total: int
    tiles: int


@dataclass(frozen=True, slots=True)
class _View:
    folder: Path
    holders: Mapping[str, Holder]


@dataclass(frozen=True, slots=True)
class _End:
    line: str


@dataclass(frozen=True, slots=True)
class Coarse:
    """The inputs of the views of a build; see `partial_view.PartialView`."""

    plan: Plan
    read: Mapping[str, CoarseChannel]
    out: Path
    scratch: Path
    sizes: Sizes


class BuildProcess:
    """A build behind a page. All methods may be called from any thread."""

    def __init__(self, build: Build, out: Path, explain: Callable[[str], str] = str) -> None:
        """Describe a build, which is not started.

        build    picklable
        out      the folder that it writes
        explain  returns the line to be shown for an error's line
        """
        self._build, self.out, self._explain = build, out, explain
        self._coarse: Coarse | None = None
        self._is_closed = False
        self._asked = threading.Lock()  # one start or command at a time
        self._changed = threading.Lock()
        self._state = State()
        self._views: dict[str, Path] = {}
        self.holders: Mapping[str, Holder] = {}  # what the views leave out; see `PartialView`
        self._process: Any = None
        self._rests: Rests | None = None
        self._pipe: Connection[Any, Any] | None = None
        self._began_s = self._paused_s = 0.0

    @property
    def state(self) -> State:
        """The newest state."""
        return self._state

    def find_view(self, name: str) -> Path | None:
        """Return the folder of a later view by its name; None: there is no such view."""
        return self._views.get(name)

    @property
    def bundle(self) -> Path | None:
        """The finished bundle; None: there is none yet."""
        return self.out / "bundle" if self.state.has_bundle else None

    def start(self, coarse: Coarse | None = None) -> None:
        """Begin to build, or go on with a build that has ended early.

        coarse  what the first view is made of; None: as at the first start

        A build that a user has paused or cancelled before its start begins so.
        """
        with self._asked:
            self._start(coarse)

    def _start(self, coarse: Coarse | None) -> None:
        is_first, self._coarse = self._coarse is None, coarse or self._coarse
        doing = self.state.doing if is_first else "building"
        if self._coarse is None or doing == "cancelled" or self._is_closed:
            return
        self._pipe = None  # nobody hears the process before
        self._set(doing=doing, line="", left_s=None, all_tiles=len(self._coarse.plan.tiles))
        if self._process is not None:
            self._process.join(_END_S)  # it has ended, or is about to
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=_run, args=(theirs,))
        with children_ignore_interrupts():  # Ctrl+C is the server's, which ends the build
            process.start()
        assert process.pid is not None  # it has been started
        theirs.close()
        with suppress(OSError):  # it has ended already, and its end is heard
            ours.send((self._build, self._coarse))
        self._process, self._pipe, self._rests = process, ours, Rests(process.pid)
        self._began_s, self._paused_s = time.monotonic(), 0.0
        if doing == "pausing":
            self._send("pause")
        threading.Thread(target=self._hear, args=(ours,), daemon=True).start()

    def do(self, command: Command) -> None:
        """Carry out what a user asks for; a command that does not fit the state does nothing."""
        with self._asked:
            self._do(command)

    def _do(self, command: Command) -> None:
        doing = self.state.doing
        if command == "pause" and doing == "building":
            self._send("pause")
            self._set(doing="pausing", left_s=None)
        elif command == "continue" and doing in ("pausing", "paused"):
            self._send("continue")
            self._set(doing="building")
        elif command == "continue" and doing in ("cancelled", "failed"):
            self._start(None)
        elif command == "cancel" and doing in ("building", "pausing", "paused"):
            self._set(doing="cancelled", left_s=None)
            self._stop()

    def rest(self) -> None:
        """Let the build rest for a moment: frames are late on this machine."""
        if self._rests is not None:
            self._rests.ask()

    def while_someone_waits(self) -> AbstractContextManager[None]:
        """Let the build rest while bricks are made that someone waits for."""
        return nullcontext() if self._rests is None else self._rests.while_someone_waits()

    def close(self) -> None:
        """End the process for good, and wait for it; what is finished stays."""
        with self._asked:
            self._is_closed = True
            self._stop()
            self._coarse = None  # megabytes

    def _stop(self) -> None:
        process = self._process
        if self._rests is not None:
            self._rests.end()
        if process is None or not process.is_alive():
            return
        process.terminate()
        process.join(_END_S)
        if process.is_alive():
            process.kill()
            process.join()

    def _send(self, command: str) -> None:
        with suppress(OSError):  # it has ended
            if self._pipe is not None:
                self._pipe.send(command)

    def _set(self, **news: Any) -> None:
        with self._changed:
            self._state = replace(self._state, **news)

    def _hear(self, pipe: "Connection[Any, Any]") -> None:
        """Take what a build reports until it ends."""
        while True:
            try:
                told = pipe.recv()
            except (EOFError, OSError):
                told = None
            if pipe is not self._pipe:  # another process builds by now
                return
            if told is None:
                is_over = self.state.doing in ("cancelled", "failed", "complete")
                if not is_over and not self._is_closed:
                    self._fail(_KILLED)
                return
            if isinstance(told, _Task):
                self._take(told)
            elif isinstance(told, _View):
                self.holders = told.holders
                self._views[told.folder.name] = told.folder
                self._set(folder=f"{told.folder.name}/")
            elif isinstance(told, _End) and self.state.doing != "cancelled":
                if told.line:
                    self._fail(told.line)
                else:
                    self._set(doing="complete", share=1.0, left_s=0.0, has_bundle=True)
            elif told == "paused" and self.state.doing == "pausing":
                self._set(doing="paused")
            elif isinstance(told, float):
                self._paused_s += told

    def _fail(self, text: str) -> None:
        """Take down that the build has failed.

        text  a line for each cause, as the build reports them; the page has room for one
        """
        if os.strerror(errno.ENOSPC) in text:
            text = "the disk is full: make room, then continue the build"
        first, *others = self._explain(text).splitlines() or [""]
        line = f"{first} (and {counted(len(others), 'more line')})" if others else first
        self._set(doing="failed", line=line, left_s=None)

    def _take(self, task: _Task) -> None:
        share = _share_of(task)
        spent_s = time.monotonic() - self._began_s - self._paused_s
        left_s = spent_s * (1 - share) / share if share > _TELLING else None
        self._set(
            label=task.label,
            done=task.done,
            total=task.total,
            tiles=task.tiles,
            share=share,
            left_s=left_s if self.state.doing == "building" else None,
            has_bundle=self.state.has_bundle or task.label == "report",  # which comes after it
        )


def _share_of(task: _Task) -> float:
    """Return how much of a build is done, 0..1, when a part of it has got so far."""
    if task.label not in SHARES:
        return 0.0
    names = list(SHARES)
    before = sum(SHARES[name] for name in names[: names.index(task.label)])
    return before + SHARES[task.label] * task.done / max(1, task.total)


def _run(pipe: "Connection[Any, Any]") -> None:
    """Build, in the process of its own. What it builds comes by the pipe, however large that is."""
    with suppress(EOFError, BrokenPipeError, KeyboardInterrupt):  # nobody looks any more
        from stereocell.live.partial_view import PartialView  # it imports USD, and the page waits

        lead_group()
        threading.Thread(target=end_with_parent, daemon=True).start()
        _lower_priority()
        build, coarse = pipe.recv()
        view = PartialView(coarse.plan, coarse.read, coarse.out, coarse.scratch, sizes=coarse.sizes)
        pipe.send(_End(build(_Watcher(view, pipe))))


class _Watcher:
    """Called by the build after each task: reports it, writes views, and pauses."""

    def __init__(self, view: "PartialView", pipe: "Connection[Any, Any]") -> None:
        self._view, self._pipe, self._has_failed = view, pipe, False

    def __call__(self, label: str, done: int, total: int, name: str) -> None:
        if label == "units":
            self._look(name.split("/")[0] if name and done < total else None)
        self._pipe.send(_Task(label, done, total, self._view.finished))
        if self._pipe.poll() and self._pipe.recv() == "pause":
            self._pipe.send("paused")
            began_s = time.monotonic()
            while self._pipe.recv() != "continue":
                pass
            self._pipe.send(time.monotonic() - began_s)

    def _look(self, tile_id: str | None) -> None:
        """Write a new view where a tile is finished. Without one the build goes on all the same."""
        if self._has_failed:
            return
        try:
            folder = self._view.add(tile_id)
        except (StereoCellError, OSError) as error:
            self._has_failed = True
            console.print(f"views: {error}: the page shows surfaces at the end", markup=False)
            return
        if folder is not None:
            self._pipe.send(_View(folder, self._view.holders))


def _lower_priority() -> None:
    """Let whoever looks at the page go first; the workers of the build inherit it."""
    if sys.platform == "win32":
        import ctypes

        below_normal = 0x4000
        kernel = ctypes.windll.kernel32
        kernel.SetPriorityClass(kernel.GetCurrentProcess(), below_normal)
    else:
        os.nice(_NICE)
