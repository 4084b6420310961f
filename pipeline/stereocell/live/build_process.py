"""Build a source in a process of its own, with lower priority, while its page is open.

The two processes talk over a pipe. The build reports its tasks and the views that it writes, which
are bundles of the part that is built (partial_view.py). The server asks it to pause and to
continue. A pause begins when the running tasks have ended.
Independently of pauses, the build rests for moments while somebody waits for a frame; see `rests`.
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

# Builds, and reports to the watch. Returns the line of an error, or an empty text.
Build = Callable[[Watch], str]

# Share of each phase in the time of a build; measured on one tile, 194 x 512 x 512 voxels, and
# three channels.
SHARES = {
    "windows": 0.1,
    "evidence": 0.09,
    "components": 0.03,
    "units": 0.45,
    "stage": 0.16,
    "tiles": 0.01,
    "previews": 0.04,
    "bundle": 0.08,
    "report": 0.04,
}
_PREDICTABLE = 0.15  # share of a build from which its pace predicts the end; its start is slow
_NICE = 10  # niceness, 0 to 19; a larger one means lower priority
_END_S = 15  # s that a cancelled build has to remove unfinished files
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
    """A build that runs while its page is open. Any thread may call these methods."""

    def __init__(self, build: Build, out: Path, explain: Callable[[str], str] = str) -> None:
        """Describe a build without starting it.

        build    the work; must be picklable
        out      the folder that the build writes
        explain  returns the text to show for the text of an error
        """
        self._build, self.out, self._explain = build, out, explain
        self._coarse: Coarse | None = None
        self._is_closed = False
        self._commanding = threading.Lock()  # only one start or command runs at a time
        self._changing = threading.Lock()
        self._state = State()
        self._views: dict[str, Path] = {}
        self.holders: Mapping[str, Holder] = {}  # pieces that the views leave out; see PartialView
        self._process: Any = None
        self._rests: Rests | None = None
        self._pipe: Connection[Any, Any] | None = None
        self._began_s = self._paused_s = 0.0

    @property
    def state(self) -> State:
        """The current state."""
        return self._state

    def find_view(self, name: str) -> Path | None:
        """Return the folder of a later view by its name; None if there is no such view."""
        return self._views.get(name)

    @property
    def bundle(self) -> Path | None:
        """The finished bundle; None until there is one."""
        return self.out / "bundle" if self.state.has_bundle else None

    def start(self, coarse: Coarse | None = None) -> None:
        """Begin to build, or continue a build that ended early.

        coarse  the inputs of the first view; None to use those of the first start

        A build that a user has paused before this first start begins paused. A cancelled one does
        not begin.
        """
        with self._commanding:
            self._start(coarse)

    def _start(self, coarse: Coarse | None) -> None:
        is_first, self._coarse = self._coarse is None, coarse or self._coarse
        doing = self.state.doing if is_first else "building"
        if self._coarse is None or doing == "cancelled" or self._is_closed:
            return
        self._pipe = None  # reports of an earlier process no longer count
        self._set(doing=doing, line="", left_s=None, all_tiles=len(self._coarse.plan.tiles))
        if self._process is not None:
            self._process.join(_END_S)  # the earlier process has ended or is about to end
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=_run, args=(theirs,))
        with children_ignore_interrupts():  # the server handles Ctrl+C and ends the build
            process.start()
        assert process.pid is not None  # start() has set it
        theirs.close()
        with suppress(OSError):  # the process has already ended, which `_receive` will notice
            ours.send((self._build, self._coarse))
        self._process, self._pipe, self._rests = process, ours, Rests(process.pid)
        self._began_s, self._paused_s = time.monotonic(), 0.0
        if doing == "pausing":
            self._send("pause")
        threading.Thread(target=self._receive, args=(ours,), daemon=True).start()

    def do(self, command: Command) -> None:
        """Carry out a user's command; ignore a command that does not fit the state."""
        with self._commanding:
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
        """Let the build rest for a moment, since frames are late on this machine."""
        if self._rests is not None:
            self._rests.ask()

    def while_someone_waits(self) -> AbstractContextManager[None]:
        """Return a context in which the build rests, while bricks are made for a waiting client."""
        return nullcontext() if self._rests is None else self._rests.while_someone_waits()

    def close(self) -> None:
        """End the process for good, and wait for it. Finished results stay."""
        with self._commanding:
            self._is_closed = True
            self._stop()
            self._coarse = None  # this frees many megabytes

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
        with suppress(OSError):  # the process has ended
            if self._pipe is not None:
                self._pipe.send(command)

    def _set(self, **changes: Any) -> None:
        with self._changing:
            self._state = replace(self._state, **changes)

    def _receive(self, pipe: "Connection[Any, Any]") -> None:
        """Receive the reports of a build until it ends."""
        while True:
            try:
                report = pipe.recv()
            except (EOFError, OSError):
                report = None
            if pipe is not self._pipe:  # this process has ended, and another one builds meanwhile
                return
            if report is None:
                is_over = self.state.doing in ("cancelled", "failed", "complete")
                if not is_over and not self._is_closed:
                    self._fail(_KILLED)
                return
            if isinstance(report, _Task):
                self._show_progress(report)
            elif isinstance(report, _View):
                self.holders = report.holders
                self._views[report.folder.name] = report.folder
                self._set(folder=f"{report.folder.name}/")
            elif isinstance(report, _End) and self.state.doing != "cancelled":
                if report.line:
                    self._fail(report.line)
                else:
                    self._set(doing="complete", share=1.0, left_s=0.0, has_bundle=True)
            elif report == "paused" and self.state.doing == "pausing":
                self._set(doing="paused")
            elif isinstance(report, float):
                self._paused_s += report

    def _fail(self, text: str) -> None:
        """Set the state of a build that has failed.

        text  one line for each cause; the page shows the first one and the number of the others
        """
        if os.strerror(errno.ENOSPC) in text:
            text = "the disk is full; free some space, then continue the build"
        first, *others = self._explain(text).splitlines() or [""]
        line = f"{first} (and {counted(len(others), 'more line')})" if others else first
        self._set(doing="failed", line=line, left_s=None)

    def _show_progress(self, task: _Task) -> None:
        share = _share_of(task)
        spent_s = time.monotonic() - self._began_s - self._paused_s
        left_s = spent_s * (1 - share) / share if share > _PREDICTABLE else None
        self._set(
            label=task.label,
            done=task.done,
            total=task.total,
            tiles=task.tiles,
            share=share,
            left_s=left_s if self.state.doing == "building" else None,
            # The report is the phase after the bundle.
            has_bundle=self.state.has_bundle or task.label == "report",
        )


