"""Worker processes of this machine: errors, killed workers, and commands that are stopped."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import psutil
import pytest

from stereocell.engine import worker_pool
from stereocell.engine.run import Engine, TasksFailedError
from stereocell.engine.worker_pool import WorkerPool, WorkersError
from support.busy_command import start_script, started_with_two_tasks
from support.server.timeouts import PATIENCE_S
from support.worker_tasks import die, die_beside_others, double, fail_unpicklably

pytestmark = pytest.mark.slow


@pytest.fixture
def engine() -> Iterator[Engine]:
    with closing(Engine(2)) as engine:
        yield engine


def test_a_task_that_kills_its_worker_fails_alone_and_the_others_finish(engine: Engine) -> None:
    with pytest.raises(TasksFailedError) as raised:
        engine.run("bad", die, [(f"t{n}", n) for n in range(4)])
    (line,) = str(raised.value).splitlines()
    assert line.startswith("t1: its worker process was killed each time")
    assert "fewer --workers" in line
    assert engine.run("good", double, [("a", 1), ("b", 2)]) == [2, 4]


def test_a_task_whose_worker_was_killed_runs_again_alone(engine: Engine, tmp_path: Path) -> None:
    tasks = [(str(n), (tmp_path, n)) for n in range(6)]
    assert engine.run("once", die_beside_others, tasks) == list(range(6))
    assert (tmp_path / "died").read_text("utf-8") == "3"


def test_an_error_that_cannot_be_pickled_is_reported_by_its_name_and_text(engine: Engine) -> None:
    with pytest.raises(TasksFailedError, match=r"a, b: .*Unpicklable: it has two arguments"):
        engine.run("bad", fail_unpicklably, [("a", 1), ("b", 2)])


def test_answers_of_an_abandoned_run_do_not_reach_the_next_run() -> None:
    with closing(WorkerPool(2, double.__module__)) as pool:
        next(pool.run(double, [10, 20, 30, 50]))
        assert sorted(pool.run(double, [1, 2])) == [(0, 2, None), (1, 4, None)]


def test_workers_that_do_not_start_in_time_are_reported_in_one_line(
    monkeypatch: pytest.MonkeyPatch, engine: Engine
) -> None:
    monkeypatch.setattr(worker_pool, "_START_S", 0)
    with pytest.raises(WorkersError, match="--workers: the processes did not answer within 0 s"):
        engine.run("slow", double, [("a", 1), ("b", 2)])


# The line `if __name__ == "__main__":` is missing, so that each worker starts the run again.
_UNGUARDED = """
from stereocell.engine.run import Engine
from support.worker_tasks import double

engine = Engine(2)
try:
    engine.run("numbers", double, [("a", 1), ("b", 2)])
finally:
    engine.close()
"""


def test_a_script_without_a_main_guard_is_answered_with_the_line_to_write(tmp_path: Path) -> None:
    script = start_script(_UNGUARDED, tmp_path)
    _, text = script.communicate(timeout=PATIENCE_S)
    assert script.returncode == 1
    assert "A script that builds needs the line `if __name__ == '__main__':`" in text
    assert (
        text.count("Traceback") == 1
    )  # the traceback of the script itself, and none of its workers'


def test_a_script_on_standard_input_can_use_workers(tmp_path: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-"],
        input=_UNGUARDED + "print('done')",
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])},
        cwd=tmp_path,
        text=True,
        capture_output=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert (run.returncode, run.stdout) == (0, "done\n"), run.stderr


@pytest.mark.parametrize(
    ("number", "code"),
    [(signal.SIGTERM, 1), (signal.SIGINT, -signal.SIGINT), (signal.SIGKILL, -signal.SIGKILL)],
)
def test_no_worker_outlives_a_command_that_is_stopped_or_killed(
    tmp_path: Path, number: signal.Signals, code: int
) -> None:
    command = started_with_two_tasks(tmp_path)
    family = psutil.Process(command.pid).children(recursive=True)
    assert len(family) >= 2
    command.send_signal(number)
    try:
        _, text = command.communicate(timeout=PATIENCE_S)
    finally:
        command.kill()
    assert command.returncode == code, text
    _, alive = psutil.wait_procs(family, timeout=PATIENCE_S)
    assert alive == []
