"""The engine runs all tasks and returns results in their order, even if some fail."""

import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

from stereocell.engine import run
from stereocell.engine.cluster_tasks import _outcome_of
from stereocell.engine.run import Engine, TasksFailedError
from support.server.timeouts import PATIENCE_S
from support.worker_tasks import double, free_much, read_variable


@pytest.mark.parametrize("workers", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_results_come_in_the_tasks_order_and_failures_at_the_end(workers: int) -> None:
    engine = Engine(workers)
    try:
        tasks = [(f"t{n}", n) for n in (9, 8, 1)]
        assert engine.run("good", double, tasks) == [18, 16, 2]
        with pytest.raises(TasksFailedError) as raised:
            engine.run("bad", double, [(f"t{n}", n) for n in (1, 3, 4, 5, 6)])
    finally:
        engine.close()
    assert str(raised.value).splitlines() == [
        "t3, t6: it is broken",
        "t4: ValueError: four is a bug",
        "bad: 3 of 5 failed",
    ]


@pytest.mark.slow
@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc has malloc_trim")
def test_a_worker_keeps_memory_between_the_tasks_of_a_run_and_returns_it_afterwards() -> None:
    engine = Engine(1)
    tasks = [(f"t{n}", n) for n in range(3)]
    try:
        start, *between = engine.run("free", free_much, tasks)
        after = engine.run("free", free_much, tasks)[0]
    finally:
        engine.close()
    assert min(between) - start > 500e6
    assert after - start < 200e6


@pytest.mark.slow
def test_workers_have_the_environment_of_the_moment(monkeypatch: pytest.MonkeyPatch) -> None:
    """The server that forks workers has an older environment, from this process's first engine."""
    name = "STEREOCELL_OF_A_TEST"
    for value in ("first", "second", None):
        if value is None:
            monkeypatch.delenv(name, raising=False)
        else:
            monkeypatch.setenv(name, value)
        engine = Engine(1)
        try:
            assert engine.run("read", read_variable, [("a", name), ("b", name)]) == [value, value]
        finally:
            engine.close()


@pytest.mark.slow
def test_workers_start_where_the_name_of_the_temporary_folder_is_too_long_for_a_socket(
    tmp_path: Path,
) -> None:
    folder = tmp_path / ("long" * 30)
    folder.mkdir()
    text = (
        "from stereocell.engine.run import Engine; from support.worker_tasks import double\n"
        "if __name__ == '__main__':\n"
        "    engine = Engine(1)\n"
        "    print(engine.run('long', double, [('a', 1), ('b', 2)]))\n"
        "    engine.close()\n"
    )
    script = tmp_path / "it's a script.py"
    script.write_text(text)
    ended = subprocess.run(
        [sys.executable, script],
        env=os.environ | {"TMPDIR": str(folder), "PYTHONPATH": str(Path(__file__).parents[1])},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert (ended.stdout, ended.returncode) == ("[2, 4]\n", 0), ended.stderr


class Gone:
    """A client with one task, whose workers vanish before the task ends or afterwards."""

    def __init__(self, ended: bool) -> None:
        self.ended = ended

    def exception(self, timeout: float) -> None:
        if not self.ended:
            raise TimeoutError

    def result(self, timeout: float) -> None:
        raise TimeoutError  # the result was on a worker that is gone

    def scheduler_info(self) -> dict[str, dict[str, str]]:
        return {"workers": {}}


@pytest.mark.parametrize("ended", [False, True])
def test_the_command_does_not_wait_forever_for_vanished_workers(ended: bool) -> None:
    result, failure = _outcome_of(Gone(ended), Gone(ended))
    assert result is None
    assert "its workers are gone and did not come back" in str(failure)


def test_a_log_states_how_long_the_remaining_tasks_take_at_the_pace_so_far(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = iter(
        [100.0, 104.0, 120.0, 190.0, 200.0]
    )  # times of the start, and of the end of each of four tasks
    monkeypatch.setattr(run.time, "monotonic", lambda: next(now))
    Engine(0).run("units", str, [(name, 0) for name in "abcd"])
    lines = capsys.readouterr().err.splitlines()
    assert [line.removeprefix("units: ") for line in lines] == [
        "1/4 a",
        "2/4 b; 20 s left",
        "3/4 c; 30 s left",
        "4/4 d",
    ]
