"""What units cost in time, memory and bytes read, and what the whole dataset would.

    python scale.py FOLDER [TILE]      TILE: z,y,x voxels of the slope's tiles

Small tiles, 4 to 32 of them, all alike, tell how time and memory grow with their number; one of
194 x 512 x 512, full of nuclei, tells what a real one takes: a quarter of an hour in all. Samples
and builds stay in FOLDER: they are made once. Ends with 1 where a bound is not kept.

The dataset's figures are those of its units, which nearly all of the work is. Its stage, bundle and
report are not in them.
"""

import itertools
import json
import os
import shutil
import subprocess
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import psutil
import zarr

sys.path.insert(0, str(Path(__file__).parents[1]))
from phantoms import write_ome_zarr
from stereocell import plan_file
from stereocell.store import Store

STEREOCELL = (sys.executable, "-m", "stereocell.cli")
GRID = (8, 4)  # columns x rows of the slope's sample
COUNTS = {4: (2, 2), 8: (4, 2), 16: (4, 4), 32: (8, 4)}  # units: columns x rows
REAL = (194, 512, 512)
WHOLE = 242 * 70  # units of the CyCIF dataset
PRICE = 0.04  # dollars for a core-hour: about what clouds ask for a core with 4 GB
GIB = 1024**3
MOST_READ = 1.3  # bytes read over those of the chunks that a unit's window touches
MOST_GROWTH = 0.1  # of a process's peak, from some tiles to four times as many
MOST_BYTES = 3.5e9  # of the process that builds a unit of REAL

# Run in a process of its own, which builds one unit and looks at itself meanwhile
WATCHED = """
import collections, json, sys, threading, time
from stereocell.cli import main

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
print(json.dumps({"code": code, "before": before, "most": most}))
"""


@dataclass(frozen=True)
class Run:
    """A run of `stereocell units`: its seconds, and the most memory that a process had, by what it
    does: "command", "worker"."""

    units: int
    workers: int
    seconds: float
    peaks: dict[str, int]


def make_sample(folder: Path, grid: tuple[int, int], tile: tuple[int, int, int]) -> Path:
    path = folder / f"{grid[0]}x{grid[1]}_{'_'.join(map(str, tile))}.ome.zarr"
    size, tiles = ",".join(map(str, tile)), f"{grid[0]}x{grid[1]}"
    _call("sample", "cycif", str(path), "--grid", tiles, "--tile-size", size)
    return path


def repeat_sample(folder: Path, tile: tuple[int, int, int]) -> Path:
    """Return GRID's tiles, copies of one: its nuclei, whose sizes would tell of themselves."""
    path = folder / "copies.ome.zarr"
    if not path.exists():
        one: np.ndarray = zarr.open_array(make_sample(folder, (1, 1), tile) / "0")[0]  # type: ignore
        copies = np.tile(one, (1, GRID[1], GRID[0]))[None]
        made = folder / "half.ome.zarr"
        write_ome_zarr(made, [copies], "czyx", chunks=(1, 16, tile[1], tile[2]))
        made.rename(path)
    return path


def plan(
    source: str, out: Path, grid: tuple[int, int], tile: tuple[int, int, int], channels: str
) -> None:
    """Plan the first columns x rows of tiles."""
    shutil.rmtree(out, ignore_errors=True)
    depth, height, width = tile
    region = f"0:{depth},0:{grid[1] * height},0:{grid[0] * width}"
    size = ",".join(map(str, tile))
    _call("plan", source, "-o", str(out), "--preset", "cycif", "--level", "0",
          "--region", region, "--tile-size", size, "--channels", channels)  # fmt: skip


def run_units(out: Path, workers: int) -> Run:
    """Build all units, and look at the processes meanwhile."""
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
            for process in parent.children(recursive=True):
                if "spawn_main" in " ".join(process.cmdline()):
                    peaks["worker"] = max(peaks["worker"], _peak_of(process.pid))
        except (psutil.Error, OSError):
            pass  # it ended while it was looked at
        time.sleep(0.2)
    if command.returncode:
        raise SystemExit(f"units {out}: ended with {command.returncode}")
    units = len(Store(out).index())
    return Run(units, workers, time.perf_counter() - start, dict(peaks))


def measure_slope(folder: Path, tile: tuple[int, int, int]) -> list[Run]:
    source = repeat_sample(folder, tile)
    runs = []
    for workers in (1, 2):
        for columns, rows in COUNTS.values():
            out = folder / "slope"
            plan(str(source), out, (columns, rows), tile, "0")
            runs.append(run_units(out, workers))
            last = runs[-1]
            peaks = ", ".join(f"{role} {most / GIB:.3f}" for role, most in last.peaks.items())
            print(f"  {last.units:3} units  {workers} workers  {last.seconds:7.1f} s  "
                  f"{last.units / last.seconds:6.3f} units/s  peak, GiB: {peaks}",
                  flush=True)  # fmt: skip
    return runs


def print_slope(runs: list[Run]) -> list[float]:
    """Return by how much each process's peak grew from some tiles to four times as many."""
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
            told = ", ".join(f"{role} {growth:+.1%}" for role, growth in grown.items())
            print(f"    from {few} to {many} units: {told} (bound {MOST_GROWTH:+.0%})")
    return growths


