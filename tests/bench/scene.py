"""The paper's scene from end to end: ten tiles, three channels, by 1 worker, 2, and a cluster.

    python scene.py FOLDER [GRID [TILE [WAYS]]]

GRID: columns x rows (5x2), TILE: z,y,x voxels (194,512,512), WAYS: of 1, 2 and `cluster`, with
commas between (all). The sample is made once (300 MB) and stays in FOLDER, as the last build does.

Prints seconds and CPU seconds of each phase, the most memory of the command and of a worker, what
the build takes on disk, by kind and level of detail, and what a viewer reads before the first
picture. Ends with 1 where two ways have not the same bytes.
"""

import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import psutil

sys.path.insert(0, str(Path(__file__).parents[1]))
from commands import STEREOCELL, make_sample

from stereocell.formats.vdb import MEASURED_NAME
from stereocell.formats.vdb_read import read_vdb_head
from stereocell.storage.json_files import read_json
from support.digests import digests_of
from support.worker_processes import workers_of

GRID, TILE = (5, 2), (194, 512, 512)
WAYS = ("1", "2", "cluster")
CLUSTER_WORKERS = 2
PHASES = ("plan", "units", "stage", "bundle", "report", "check")
COMPARED = ("stage", "bundle")
OFTEN_S = 0.2  # from one look at the processes to the next
MB = 1e6


@dataclass
class Cost:
    """What a command took: seconds, those of CPU, and the most bytes of a process by its role."""

    seconds: float = 0.0
    cpu: float = 0.0
    peaks: dict[str, int] = field(default_factory=lambda: defaultdict(int))


