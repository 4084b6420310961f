"""Measure time, memory and reads of units, and estimate them for the whole dataset.

    python scale.py FOLDER [TILE] [--publish]      TILE: z,y,x voxels of the slope's tiles

Runs with 4 to 32 equal small tiles show how time and memory grow with the number of tiles. Hundreds
of tiny tiles show how much memory the command keeps for each. One tile of 194 x 512 x 512 voxels,
full of nuclei, shows the cost of a real tile. Noise and a sponge show that of the worst tiles (see
one_unit.py). All takes half an hour. Samples and builds stay in FOLDER and are made once. Exits
with 1 if a bound is exceeded. With `--publish`, the figures replace those of docs/benchmarks.md.

The dataset's figures cover its units, which are nearly all of the work, but not its stage, bundle
and report. reading.py estimates the reads.
"""

import argparse
import math
import os
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import zarr

sys.path.insert(0, str(Path(__file__).parents[1]))
from commands import make_sample, plan
from machine import range_of, stated
from one_unit import GOAL_PASSES, GOAL_TIMES, MAX_BYTES, Unit, measure_dense, measure_noisy
from phases import Cost, watch
from published import publish
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
    reading_rows,
    stored,
)

from stereocell.building.out_folder import OutFolder
from stereocell.model.tiling import cut
from support.phantoms import write_ome_zarr

COUNTS = ((2, 2), (4, 2), (4, 4), (8, 4))  # columns x rows: 4 to 32 units
MANY, SMALLEST = ((8, 8), (16, 8), (16, 16), (32, 16)), (8, 32, 32)  # 64 to 512 units
TILES = len(cut(REGION, REAL))  # of the CyCIF dataset
WHOLE = TILES * CHANNELS  # units of the CyCIF dataset
DENSE = "a unit of 194 x 512 x 512, full of nuclei, with all earlier passes in the same process"
PRICE = 0.04  # dollars for a core-hour: about what clouds ask for a core with 4 GB
GIB = 1024**3
MAX_GROWTH = 0.1  # largest relative growth of a process's peak memory with four times the tiles


@dataclass(frozen=True)
class Run:
    """A run of `stereocell units`."""

    units: int
    workers: int
    cost: Cost


@dataclass(frozen=True)
class Slope:
    """How the cost of units grows with their number, for one number of workers.

    seconds     time of no units, and of one more
    references  CPU time of one more, in units of the reference kernel
    growths     relative growth of the peak memory by role, for four times as many tiles, twice
    """

    workers: int
    seconds: tuple[float, float]
    references: float
    growths: tuple[dict[str, float], dict[str, float]]


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
    cost = watch(["units", str(out), "--workers", str(workers)])
    return Run(len(OutFolder(out).index()), workers, cost)


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
            peaks = ", ".join(f"{role} {most / GIB:.3f}" for role, most in last.cost.peaks.items())
            print(f"  {last.units:3} units  {workers} workers  {last.cost}   peak, GiB: {peaks}",
                  flush=True)  # fmt: skip
    return runs


def find_slopes(runs: list[Run]) -> list[Slope]:
    """Return and print costs per unit, and the growth of each peak for four times as many tiles."""
    slopes = []
    for workers in (1, 2):
        own = {run.units: run.cost for run in runs if run.workers == workers}
        more, start = np.polyfit(list(own), [cost.seconds for cost in own.values()], 1)
        references, _ = np.polyfit(list(own), [cost.references for cost in own.values()], 1)
        few, many = (
            {role: most / own[a].peaks[role] - 1 for role, most in own[b].peaks.items()}
            for a, b in ((4, 16), (8, 32))
        )
        slopes.append(Slope(workers, (float(start), float(more)), float(references), (few, many)))
        print(f"  {workers} workers: {start:.1f} s + {more:.2f} s a unit, of {references:.1f} "
              "references of CPU; peaks grow")  # fmt: skip
        for name, growth in (("from 4 to 16", few), ("from 8 to 32", many)):
            by_role = ", ".join(f"{role} {share:+.1%}" for role, share in growth.items())
            print(f"    {name} units: {by_role} (bound {MAX_GROWTH:+.0%})")
    return slopes


def command_memory(runs: list[Run]) -> float:
    """Return the bytes that the command keeps of a tile, and print them.

    They are the evidence of one channel, which is kept until its iso-value is known.
    """
    peaks = [run.cost.peaks["command"] for run in runs]
    each, base = np.polyfit([run.units for run in runs], peaks, 1)
    most = (base + each * TILES) / GIB
    print(f"  the command keeps {each / 1e6:.3f} MB of a channel's tile, and {base / GIB:.3f} GiB: "
          f"{most:.2f} GiB with {TILES} tiles")  # fmt: skip
    return float(each)


