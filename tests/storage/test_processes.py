"""The number of cores that this process may use, and the memory that it keeps."""

import math
import os
import platform
import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from dask.system import cpu_count
from distributed.system import memory_limit

from stereocell.storage import processes
from stereocell.storage.processes import container_bytes, container_cores, cores


def test_cores_are_counted_like_dask_counts_them() -> None:
    assert cores() == cpu_count()


def test_affinity_and_quota_both_bound_the_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: set(range(8)), raising=False)
    for quota, expected in ((math.inf, 8), (2.5, 3), (0.5, 1), (16.0, 8)):
        monkeypatch.setattr(processes, "container_cores", lambda quota=quota: quota)
        assert cores() == expected


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({}, math.inf),
        ({"cpu,cpuacct/cpu.cfs_quota_us": "150000"}, 1.5),
        ({"cpuacct,cpu/cpu.cfs_quota_us": "50000"}, 0.5),
        ({"cpuacct,cpu/cpu.cfs_quota_us": "-1"}, math.inf),
        ({"one/two/cpu.max": "200000 100000"}, 2.0),
        ({"one/two/cpu.max": "max 100000"}, math.inf),
        ({"one/two/cpu.max": "damaged"}, math.inf),
    ],
)
def test_the_quota_is_that_of_the_container_s_group(
    tmp_path: Path, files: dict[str, str], expected: float
) -> None:
    group = tmp_path / "proc/self/cgroup"
    group.parent.mkdir(parents=True)
    group.write_text("0::/one/two\n")
    for name, text in files.items():
        file = tmp_path / "sys/fs/cgroup" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text + "\n")
        file.with_name("cpu.cfs_period_us").write_text("100000\n")
    assert container_cores(tmp_path) == expected


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({}, math.inf),
        ({"memory.max": "max", "memory.high": "max"}, math.inf),
        ({"memory.max": "3000000", "memory.high": "max"}, 3e6),
        ({"memory.max": "3000000", "memory.high": "2000000"}, 2e6),
        ({"memory/memory.limit_in_bytes": "4000000"}, 4e6),
    ],
)
def test_memory_is_bounded_by_the_container_s_group(
    tmp_path: Path, files: dict[str, str], expected: float
) -> None:
    for name, text in files.items():
        file = tmp_path / "sys/fs/cgroup" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text + "\n")
    assert container_bytes(tmp_path) == expected


def test_the_machine_s_memory_bounds_as_much_as_in_distributed() -> None:
    assert min(psutil.virtual_memory().total, container_bytes()) == memory_limit()


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc has these settings")
def test_a_process_that_keeps_its_memory_does_not_ask_the_system_for_it_again() -> None:
    def pages(arrays: int, prepare: str) -> int:
        """Return how many pages the system gives to arrays of 64 MB, one after another."""
        code = (
            "import resource, numpy as np\n"
            "from stereocell.storage.processes import keep_freed_memory\n"
            f"{prepare}\n"
            f"for _ in range({arrays}): np.ones(8_000_000)\n"
            "print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt)"
        )
        command = [sys.executable, "-c", code]
        return int(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

    nothing, returned, kept = pages(0, ""), pages(40, ""), pages(40, "keep_freed_memory()")
    assert kept - nothing < 0.2 * (returned - nothing), (nothing, returned, kept)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc has malloc_trim")
@pytest.mark.parametrize(("arrays", "returns"), [(10, True), (4, False)])
def test_much_memory_that_was_kept_returns_to_the_system(arrays: int, returns: bool) -> None:
    code = (
        "import numpy as np, psutil\n"
        "from stereocell.storage import processes\n"
        "processes.keep_freed_memory()\n"
        "process = psutil.Process()\n"
        "start = process.memory_info().rss\n"
        f"arrays = [np.ones(8_000_000) for _ in range({arrays})]\n"
        "small = np.ones(1000)\n"  # lies above the freed arrays, at the end of the heap
        "del arrays\n"
        "kept = process.memory_info().rss - start\n"
        "processes.release_freed_memory()\n"
        "print(kept, process.memory_info().rss - start)"
    )
    command = [sys.executable, "-c", code]
    found = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    kept, left = map(int, found.split())
    assert kept > arrays * 60e6
    assert (left < 0.2 * kept) == returns
    assert (left > 0.8 * kept) != returns
