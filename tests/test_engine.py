"""The engine runs everything, in order of the tasks, whatever fails."""

import pytest

from stereocell.engine import Engine, TasksFailedError
from stereocell.errors import SourceError


def double(value: int) -> int:
    if value == 3:
        raise SourceError("three is\nbroken")
    if value == 4:
        raise ValueError("four is a bug")
    return 2 * value


@pytest.mark.parametrize("workers", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_results_come_in_the_tasks_order_and_failures_at_the_end(workers: int) -> None:
    engine = Engine(workers)
    try:
        tasks = [(f"t{n}", n) for n in (9, 8, 1)]
        assert engine.run("good", double, tasks) == [18, 16, 2]
        with pytest.raises(TasksFailedError) as raised:
            engine.run("bad", double, [(f"t{n}", n) for n in (1, 3, 4, 5)])
    finally:
        engine.close()
    assert str(raised.value).splitlines() == [
        "t3: three is broken",
        "t4: ValueError: four is a bug",
        "bad: 2 of 4 failed",
    ]
