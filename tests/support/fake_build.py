"""Builds for tests of `BuildProcess`: they report tasks, and compute nothing."""

import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from stereocell.engine.run import Watch


def steady(folder: Path, watch: Watch) -> str:
    """Report 60 tasks of 50 ms, and keep count of the starts in a file."""
    with (folder / "starts").open("a") as starts:
        starts.write("*")
    for done in range(61):
        watch("evidence", done, 60, f"r0_c{done}/A" if done else "")
        time.sleep(0.05)
    watch("report", 0, 1, "")
    return ""


def refused(_: Path, watch: Watch) -> str:
    """End with the line of an error."""
    watch("windows", 0, 1, "")
    return "f.tif: changed since the plan: run it again"


def killed(_: Path, watch: Watch) -> str:
    """Be killed, as for want of memory."""
    watch("windows", 0, 1, "")
    os.kill(os.getpid(), signal.SIGKILL)
    return ""


@dataclass(frozen=True)
class Into:
    """A build into a folder: called with what watches it alone, as `BuildProcess` does."""

    build: Callable[[Path, Watch], str]
    out: Path

    def __call__(self, watch: Watch) -> str:
        self.out.mkdir(parents=True, exist_ok=True)
        return self.build(self.out, watch)


def bundled(out: Path, watch: Watch) -> str:
    """Leave a bundle of two files."""
    watch("windows", 0, 1, "")
    (out / "bundle").mkdir(exist_ok=True)
    for name in ("manifest.json", "index.html"):
        (out / "bundle" / name).write_text("built")
    watch("report", 0, 1, "")
    return ""


def slowly_bundled(out: Path, watch: Watch) -> str:
    """Report 60 tasks of 50 ms, keep count of the starts, and leave a bundle."""
    return steady(out, watch) or bundled(out, watch)
