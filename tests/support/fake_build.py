"""Builds for tests of `BuildProcess`: they report tasks, and compute nothing."""

import errno
import os
import signal
import threading
import time
from pathlib import Path

from stereocell.engine.run import Watch


def steady(folder: Path, watch: Watch) -> str:
    """Report 60 tasks of 50 ms; append a character to the file `starts` at each start."""
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


def starved(_: Path, watch: Watch) -> str:
    """End with the lines of two tasks for which the disk had no space."""
    watch("evidence", 0, 2, "")
    no_room = os.strerror(errno.ENOSPC)
    return f"r0_c0/A: out: can't be written: {no_room}\nevidence: 2 of 2 failed"


def refused_twice(_: Path, watch: Watch) -> str:
    """End with a line for each of two tasks, and one for both."""
    watch("evidence", 0, 2, "")
    return "A: f.tif: cut off\nB: f.tif: not a number\nevidence: 2 of 2 failed"


def refused_once(folder: Path, watch: Watch) -> str:
    """Print the line of an error and end a second later; the next build is steady."""
    if (folder / "starts").exists():
        return steady(folder, watch)
    (folder / "starts").write_text("*")
    threading.Thread(target=time.sleep, args=(1,)).start()
    return "f.tif: cut off"


def killed(_: Path, watch: Watch) -> str:
    """Be killed, as the system kills a process when memory runs out."""
    watch("windows", 0, 1, "")
    os.kill(os.getpid(), signal.SIGKILL)
    return ""


def endless(folder: Path, watch: Watch) -> str:
    """Write the process ID to the file `build`, and then never report a task or end."""
    (folder / "build.part").write_text(str(os.getpid()))
    (folder / "build.part").rename(folder / "build")
    while True:
        time.sleep(0.05)
