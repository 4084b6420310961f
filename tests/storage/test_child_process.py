"""A library that ends its process or never returns causes one error in the parent."""

import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest

import stereocell
from stereocell.model.errors import SourceError
from stereocell.storage.child_process import Bounds, Child, ChildError, run_in_child
from support.child_objects import LONG_S, Counter, print_and_return, refuse


def test_an_object_keeps_its_state_between_calls() -> None:
    with Child(Counter, 3) as child:
        assert child.call("add", 4) == 7
        assert child.call("add", 1) == 8


def test_arrays_pass_to_the_child_and_back_unchanged() -> None:
    values = np.arange(100_000).reshape(10, 100, 100)[:, ::-1]
    with Child(Counter, 0) as child:
        found = child.call("doubled", values)
    assert np.array_equal(found, 2 * values)
    assert found.flags.writeable


@pytest.mark.parametrize(
    ("number", "words"),
    [(signal.SIGABRT, "SIGABRT"), (signal.SIGKILL, "SIGKILL (killed, probably for")],
)
def test_a_death_by_a_signal_is_an_error_that_names_it(number: int, words: str) -> None:
    with pytest.raises(ChildError, match=r"its process ended by " + words.replace("(", r"\(")):
        run_in_child(signal.raise_signal, number)


def test_a_call_after_a_death_is_an_error_too() -> None:
    with Child(Counter, 0) as child:
        for _ in range(2):
            with pytest.raises(ChildError, match="SIGSEGV"):
                child.call("kill")


def test_a_call_that_never_ends_is_ended_at_its_bound() -> None:
    with pytest.raises(ChildError, match=r"it did not end within 0\.5 s"):
        run_in_child(time.sleep, LONG_S, bounds=Bounds(seconds=0.5))


def test_memory_beyond_the_bound_ends_the_child() -> None:
    with pytest.raises(ChildError, match=r"it took more than 0\.2 GB of memory"):
        run_in_child(bytes, 2_000_000_000, bounds=Bounds(memory_bytes=200_000_000))


def test_stereocell_errors_and_bugs_are_raised_in_the_parent() -> None:
    with pytest.raises(SourceError, match=r"a\.parquet: found nothing"):
        run_in_child(refuse, "a.parquet: found nothing")
    with pytest.raises(ValueError, match=r"math domain error|nonnegative") as caught:
        run_in_child(math.sqrt, -1.0)
    assert "Traceback" in caught.value.__notes__[0]


def test_text_that_a_library_prints_is_discarded(capfd: pytest.CaptureFixture[str]) -> None:
    assert run_in_child(print_and_return) == 3
    assert capfd.readouterr() == ("", "")


def test_a_child_ends_with_its_parent_even_inside_a_call() -> None:
    script = (
        "from stereocell.storage.child_process import Child\n"
        "from support.child_objects import Counter\n"
        "child = Child(Counter, 0); print(child.call('process'), flush=True)\n"
        "child.call('sleep')\n"
    )
    parent = subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.path.dirname(os.path.dirname(__file__))},
    )
    assert parent.stdout is not None
    child = psutil.Process(int(parent.stdout.readline()))
    parent.kill()
    parent.communicate()
    gone, _ = psutil.wait_procs([child], timeout=60)
    assert gone == [child]


def test_only_one_module_starts_interpreters_for_libraries_that_may_abort() -> None:
    package = Path(stereocell.__file__).parent
    starters = {
        file.relative_to(package).as_posix()
        for file in package.rglob("*.py")
        if "[sys.executable" in file.read_text(encoding="utf-8")
    }
    compiling = {
        "kernels/cache_place.py",
        "kernels/compile_all.py",
    }  # these run no library on a source
    assert starters == {"storage/child_process.py", *compiling}