def whole_dataset(dense: Unit) -> float:
    """Return the core-hours of all units of the dataset, if each costs what the dense one does."""
    return dense.cpu * WHOLE / 3600


def rows_of(
    slopes: list[Slope], many: list[Run], each: float, dense: Unit, noisy: dict[str, Unit]
) -> list[list[str]]:
    """Return the rows of the published table that have no reads."""
    grown = {
        role: " and ".join(
            f"{max(slope.growths[k].get(role, 0.0) for slope in slopes):+.0%}" for k in (0, 1)
        )
        for role in ("worker", "command")
    }
    one, two = slopes
    counts = ", ".join(str(run.units) for run in many)
    kept = ", ".join(f"{run.cost.peaks['command'] / 1e6:.0f}" for run in many)
    return [
        [
            "peak of a process, from 4 to 16 and from 8 to 32 small units",
            f"a worker {grown['worker']} at most, the command {grown['command']} "
            f"(bound {MAX_GROWTH:.0%})",
        ],
        [
            f"the command's peak, {counts} of the smallest tiles of one channel, 2 workers",
            f"{kept} MB: {each / 1e6:.2f} MB a tile",
        ],
        [
            "4 to 32 small units, 1 and 2 workers",
            f"{one.seconds[0]:.0f} s + {one.seconds[1]:.1f} s a unit, and {two.seconds[0]:.0f} s + "
            f"{two.seconds[1]:.1f} s; {one.references:.1f} and {two.references:.1f} references a "
            "unit",
        ],
        [
            DENSE,
            f"{dense.peak / 1e9:.2f} GB (bound {MAX_BYTES / 1e9:g})",
        ],
        [
            "the same, CPU of all passes",
            f"{dense.cpu:.1f} s: {dense.references:.0f} references, or {dense.passes(REAL):.1f} "
            f"Gaussian passes over its voxels (goal {GOAL_PASSES})",
        ],
        *(
            [
                f"{name} instead of nuclei",
                f"{unit.references / dense.references:.1f} x the CPU (goal {GOAL_TIMES}), "
                f"{unit.peak / 1e9:.2f} GB",
            ]
            for name, unit in noisy.items()
        ),
        [
            f"all {WHOLE:,} units of the whole dataset, if each costs as much as these nuclei",
            f"{whole_dataset(dense):.0f} core-hours",
        ],
    ]


def main(folder: Path, tile: tuple[int, int, int], is_published: bool) -> int:
    folder.mkdir(parents=True, exist_ok=True)
    print(f"Slope, tiles of {' x '.join(map(str, tile))}, one channel, {os.cpu_count()} cores")
    runs = measure_slope(folder, tile)
    slopes = find_slopes(runs)

    print(f"The command's memory, tiles of {' x '.join(map(str, SMALLEST))}, 2 workers")
    many = measure_slope(folder, SMALLEST, MANY, (2,))
    each = command_memory(many)

    source, out = make_sample(folder, (1, 1), REAL), folder / "real"
    reading, survey = measure_reading(folder, tile), measure_survey(folder, tile)
    windows = measure_windows(folder, source)
    print_reading(reading, survey, windows)

    dense = measure_dense(folder)
    size = sum(file.stat().st_size for file in (out / "units").rglob("*") if file.is_file())
    noisy = measure_noisy(folder, dense)

    hours = whole_dataset(dense)
    print(f"{WHOLE} units of that size, without stage, bundle and report: {hours:.0f} core-hours, "
          f"{WHOLE * size / 1e12:.2f} TB of units written, "
          f"{hours * PRICE:.0f} dollars at {PRICE} a core-hour")  # fmt: skip
    settled = OutFolder(out).plan()
    voxel = stored(source, settled.region) / math.prod(settled.region.shape)
    print_whole(reading, survey, windows, voxel, settled.halo)

    if is_published:
        rows = rows_of(slopes, many, each, dense, noisy) + reading_rows(reading, survey, windows)
        costs = [*(run.cost for run in runs + many), dense, *noisy.values()]
        publish("scale", "Growth and bounds", ("measured", "figure"), rows, range_of(costs))
    growths = [share for slope in slopes for few in slope.growths for share in few.values()]
    kept = {
        "peaks": max(growths) <= MAX_GROWTH,
        "reading": max(reading.chunks, survey.chunks, windows) <= MAX_READ,
        "memory": dense.peak <= MAX_BYTES,
    }
    for name, is_kept in kept.items():
        print(f"Bound of {name}: {'kept' if is_kept else 'NOT KEPT'}")
    return 0 if all(kept.values()) else 1


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("tile", nargs="?", default="48,96,96")
    parser.add_argument("--publish", action="store_true", help="put the figures into the docs")
    given = parser.parse_args()
    with stated():
        shape = tuple(map(int, given.tile.split(",")))
        sys.exit(main(given.folder, shape, given.publish))  # type: ignore[arg-type]
