"""Measure what many small units cost: up to 22 x 11 tiles of 64^3 voxels, four channels.

    python breadth.py FOLDER [GRIDS] [--publish]

GRIDS: columns x rows, as 4x2,8x4 (up to 22x11). With `--publish` the figures replace those of
docs/benchmarks.md.

All grids are cut from one sample, made once (510 MB of voxels). It has the stains of `sample cycif`
and the mirrored nuclei as another channel. For each number of units, the bench prints the cost of
each phase. It also prints the CPU time that one more unit costs, and the growth of the memory
peaks of the command and of a worker.
"""

import argparse
import shutil
import sys
from pathlib import Path

import numpy as np
import zarr

sys.path.insert(0, str(Path(__file__).parents[1]))
from commands import make_sample
from machine import range_of, stated
from phases import MB, PHASES, Cost, run_phases
from published import publish

from stereocell.building.out_folder import OutFolder
from support.phantoms import write_ome_zarr

TILE, WHOLE = (64, 64, 64), (22, 11)
GRIDS = ((4, 2), (8, 4), WHOLE)  # 32 to 968 units
WORKERS = "2"
# Columns of the published table after the phase
COLUMNS = ("s of CPU", "s a unit more", "references a unit more", "peaks, MB")


def make_source(folder: Path) -> Path:
    path = folder / "four_channels.ome.zarr"
    if not path.exists():
        stains: np.ndarray = zarr.open_array(make_sample(folder, WHOLE, TILE) / "0")[:]  # type: ignore
        four = np.concatenate([stains, stains[:1, :, :, ::-1]])
        labels = ("Hoechst", "MART1", "CD31", "mirrored")
        half = folder / "half.ome.zarr"
        write_ome_zarr(
            half, [four], "czyx", chunks=(1, *TILE), channels=[{"label": each} for each in labels]
        )
        half.rename(path)
    return path


def slope_rows(runs: dict[int, dict[str, Cost]]) -> list[list[str]]:
    """Print what one more unit costs in each phase, and return the rows of the published table."""
    units, rows = list(runs), []
    for phase in PHASES:
        costs = [each[phase] for each in runs.values()]
        more, start = np.polyfit(units, [cost.cpu for cost in costs], 1)
        references, _ = np.polyfit(units, [cost.references for cost in costs], 1)
        peaks = [
            f"{role} {', '.join(f'{cost.peaks[role] / MB:.0f}' for cost in costs)}"
            for role in costs[-1].peaks
        ]
        print(f"  {phase:7}{start:6.1f} s + {more:.3f} s ({references:.2f} references) a unit, "
              f"of CPU   peaks, MB: {'; '.join(peaks)}")  # fmt: skip
        spent = ", ".join(f"{cost.cpu:.0f}" for cost in costs)
        rows.append([phase, spent, f"{more:.2f}", f"{references:.1f}", "; ".join(peaks)])
    return rows


def main(folder: Path, grids: tuple[tuple[int, int], ...], is_published: bool) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    source, runs = make_source(folder), dict[int, dict[str, Cost]]()
    for columns, rows in grids:
        out = folder / f"{columns}x{rows}"
        shutil.rmtree(out, ignore_errors=True)
        region = f"0:{TILE[0]},0:{rows * TILE[1]},0:{columns * TILE[2]}"
        plan = [str(source), "--preset", "cycif", "--level", "0", "--region", region]
        plan += ["--tile-size", ",".join(map(str, TILE))]
        print(f"{columns} x {rows} tiles of {' x '.join(map(str, TILE))}, 4 channels")
        costs = run_phases(out, plan, ["--workers", WORKERS])
        units = len(OutFolder(out).index())
        print(f"  {units} units")
        runs[units] = costs
    print(f"By {', '.join(map(str, runs))} units, {WORKERS} workers")
    rows = slope_rows(runs)
    if is_published:
        columns = [f"{', '.join(map(str, runs))} units", *COLUMNS]
        costs = [cost for each in runs.values() for cost in each.values()]
        around = f"by two workers, {range_of(costs)}"
        publish("breadth", "Phases by number of units", columns, rows, around)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("grids", nargs="?", default=",".join(f"{x}x{y}" for x, y in GRIDS))
    parser.add_argument("--publish", action="store_true", help="put the figures into the docs")
    given = parser.parse_args()
    pairs = (each.split("x") for each in given.grids.split(","))
    with stated():
        main(given.folder, tuple((int(x), int(y)) for x, y in pairs), given.publish)
