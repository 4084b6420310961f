"""Measure what many small units cost: up to 22 x 11 tiles of 64^3 voxels, four channels.

    python breadth.py FOLDER [GRIDS]      GRIDS: columns x rows, as 4x2,8x4 (up to 22x11)

All grids are cut from one sample, made once (510 MB of voxels). It has the stains of `sample cycif`
and the mirrored nuclei as another channel. For each number of units, the bench prints the cost of
each phase. It also prints the CPU seconds that one more unit costs, and the growth of the memory
peaks of the command and of a worker.
"""

import shutil
import sys
from pathlib import Path

import numpy as np
import zarr

sys.path.insert(0, str(Path(__file__).parents[1]))
from commands import make_sample
from machine import stated
from phases import MB, PHASES, Cost, run_phases

from stereocell.building.out_folder import OutFolder
from support.phantoms import write_ome_zarr

TILE, WHOLE = (64, 64, 64), (22, 11)
GRIDS = ((4, 2), (8, 4), WHOLE)  # 32 to 968 units
WORKERS = "2"


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


def print_slopes(runs: dict[int, dict[str, Cost]]) -> None:
    units = list(runs)
    for phase in PHASES:
        each, start = np.polyfit(units, [costs[phase].cpu for costs in runs.values()], 1)
        peaks = [costs[phase].peaks for costs in runs.values()]
        grown = ", ".join(
            f"{role} {' '.join(f'{peak[role] / MB:.0f}' for peak in peaks)}" for role in peaks[-1]
        )
        print(f"  {phase:7}{start:6.1f} s + {each:.3f} s a unit, of CPU   peaks, MB: {grown}")


def main(folder: Path, grids: tuple[tuple[int, int], ...]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    source, runs = make_source(folder), dict[int, dict[str, Cost]]()
    for columns, rows in grids:
        out = folder / f"{columns}x{rows}"
        shutil.rmtree(out, ignore_errors=True)
        region = f"0:{TILE[0]},0:{rows * TILE[1]},0:{columns * TILE[2]}"
        plan = [str(source), "--preset", "cycif", "--level", "0", "--region", region]
        plan += ["--tile-size", ",".join(map(str, TILE))]
        print(f"{columns} x {rows} tiles of {' x '.join(map(str, TILE))}, 4 channels")
        costs = run_phases(out, plan, ["--workers", WORKERS], [])
        units = len(OutFolder(out).index())
        print(f"  {units} units")
        runs[units] = costs
    print(f"By {', '.join(map(str, runs))} units, {WORKERS} workers")
    print_slopes(runs)


if __name__ == "__main__":
    with stated():
        _, place, *given = sys.argv
        chosen = tuple(
            (int(columns), int(rows))
            for columns, rows in (each.split("x") for each in given[0].split(","))
        ) if given else GRIDS  # fmt: skip
        main(Path(place), chosen)
