"""Measure how soon a source is visible, the cost, and the server's latency during a build.

    .venv/bin/python tests/bench/live_view.py [SOURCE ...]

The sources are those of `STEREOCELL_DATA`, and samples. For each source, `stereocell view` first
starts once, so that the files are cached and Python has its bytecode. Then it starts ROUNDS times
without a build. The table has seconds from the start of the command to the page, and to the end
of fetching the first view's files; the CPU seconds until then, also in units of the reference
kernel (machine.py); and the bytes of these files and of the page. Then one file is requested again
and again, alone and during the build. Other processes lengthen seconds more than CPU seconds, so
the load of the machine is printed, too.
"""

import json
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from machine import Spent, stated, typical

ROUNDS = 3
REQUESTS = 200
DATA = Path(os.environ.get("STEREOCELL_DATA", "../shared/data")).resolve()
SOURCES = {
    "ovule": [f"{DATA}/ovule_plantseg/sample_ovule.h5:/raw"],
    "GE CT": [f"{DATA}/ct_head_ge"],
    "brain cells": [f"{DATA}/brain_cells_2ch/brain_cells_2ch.ome.tif"],
    "7 T MRI": [f"{DATA}/mri_t1_7t"],
    "mouse brain": [f"{DATA}/mouse_brain/mouse_brain.ome.tif", "--spacing-um", "25,25,25"],
    "nuclei": [f"{DATA}/nuclei_stardist/img3d.tif", "--spacing-um", "1,0.5,0.5"],
}
# Arguments of `stereocell sample`, and the flags of the sample's build
SAMPLES = {
    "CyCIF sample": (["cycif", "cycif.ome.zarr", "--grid", "3x2"], ["--grid", "3x2"]),
    "head sample": (["mri", "mri"], []),
    "cells sample": (["cells", "cells.ome.zarr"], []),
    "brain sample": (["brain-cells", "brain-cells.ome.tif"], []),
}
_COMPRESSED = {"Accept-Encoding": "br, gzip"}
# Variables that a user's terminal lacks. With them, Python would compile all imports.
_UNSET = ("PYTHONDONTWRITEBYTECODE",)


def main(words: list[str]) -> None:
    given = {word: [str(Path(word).resolve())] for word in words} or {
        name: flags for name, flags in SOURCES.items() if Path(flags[0].split(":")[0]).exists()
    }
    print(f"{'':12} page s  view s  CPU s   refs   MB  page MB  load   alone ms  beside a build ms")
    with tempfile.TemporaryDirectory() as folder:
        for name, (sample, flags) in SAMPLES.items() if not words else ():
            kind, place, *rest = sample
            command = ["sample", kind, f"{folder}/{place}", *rest]
            subprocess.run([sys.executable, "-m", "stereocell.cli", *command], check=True)
            given[name] = [f"{folder}/{place}", *flags]
        for name, flags in given.items():
            print(f"{name[-12:]:12} {measured(flags, folder)}", flush=True)


def measured(flags: list[str], folder: str) -> str:
    """Return a row of the table."""
    first = []
    with viewing([*flags, "--no-build"], folder) as (_, address, _):
        page = fetch_page(address)
    for _ in range(ROUNDS):
        with viewing([*flags, "--no-build"], folder) as (server, address, began_s):
            page_s = time.perf_counter() - began_s
            files = fetch_view(address)
            view_s = time.perf_counter() - began_s
            first.append((page_s, view_s, cpu_s(server.pid), sum(files.values()) / 1e6))
            alone = latencies_ms(address, max(files, key=lambda path: files[path]))
    with viewing([*flags, "--out", f"{folder}/out-{time.monotonic_ns()}"], folder) as (
        server,
        address,
        _,
    ):
        files = fetch_view(address)
        time.sleep(5)  # the build has begun after this time
        beside = latencies_ms(address, max(files, key=lambda path: files[path]))
    cost = typical(*(Spent(view_s, spent_s) for _, view_s, spent_s, _ in first))
    page_s, view_s, spent_s, megabytes = map(statistics.median, zip(*first, strict=True))
    return (
        f"{page_s:6.1f} {view_s:7.1f} {spent_s:6.1f} {cost.references:6.1f} {megabytes:5.2f} "
        f"{page / 1e6:7.2f} {cost.load:6.1f}    "
        f"{alone[0]:4.1f} {alone[1]:4.1f}    {beside[0]:4.1f} {beside[1]:4.1f}"
    )


@contextmanager
def viewing(flags: list[str], folder: str) -> Iterator[tuple[subprocess.Popen[str], str, float]]:
    """Run `stereocell view`; yield its process, its address and its time of start."""
    began_s = time.perf_counter()
    command = [sys.executable, "-m", "stereocell.cli", "view", *flags]
    with subprocess.Popen(
        [*command, "--json", "--no-browser", "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        cwd=folder,
        env={name: text for name, text in os.environ.items() if name not in _UNSET},
    ) as server:
        assert server.stdout is not None
        line = server.stdout.readline()
        answer = json.loads(line or "{}")
        if "address" not in answer:
            raise SystemExit(f"{flags[0]}: {answer.get('error', 'the command has ended')}")
        address = answer["address"]
        get(address)
        try:
            yield server, address, began_s
        finally:
            server.send_signal(signal.SIGTERM)
            server.communicate(timeout=120)


def fetch_view(address: str) -> dict[str, int]:
    """Fetch all files of a view; return their bytes by path."""
    files = json.loads(get(f"{address}manifest.json"))["files"]["path"]
    listed = json.loads(get(address + files))
    return {path: len(get(address + path)) for path in listed}


def fetch_page(address: str) -> int:
    """Fetch the page with its scripts and styles; return their compressed bytes."""
    text = get(address).decode()
    paths = set(re.findall(r"assets/[\w-]+\.(?:js|css)\b(?!\.)", text))
    return sum(len(get(address + path, **_COMPRESSED)) for path in ("", *paths))


def latencies_ms(address: str, path: str) -> tuple[float, float]:
    """Return the median and 95th percentile of the time, ms, to fetch a file's first 64 kB."""
    took = []
    for _ in range(REQUESTS):
        start = time.perf_counter()
        get(address + path, Range="bytes=0-65535")
        took.append(1000 * (time.perf_counter() - start))
        time.sleep(0.02)
    return statistics.median(took), statistics.quantiles(took, n=20)[-1]


def get(address: str, **headers: str) -> bytes:
    with urllib.request.urlopen(urllib.request.Request(address, headers=headers)) as answer:
        return bytes(answer.read())


def cpu_s(process: int) -> float:
    """Return the CPU seconds of a process so far."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    with stated():
        main(sys.argv[1:])
