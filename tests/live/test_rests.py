"""A build rests for moments while somebody waits, and works at least half of the time."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import psutil
import pytest

from stereocell.live import rests
from stereocell.live.rests import Rests

PATIENCE_S = 60


@pytest.fixture
def busy() -> Iterator[psutil.Process]:
    """A process that has a child."""
    sleeps = "import time; time.sleep(600)"
    begins = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {sleeps!r}])"
    with subprocess.Popen([sys.executable, "-c", begins]) as process:
        found = psutil.Process(process.pid)
        until(lambda: len(found.children()) == 1)
        (child,) = found.children()
        yield found
        for one in (child, found):
            with suppress(psutil.NoSuchProcess):
                one.kill()


def until(holds: Callable[[], bool]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < end_s
        time.sleep(0.01)


def is_at_rest(process: psutil.Process) -> bool:
    return {one.status() for one in (process, *process.children())} == {psutil.STATUS_STOPPED}


def works(process: psutil.Process) -> bool:
    return psutil.STATUS_STOPPED not in {one.status() for one in (process, *process.children())}


def test_a_process_and_its_child_rest_while_someone_waits(busy: psutil.Process) -> None:
    resting = Rests(busy.pid)
    with resting.while_someone_waits():
        until(lambda: is_at_rest(busy))
    until(lambda: works(busy))
    resting.end()
    with resting.while_someone_waits():
        resting.ask()
        time.sleep(0.3)
        assert works(busy)


def test_a_rest_ends_by_itself_and_is_followed_by_as_much_work(
    busy: psutil.Process, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rests, "MOST_S", 0.4)
    resting = Rests(busy.pid)
    begun_s = time.monotonic()
    with resting.while_someone_waits():
        until(lambda: resting.rested_s > 0)
        first_s = resting.rested_s
        assert works(busy)
        while time.monotonic() < begun_s + 3:  # a frame is late again and again
            resting.ask()
            time.sleep(0.02)
    until(lambda: works(busy))
    passed_s = time.monotonic() - begun_s
    assert first_s >= 0.4
    assert first_s < resting.rested_s <= passed_s / 2 + first_s
    resting.end()


def test_asking_a_process_that_has_ended_to_rest_does_nothing(busy: psutil.Process) -> None:
    resting = Rests(busy.pid)
    (child,) = busy.children()
    child.kill()
    until(lambda: busy.status() == psutil.STATUS_ZOMBIE)
    resting.ask()
    resting.end()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_build_at_rest_ends_with_a_server_that_is_killed(tmp_path: Path) -> None:
    id_file = tmp_path / "build"
    with subprocess.Popen(
        [sys.executable, "-m", "support.server_of_a_build", str(tmp_path)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        start_new_session=True,
    ) as server:
        until(id_file.exists)
        build = psutil.Process(int(id_file.read_text()))
        until(lambda: build.status() == psutil.STATUS_STOPPED)
        server.send_signal(signal.SIGKILL)
    until(lambda: not build.is_running() or build.status() == psutil.STATUS_ZOMBIE)
