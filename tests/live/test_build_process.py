"""A build in a process of its own is watched, paused, continued, cancelled and started again."""

import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from stereocell.live.build_process import BuildProcess, Coarse
from stereocell.live.build_state import State
from support import fake_build

PATIENCE_S = 120


@pytest.fixture
def begin(tmp_path: Path) -> Iterator[Callable[[Any], BuildProcess]]:
    """Return a function that begins a build of support/fake_build.py, which ends after the test."""
    started: list[BuildProcess] = []

    def start(build: Any) -> BuildProcess:
        process = BuildProcess(partial(build, tmp_path), tmp_path / "out")
        started.append(process)
        nothing: Any = SimpleNamespace(tiles=())  # there is no view to write
        process.start(Coarse(nothing, {}, tmp_path / "out", tmp_path, {}))
        return process

    yield start
    for process in started:
        process.close()


def until(process: BuildProcess, holds: Callable[[State], bool]) -> State:
    end = time.monotonic() + PATIENCE_S
    while not holds(state := process.state):
        assert time.monotonic() < end, state
        time.sleep(0.02)
    return state


@pytest.mark.slow
def test_a_build_is_paused_cancelled_and_continued(
    begin: Callable[[Any], BuildProcess], tmp_path: Path
) -> None:
    process = begin(fake_build.steady)
    assert process.bundle is None
    until(process, lambda state: state.done >= 3)
    process.do("continue")  # the build already runs, so this does nothing
    process.do("pause")
    assert process.state.doing in ("pausing", "paused")
    paused = until(process, lambda state: state.doing == "paused")
    time.sleep(0.5)
    assert process.state == paused
    process.do("pause")  # once is enough
    process.do("continue")
    until(process, lambda state: state.done > paused.done + 2)
    process.do("cancel")
    assert process.state.doing == "cancelled"
    process.do("pause")
    assert process.state.doing == "cancelled"
    process.do("continue")
    end = until(process, lambda state: state.doing == "complete")
    assert (end.share, end.has_bundle, end.line) == (1.0, True, "")
    assert process.bundle == tmp_path / "out" / "bundle"
    assert (tmp_path / "starts").read_text() == "**"


@pytest.mark.slow
def test_a_build_that_is_continued_after_a_fault_does_not_fail_when_the_failed_process_ends(
    begin: Callable[[Any], BuildProcess], tmp_path: Path
) -> None:
    process = begin(fake_build.refused_once)
    assert until(process, lambda state: state.doing == "failed").line == "f.tif: cut off"
    process.do("continue")
    assert (process.state.doing, process.state.line) == ("building", "")
    end = until(process, lambda state: state.doing != "building")
    assert (end.doing, end.line) == ("complete", "")
    assert (tmp_path / "starts").read_text() == "**"


@pytest.mark.slow
def test_the_line_of_a_failed_build_passes_through_the_function_that_explains_it(
    tmp_path: Path,
) -> None:
    nothing: Any = SimpleNamespace(tiles=())
    build = partial(fake_build.refused, tmp_path)
    process = BuildProcess(build, tmp_path / "out", lambda line: f"explained: {line}")
    process.start(Coarse(nothing, {}, tmp_path / "out", tmp_path, {}))
    line = until(process, lambda state: state.doing == "failed").line
    assert line == "explained: f.tif: changed since the plan: run it again"
    process.close()


@pytest.mark.slow
def test_the_lines_of_several_tasks_become_one_that_says_what_to_do(
    begin: Callable[[Any], BuildProcess],
) -> None:
    for build, expected in (
        (fake_build.starved, "the disk is full; free some space, then continue the build"),
        (fake_build.refused_twice, "A: f.tif: cut off (and 2 more lines)"),
    ):
        assert until(begin(build), lambda state: state.doing == "failed").line == expected


@pytest.mark.slow
def test_a_command_before_the_start_takes_effect(tmp_path: Path) -> None:
    nothing: Any = SimpleNamespace(tiles=())
    coarse = Coarse(nothing, {}, tmp_path / "out", tmp_path, {})
    process = BuildProcess(partial(fake_build.steady, tmp_path), tmp_path / "out")
    process.do("cancel")
    process.start(coarse)
    assert process.state.doing == "cancelled"
    assert not (tmp_path / "starts").exists()
    process = BuildProcess(partial(fake_build.steady, tmp_path), tmp_path / "out")
    process.do("pause")
    process.start(coarse)
    try:
        assert until(process, lambda state: state.doing == "paused").done == 0
    finally:
        process.close()


@pytest.mark.slow
def test_an_error_and_a_kill_are_reported_in_a_line(begin: Callable[[Any], BuildProcess]) -> None:
    ended = until(begin(fake_build.refused), lambda state: state.doing == "failed")
    assert ended.line == "f.tif: changed since the plan: run it again"
    if sys.platform != "win32":
        ended = until(begin(fake_build.killed), lambda state: state.doing == "failed")
        assert ended.line == "the build was stopped from outside"
        assert not ended.has_bundle