def watch_memory(out: Path) -> dict[str, int]:
    """Build OUT's one unit in a process that watches itself; return most bytes by function."""
    answer = subprocess.run(
        [sys.executable, "-c", WATCHED, "units", str(out), "--workers", "0"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    seen = json.loads(answer.stdout.splitlines()[-1])
    return {"(interpreter and libraries)": seen["before"], **seen["most"]}


@contextmanager
def counting(folder: Path) -> Iterator[tuple[str, dict[str, int]]]:
    """Serve a folder; count the bytes of each file that were sent."""
    sent: dict[str, int] = defaultdict(int)
    lock = threading.Lock()

    class Handler(SimpleHTTPRequestHandler):
        def copyfile(self, source: object, outputfile: object) -> None:
            file = Path(self.translate_path(self.path))
            with lock:
                sent[str(file)] += file.stat().st_size
            super().copyfile(source, outputfile)  # type: ignore[arg-type]

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}", sent
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@dataclass(frozen=True)
class Reading:
    """Bytes that builds read, as they are stored.

    ratio   a unit's, over those of the chunks that its window touches
    voxel   a voxel's
    survey  for windows and iso-values, for each voxel of a unit
    check   what a command reads to see that the source is the one that was planned (64 MB at most)
    """

    ratio: float
    voxel: float
    survey: float
    check: int


def measure_reading(folder: Path, tile: tuple[int, int, int]) -> Reading:
    source = make_sample(folder, (3, 3), tile)
    out = folder / "reading"
    with counting(source.parent) as (address, sent):

        def bytes_read() -> int:
            return sum(size for file, size in sent.items() if not file.endswith(".json"))

        def run(unit: str) -> int:
            sent.clear()
            _call("units", str(out), "--workers", "0", "--only", unit)
            return bytes_read()

        plan(f"{address}/{source.name}", out, (3, 3), tile, "0")
        check = bytes_read()  # a plan reads nothing else
        first = run("r0_c0/0")  # windows and iso-values of all nine, and one unit
        middle = run("r1_c1/0")  # it has neighbours all round
    corner, chunks = (list(touched_chunks(source, out, tile)) for tile in ("r0_c0", "r1_c1"))
    size = sum(file.stat().st_size for file in chunks)
    voxels = len(chunks) * np.prod(zarr.open_array(source / "0", mode="r").chunks)
    survey = first - check - sum(file.stat().st_size for file in corner)
    return Reading(
        ratio=(middle - check) / size,
        voxel=float(size / voxels),
        survey=float(survey / 9 / np.prod(tile)),
        check=check,
    )


def touched_chunks(source: Path, out: Path, tile_id: str) -> Iterator[Path]:
    """Yield the files of the first channel's chunks that a unit's window touches, by the plan."""
    settled = plan_file.from_json(json.loads((out / "plan.json").read_text()))
    window = settled.tile(tile_id).lattice(settled.region).grown(settled.halo, settled.region)
    array = zarr.open_array(source / "0", mode="r")
    along = [
        range(low // chunk, (high - 1) // chunk + 1)
        for low, high, chunk in zip(window.start, window.stop, array.chunks[1:], strict=True)
    ]
    for place in itertools.product([0], *along):
        file = source / "0" / array.metadata.encode_chunk_key(place)
        if file.exists():  # one of nothing but the fill value is not stored
            yield file


def _peak_of(pid: int) -> int:
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) * 1024
    return 0


def _call(*arguments: str) -> None:
    done = subprocess.run([*STEREOCELL, *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr)


def main(folder: Path, tile: tuple[int, int, int]) -> int:
    folder.mkdir(parents=True, exist_ok=True)
    print(f"Slope, tiles of {' x '.join(map(str, tile))}, one channel, {os.cpu_count()} cores")
    growths = print_slope(measure_slope(folder, tile))

    reading = measure_reading(folder, tile)
    print(f"Read by a unit: {reading.ratio:.2f} x the chunks that its window touches (bound "
          f"{MOST_READ}); for windows and iso-values {reading.survey:.2f} bytes a voxel; by a "
          f"command, to see that the source is the same, {reading.check / 1e6:.1f} MB")  # fmt: skip

    print(f"A unit of {' x '.join(map(str, REAL))}")
    source, out = make_sample(folder, (1, 1), REAL), folder / "real"
    plan(str(source), out, (1, 1), REAL, "0")
    start = time.perf_counter()
    seen = watch_memory(out)
    seconds = time.perf_counter() - start
    size = sum(file.stat().st_size for file in (out / "units").rglob("*") if file.is_file())
    print(f"  {seconds:.0f} s; most memory while this ran, GiB (bound {MOST_BYTES / GIB:.2f}):")
    for place, most in sorted(seen.items(), key=lambda item: -item[1])[:8]:
        print(f"    {most / GIB:5.2f}  {place}")

    hours = seconds * WHOLE / 3600
    halo = plan_file.from_json(json.loads((out / "plan.json").read_text())).halo
    window = (REAL[0], REAL[1] + 2 * halo[1], REAL[2] + 2 * halo[2])  # of one with neighbours
    read = reading.ratio * reading.voxel * np.prod(window) + reading.survey * np.prod(REAL)
    print(f"{WHOLE} units of that size, without stage, bundle and report: {hours:.0f} core-hours, "
          f"{WHOLE * read / 1e12:.2f} TB read (windows of {' x '.join(map(str, window))}), "
          f"{WHOLE * size / 1e12:.2f} TB of units written, "
          f"{hours * PRICE:.0f} dollars at {PRICE} a core-hour")  # fmt: skip

    kept = {
        "peaks": max(growths) <= MOST_GROWTH,
        "reading": reading.ratio <= MOST_READ,
        "memory": max(seen.values()) <= MOST_BYTES,
    }
    for name, is_kept in kept.items():
        print(f"Bound of {name}: {'kept' if is_kept else 'NOT KEPT'}")
    return 0 if all(kept.values()) else 1


if __name__ == "__main__":
    given = tuple(int(n) for n in (sys.argv[2] if len(sys.argv) > 2 else "48,96,96").split(","))
    sys.exit(main(Path(sys.argv[1]), given))  # type: ignore[arg-type]
