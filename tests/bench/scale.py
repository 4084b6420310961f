"""Measure time, memory and reads of units, and estimate them for the whole dataset.

    python scale.py FOLDER [TILE]      TILE: z,y,x voxels of the slope's tiles

Runs with 4 to 32 equal small tiles show how time and memory grow with the number of tiles. Hundreds
of tiny tiles show how much memory the command keeps for each. One tile of 194 x 512 x 512 voxels,
full of nuclei, shows the cost of a real tile. All takes twenty minutes. Samples and builds stay in
FOLDER and are made once. Exits with 1 if a bound is exceeded.

The dataset's figures cover its units, which are nearly all of the work, but not its stage, bundle
and report. reading.py estimates the reads.
"""

import json
import math
import os
import subprocess
import sys
import time
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil
import zarr

sys.path.insert(0, str(Path(__file__).parents[1]))
from commands import STEREOCELL, make_sample, plan
from machine import stated
from reading import (
    CHANNELS,
    MAX_READ,
    REAL,
    REGION,
    measure_reading,
    measure_survey,
    measure_windows,
    print_reading,
    print_whole,
    stored,
)

from stereocell.building.out_folder import OutFolder
from stereocell.model.tiling import cut
from support.phantoms import write_ome_zarr
from support.worker_processes import workers_of

COUNTS = ((2, 2), (4, 2), (4, 4), (8, 4))  # columns x rows: 4 to 32 units
MANY, SMALLEST = ((8, 8), (16, 8), (16, 16), (32, 16)), (8, 32, 32)  # 64 to 512 units
TILES = len(cut(REGION, REAL))  # of the CyCIF dataset
WHOLE = TILES * CHANNELS  # units of the CyCIF dataset
PRICE = 0.04  # dollars for a core-hour: about what clouds ask for a core with 4 GB
GIB = 1024**3
MAX_GROWTH = 0.1  # largest relative growth of a process's peak memory with four times the tiles
MAX_BYTES = 2e9  # largest peak memory of the process that builds a unit of REAL

# Runs in a process of its own, which builds one unit and measures its own memory meanwhile.
WATCHED = """
import collections, json, sys, threading, time
from stereocell.cli.__main__ import main

def rss():
    return int(open("/proc/self/statm").read().split()[1]) * 4096

most, before, is_over = collections.defaultdict(int), rss(), False
me = threading.main_thread().ident
def watch():
    while not is_over:
        frame, place = sys._current_frames().get(me), "?"
        while frame is not None:
            name = frame.f_globals.get("__name__", "")
            if name.startswith("stereocell."):
                place = f"{name.removeprefix('stereocell.')}.{frame.f_code.co_name}"
                break
            frame = frame.f_back
        most[place] = max(most[place], rss())
        time.sleep(0.02)
thread = threading.Thread(target=watch)
thread.start()
code = main(sys.argv[1:])
is_over = True
thread.join()
status = open("/proc/self/status").read()  # what code that lets no thread look took as well
peak = int(status.split("VmHWM:")[1].split()[0]) * 1024
print(json.dumps({"code": code, "before": before, "most": most, "peak": peak}))
"""


@dataclass(frozen=True)
class Run:
    """A run of `stereocell units`: its seconds, and the peak memory of a "command" or "worker"."""

    units: int
    workers: int
    seconds: float
    peaks: dict[str, int]


def repeat_sample(folder: Path, grid: tuple[int, int], tile: tuple[int, int, int]) -> Path:
    """Return tiles that are copies of one, because different nuclei would change the cost."""
    path = folder / f"copies_{'_'.join(map(str, grid + tile))}.ome.zarr"
    if not path.exists():
        one: np.ndarray = zarr.open_array(make_sample(folder, (1, 1), tile) / "0")[0]  # type: ignore
        copies = np.tile(one, (1, grid[1], grid[0]))[None]
        made = folder / "half.ome.zarr"
        write_ome_zarr(made, [copies], "czyx", chunks=(1, 16, tile[1], tile[2]))
        made.rename(path)
    return path


