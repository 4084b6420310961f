"""A command whose two workers run a task each, for tests that examine or stop it."""

import os
import subprocess
import sys
import time
from pathlib import Path

from support.server.timeouts import PATIENCE_S

_TWO_TASKS_WITHOUT_END = """
import signal
from pathlib import Path
from stereocell.engine.interrupts import answering_sigterm
from stereocell.engine.run import Engine
from support.worker_tasks import wait_for_ever

if __name__ == "__main__":
    # A shell lets the commands that it runs in the background ignore Ctrl-C, and so the tests.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    engine = Engine(2)
    with answering_sigterm():
        try:
            engine.run("never", wait_for_ever, [(n, Path(n)) for n in "ab"])
        finally:
            engine.close()
"""


def start_script(script: str, folder: Path, *words: object) -> "subprocess.Popen[str]":
    """Start a Python script that can import the tests' support; its stderr is a pipe.

    words  arguments of the script
    """
    file = folder / "it's a script.py"
    file.write_text(script)
    return subprocess.Popen(
        [sys.executable, file, *(str(word) for word in words)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])},
        stderr=subprocess.PIPE,
        text=True,
    )


def started_with_two_tasks(folder: Path) -> "subprocess.Popen[str]":
    """Return a running command whose two workers each run a task that doesn't end by itself."""
    command = start_script(_TWO_TASKS_WITHOUT_END, folder)
    end = time.monotonic() + PATIENCE_S
    while not all((folder / name).exists() for name in "ab") and time.monotonic() < end:
        time.sleep(0.02)
    return command
