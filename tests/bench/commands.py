"""Make samples and plans, and run the command, for benchmarks that build."""

import shutil
import subprocess
import sys
from pathlib import Path

STEREOCELL = (sys.executable, "-m", "stereocell.cli")


def make_sample(folder: Path, grid: tuple[int, int], tile: tuple[int, int, int]) -> Path:
    path = folder / f"{grid[0]}x{grid[1]}_{'_'.join(map(str, tile))}.ome.zarr"
    size, tiles = ",".join(map(str, tile)), f"{grid[0]}x{grid[1]}"
    call("sample", "cycif", str(path), "--grid", tiles, "--tile-size", size)
    return path


def plan(
    source: str, out: Path, grid: tuple[int, int], tile: tuple[int, int, int], channels: str
) -> None:
    """Plan the first columns x rows of tiles."""
    shutil.rmtree(out, ignore_errors=True)
    depth, height, width = tile
    region = f"0:{depth},0:{grid[1] * height},0:{grid[0] * width}"
    size = ",".join(map(str, tile))
    call("plan", source, "-o", str(out), "--preset", "cycif", "--level", "0",
          "--region", region, "--tile-size", size, "--channels", channels)  # fmt: skip


def call(*arguments: str) -> None:
    done = subprocess.run([*STEREOCELL, *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr)