def _share_of(task: _Task) -> float:
    """Return the share of a build, 0..1, that is done after a task."""
    if task.label not in SHARES:
        return 0.0
    names = list(SHARES)
    before = sum(SHARES[name] for name in names[: names.index(task.label)])
    return before + SHARES[task.label] * task.done / max(1, task.total)


def _run(pipe: "Connection[Any, Any]") -> None:
    """Build, in the build's own process. The inputs come over the pipe, since they may be large."""
    with suppress(EOFError, BrokenPipeError, KeyboardInterrupt):  # the server has ended
        # This module imports USD, which takes long. The server's process does without.
        from stereocell.live.partial_view import PartialView

        lead_group()
        threading.Thread(target=end_with_parent, daemon=True).start()
        _lower_priority()
        build, coarse = pipe.recv()
        view = PartialView(coarse.plan, coarse.read, coarse.out, coarse.scratch, sizes=coarse.sizes)
        pipe.send(_End(build(_Watcher(view, pipe))))


class _Watcher:
    """The build calls this after each task. It reports the task, writes views, and pauses."""

    def __init__(self, view: "PartialView", pipe: "Connection[Any, Any]") -> None:
        self._view, self._pipe, self._has_failed = view, pipe, False

    def __call__(self, label: str, done: int, total: int, name: str) -> None:
        if label == "units":
            self._write_view(name.split("/")[0] if name and done < total else None)
        self._pipe.send(_Task(label, done, total, self._view.finished))
        if self._pipe.poll() and self._pipe.recv() == "pause":
            self._pipe.send("paused")
            began_s = time.monotonic()
            while self._pipe.recv() != "continue":
                pass
            self._pipe.send(time.monotonic() - began_s)

    def _write_view(self, tile_id: str | None) -> None:
        """Write a new view if a tile is finished. The build continues if that fails."""
        if self._has_failed:
            return
        try:
            folder = self._view.add(tile_id)
        except (StereoCellError, OSError) as error:
            self._has_failed = True
            console.print(
                f"views can't be written: {error}: the page shows surfaces only at the end",
                markup=False,
            )
            return
        if folder is not None:
            self._pipe.send(_View(folder, self._view.holders))


def _lower_priority() -> None:
    """Lower the priority of this process and its later workers, so that the viewer stays smooth."""
    if sys.platform == "win32":
        import ctypes

        below_normal = 0x4000
        kernel = ctypes.windll.kernel32
        kernel.SetPriorityClass(kernel.GetCurrentProcess(), below_normal)
    else:
        os.nice(_NICE)
