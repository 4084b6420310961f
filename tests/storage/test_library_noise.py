"""Warnings and log lines of libraries do not reach the terminal while a source is read."""

import logging
import subprocess
import sys
import threading
import warnings

import pytest

from stereocell.storage.library_errors import library_boundary, one_line
from stereocell.storage.library_noise import quiet_libraries

NOISE = """
import logging, warnings
from stereocell.storage.library_errors import {boundary}
with {boundary}("a.nrrd", "a sound file"):
    warnings.warn("a library warns")
    logging.getLogger("alibrary").warning("a library logs")
logging.getLogger("alibrary").warning("shown again")
"""


@pytest.mark.parametrize("boundary", [one_line.__name__, library_boundary.__name__])
def test_warnings_and_log_lines_inside_a_boundary_are_not_shown(boundary: str) -> None:
    run = subprocess.run(
        [sys.executable, "-c", NOISE.format(boundary=boundary)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert (run.stdout, run.stderr) == ("", "shown again\n")


def test_a_warning_of_stereocell_s_own_code_is_shown() -> None:
    names = {"__name__": "stereocell.read.some", "warnings": warnings}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with quiet_libraries():
            exec("warnings.warn('ours')", names)
            exec("warnings.warn('theirs')", {**names, "__name__": "nrrd.reader"})
    assert [str(one.message) for one in caught] == ["ours"]


def test_settings_are_restored_when_the_last_thread_leaves() -> None:
    filters, handler = list(warnings.filters), logging.lastResort
    inside, leave = threading.Barrier(3), threading.Event()

    def read() -> None:
        with quiet_libraries():
            inside.wait()
            leave.wait()

    threads = [threading.Thread(target=read) for _ in range(2)]
    for thread in threads:
        thread.start()
    with quiet_libraries():
        inside.wait()
    assert logging.lastResort is not handler
    leave.set()
    for thread in threads:
        thread.join()
    assert (list(warnings.filters), logging.lastResort) == (filters, handler)