def run_units(out: Path, workers: int) -> Run:
    """Build all units, and measure the processes meanwhile."""
    start = time.perf_counter()
    command = subprocess.Popen(
        [*STEREOCELL, "units", str(out), "--workers", str(workers)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    peaks: dict[str, int] = defaultdict(int)
    parent = psutil.Process(command.pid)
    while command.poll() is None:
        try:
            peaks["command"] = max(peaks["command"], _peak_of(command.pid))
            for process in workers_of(parent):
                peaks["worker"] = max(peaks["worker"], _peak_of(process.pid))
        except (psutil.Error, OSError):
            pass  # the process ended meanwhile
        time.sleep(0.2)
    if command.returncode:
        raise SystemExit(f"units {out}: ended with {command.returncode}")
    units = len(OutFolder(out).index())
    return Run(units, workers, time.perf_counter() - start, dict(peaks))


def measure_slope(
    folder: Path,
    tile: tuple[int, int, int],
    grids: tuple[tuple[int, int], ...] = COUNTS,
    on: tuple[int, ...] = (1, 2),
) -> list[Run]:
    source = repeat_sample(folder, grids[-1], tile)
    runs = []
    for workers in on:
        for grid in grids:
            out = folder / "slope"
            plan(str(source), out, grid, tile, "0")
            runs.append(run_units(out, workers))
            last = runs[-1]
            peaks = ", ".join(f"{role} {most / GIB:.3f}" for role, most in last.peaks.items())
            print(f"  {last.units:3} units  {workers} workers  {last.seconds:7.1f} s  "
                  f"{last.units / last.seconds:6.3f} units/s  peak, GiB: {peaks}",
                  flush=True)  # fmt: skip
    return runs


def print_slope(runs: list[Run]) -> list[float]:
    """Print costs per unit; return the growth of each peak for four times as many tiles."""
    growths = []
    for workers in (1, 2):
        own = {run.units: run for run in runs if run.workers == workers}
        slope, start = np.polyfit(list(own), [run.seconds for run in own.values()], 1)
        print(f"  {workers} workers: {start:.1f} s + {slope:.2f} s a unit; peaks grow")
        for few, many in ((4, 16), (8, 32)):
            grown = {
                role: most / own[few].peaks[role] - 1 for role, most in own[many].peaks.items()
            }
            growths += grown.values()
            by_role = ", ".join(f"{role} {growth:+.1%}" for role, growth in grown.items())
            print(f"    from {few} to {many} units: {by_role} (bound {MAX_GROWTH:+.0%})")
    return growths


def print_command(runs: list[Run]) -> None:
    """Print what the command keeps of a tile: evidence of one channel, until its level is known."""
    peaks = [run.peaks["command"] for run in runs]
    each, base = np.polyfit([run.units for run in runs], peaks, 1)
    most = (base + each * TILES) / GIB
    print(f"  the command keeps {each / 1e6:.3f} MB of a channel's tile, and {base / GIB:.3f} GiB: "
          f"{most:.2f} GiB with {TILES} tiles")  # fmt: skip


def watch_memory(out: Path) -> dict[str, int]:
    """Build OUT's one unit in a process that measures itself; return peak bytes by function."""
    answer = subprocess.run(
        [sys.executable, "-c", WATCHED, "units", str(out), "--workers", "0"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    seen = json.loads(answer.stdout.splitlines()[-1])
    libraries = {"(interpreter and libraries)": seen["before"]}
    return {"(the process)": seen["peak"], **libraries, **seen["most"]}


def _peak_of(pid: int) -> int:
    for line in Path(f"/proc/{pid}/status").read_text("utf-8").splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) * 1024
    return 0


def main(folder: Path, tile: tuple[int, int, int]) -> int:
    folder.mkdir(parents=True, exist_ok=True)
    print(f"Slope, tiles of {' x '.join(map(str, tile))}, one channel, {os.cpu_count()} cores")
    growths = print_slope(measure_slope(folder, tile))

    print(f"The command's memory, tiles of {' x '.join(map(str, SMALLEST))}, 2 workers")
    print_command(measure_slope(folder, SMALLEST, MANY, (2,)))

    source, out = make_sample(folder, (1, 1), REAL), folder / "real"
    reading, survey = measure_reading(folder, tile), measure_survey(folder, tile)
    windows = measure_windows(folder, source)
    print_reading(reading, survey, windows)

    print(f"A unit of {' x '.join(map(str, REAL))}")
    plan(str(source), out, (1, 1), REAL, "0")
    start = time.perf_counter()
    seen = watch_memory(out)
    seconds = time.perf_counter() - start
    size = sum(file.stat().st_size for file in (out / "units").rglob("*") if file.is_file())
    print(f"  {seconds:.0f} s; most memory while this ran, GiB (bound {MAX_BYTES / GIB:.2f}):")
    for place, most in sorted(seen.items(), key=lambda item: -item[1])[:8]:
        print(f"    {most / GIB:5.2f}  {place}")

    hours = seconds * WHOLE / 3600
    print(f"{WHOLE} units of that size, without stage, bundle and report: {hours:.0f} core-hours, "
          f"{WHOLE * size / 1e12:.2f} TB of units written, "
          f"{hours * PRICE:.0f} dollars at {PRICE} a core-hour")  # fmt: skip
    settled = OutFolder(out).plan()
    voxel = stored(source, settled.region) / math.prod(settled.region.shape)
    print_whole(reading, survey, windows, voxel, settled.halo)

    kept = {
        "peaks": max(growths) <= MAX_GROWTH,
        "reading": max(reading.chunks, survey.chunks, windows) <= MAX_READ,
        "memory": max(seen.values()) <= MAX_BYTES,
    }
    for name, is_kept in kept.items():
        print(f"Bound of {name}: {'kept' if is_kept else 'NOT KEPT'}")
    return 0 if all(kept.values()) else 1


if __name__ == "__main__":
    with stated():
        given = tuple(int(n) for n in (sys.argv[2] if len(sys.argv) > 2 else "48,96,96").split(","))
        sys.exit(main(Path(sys.argv[1]), given))  # type: ignore[arg-type]