def watch(arguments: list[str], others: list[psutil.Process]) -> Cost:
    """Run a command to its end and look at its processes; `others` work for it."""
    cost, start = Cost(), time.perf_counter()
    before = sum(_cpu_of(other) for other in others)
    command = subprocess.Popen(
        [*STEREOCELL, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    parent, spent = psutil.Process(command.pid), dict[int, float]()
    while command.poll() is None:
        try:
            for process, role in [
                (parent, "command"),
                *((worker, "worker") for worker in (*workers_of(parent), *others)),
            ]:
                cost.peaks[role] = max(cost.peaks[role], process.memory_info().rss)
                if process not in others:
                    spent[process.pid] = _cpu_of(process)
        except psutil.Error:
            pass  # it ended while it was looked at
        time.sleep(OFTEN_S)
    if command.returncode and command.stderr is not None:
        raise SystemExit(f"{' '.join(arguments)}: {command.stderr.read()[-2000:]}")
    cost.seconds = time.perf_counter() - start
    cost.cpu = sum(spent.values()) + sum(_cpu_of(other) for other in others) - before
    return cost


def _cpu_of(process: psutil.Process) -> float:
    times = process.cpu_times()
    return float(times.user + times.system)


@contextmanager
def cluster(folder: Path) -> Iterator[tuple[Path, list[psutil.Process]]]:
    """Yield the file of a Dask scheduler of this machine, and its workers."""
    file = folder / "scheduler.json"
    file.unlink(missing_ok=True)
    told = ["--scheduler-file", str(file), "--no-dashboard"]
    started = [_start("scheduler", "--port", "0", *told)]
    started += [
        _start("worker", *told, "--nthreads", "1", "--no-nanny") for _ in range(CLUSTER_WORKERS)
    ]
    try:
        while not file.exists():
            time.sleep(OFTEN_S)
        yield file, [psutil.Process(process.pid) for process in started[1:]]
    finally:
        for process in started:
            process.terminate()
            process.wait()


def _start(kind: str, *told: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "dask", kind, *told]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def build(source: Path, out: Path, grid: tuple[int, int], way: str) -> dict[str, Cost]:
    """Build OUT in one of the ways; return what each phase took."""
    if way == "cluster":
        with cluster(out.parent) as (file, workers):
            return _run(source, out, grid, ["--scheduler", str(file)], workers)
    return _run(source, out, grid, ["--workers", way], [])


def _run(
    source: Path,
    out: Path,
    grid: tuple[int, int],
    how: list[str],
    workers: list[psutil.Process],
) -> dict[str, Cost]:
    columns, rows = grid
    costs = {}
    for phase in PHASES:
        arguments = [phase, str(out)]
        if phase == "plan":
            settled = ["--preset", "cycif", "--level", "0", "--grid", f"{columns}x{rows}"]
            arguments = ["plan", str(source), "-o", str(out), *settled]
        elif phase == "check":
            arguments += ["--deep", *how]
        elif phase != "report":
            arguments += how
        cost = costs[phase] = watch(arguments, workers)
        peaks = ", ".join(f"{role} {most / MB:.0f}" for role, most in cost.peaks.items())
        print(f"  {phase:7}{cost.seconds:8.1f} s {cost.cpu:8.1f} s of CPU   peak, MB: {peaks}",
              flush=True)  # fmt: skip
    return costs


def print_sizes(out: Path) -> None:
    """Print what the build takes, and of that what counts on a phone."""
    for part in ("units", "stage", "bundle", "report"):
        print(f"  {part:7}{_bytes(*(out / part).rglob('*')) / MB:9.1f} MB")
    grids = [grid for file in (out / "stage").rglob("*.vdb") for grid in read_vdb_head(file)]
    measured = sum(grid.end - grid.start for grid in grids if grid.name == MEASURED_NAME)
    print(f"  of the stage {measured / MB:.1f} MB are voxels as measured")
    bundle = out / "bundle"
    levels = sorted({file.name for file in bundle.glob("channels/*/*/lod*.glb")})
    print("  of the bundle " + ", ".join(
        f"{level.removesuffix('.glb')} {_bytes(*bundle.glob(f'channels/*/*/{level}')) / MB:.2f} MB"
        for level in levels
    ) + f", volumes {_bytes(*bundle.rglob('*.ktx2')) / MB:.1f} MB")  # fmt: skip
    manifest = read_json(bundle / "manifest.json", "bundle.schema.json", "")
    first = [bundle / "manifest.json", *bundle.glob(f"channels/*/*/{levels[-1]}")]
    first += [bundle / one["tileset"]["path"] for one in manifest["channels"] if one["tileset"]]
    print(f"  first picture, without the page {_bytes(*first) / MB:.2f} MB in {len(first)} files")
    for one in manifest["channels"]:
        told = " ".join(f"{n:,}" for n in one["triangles"])
        print(f"  {one['name']}: triangles by level {told}")


def _bytes(*files: Path) -> int:
    return sum(file.stat().st_size for file in files if file.is_file())


def main(
    folder: Path, grid: tuple[int, int], tile: tuple[int, int, int], ways: tuple[str, ...]
) -> int:
    folder.mkdir(parents=True, exist_ok=True)
    source, out = make_sample(folder, grid, tile), folder / "scene"
    digests: dict[str, dict[str, str]] = {}
    for way in ways:
        subprocess.run(["rm", "-rf", str(out)], check=True)
        name = f"{way} on this machine" if way != "cluster" else f"a cluster of {CLUSTER_WORKERS}"
        print(f"{grid[0]} x {grid[1]} tiles of {' x '.join(map(str, tile))}, workers: {name}")
        costs = build(source, out, grid, way)
        total = sum(cost.seconds for cost in costs.values())
        print(
            f"  in all {total / 60:.1f} minutes, {sum(c.cpu for c in costs.values()):.0f} s of CPU"
        )
        digests[way] = {
            f"{part}/{path}": digest
            for part in COMPARED
            for path, digest in digests_of(out / part).items()
        }
    print_sizes(out)
    first, *others = digests.values()
    are_same = all(first == other for other in others)
    print(f"Same bytes by {', '.join(digests)}: {'yes' if are_same else 'NO'}")
    return 0 if are_same else 1


if __name__ == "__main__":
    _, place, *given = sys.argv
    columns, rows = map(int, given[0].split("x")) if given else GRID
    z, y, x = map(int, given[1].split(",")) if len(given) > 1 else TILE
    chosen = tuple(given[2].split(",")) if len(given) > 2 else WAYS
    sys.exit(main(Path(place), (columns, rows), (z, y, x), chosen))
