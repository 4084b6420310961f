"""Measure the paper's whole scene, ten tiles and three channels, by 1, 2 workers or a cluster.

    python scene.py FOLDER [GRID [TILE [WAYS]]] [--publish]

GRID: columns x rows (5x2). TILE: z,y,x voxels (194,512,512). WAYS: any of 1, 2 and `cluster`,
separated by commas (all). With `--publish` the cost by two workers replaces that of
docs/benchmarks.md. The sample is made once (300 MB). It stays in FOLDER, like the last build.

Prints seconds and CPU seconds of each phase, and the peak memory of the command and of a worker.
Then it prints the build's size on disk by kind and level of detail, and the bytes that a viewer
reads before the first picture. Last come the triangles and bytes that the viewer draws and holds
while the gaze moves over all tiles. Exits with 1 if two ways gave different bytes, or the gaze
missed a tile.
"""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

import psutil

sys.path.insert(0, str(Path(__file__).parents[1]))
from commands import make_sample
from machine import range_of, stated
from phases import COLUMNS, MB, Cost, rows_of, run_phases
from published import publish

from stereocell.formats.vdb import MEASURED_NAME
from stereocell.formats.vdb_read import read_vdb_head
from stereocell.storage.json_files import read_json
from support.clusters import running_cluster
from support.digests import digests_of_build

GRID, TILE = (5, 2), (194, 512, 512)
WAYS = ("1", "2", "cluster")
CLUSTER_WORKERS = 2


def build(source: Path, out: Path, grid: tuple[int, int], way: str) -> dict[str, Cost]:
    """Build OUT in one of the ways; return the cost of each phase."""
    columns, rows = grid
    plan = [str(source), "--preset", "cycif", "--level", "0", "--grid", f"{columns}x{rows}"]
    if way == "cluster":
        with running_cluster(out.parent, CLUSTER_WORKERS) as cluster:
            workers = [psutil.Process(process.pid) for process in cluster.workers]
            return run_phases(out, plan, ["--scheduler", cluster.file], workers)
    return run_phases(out, plan, ["--workers", way])


def print_sizes(out: Path) -> None:
    """Print the size of the build, and the part of it that matters on a phone."""
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
        counts = " ".join(f"{n:,}" for n in one["triangles"])
        print(f"  {one['name']}: triangles by level {counts}")


def walk_over(bundle: Path) -> bool:
    """Print what the viewer holds while the gaze moves; return whether it reached all tiles."""
    if shutil.which("npm") is None:
        print("  no walk: no node and npm")
        return True
    command = ["npm", "run", "--silent", "bench-walk", "--", str(bundle.resolve())]
    viewer = Path(__file__).parents[2] / "viewer_gltf"
    return subprocess.run(command, cwd=viewer, check=False).returncode == 0


def _bytes(*files: Path) -> int:
    return sum(file.stat().st_size for file in files if file.is_file())


def main(
    folder: Path,
    grid: tuple[int, int],
    tile: tuple[int, int, int],
    ways: tuple[str, ...],
    is_published: bool,
) -> int:
    folder.mkdir(parents=True, exist_ok=True)
    source, out = make_sample(folder, grid, tile), folder / "scene"
    digests: dict[str, dict[str, str]] = {}
    for way in ways:
        shutil.rmtree(out, ignore_errors=True)
        name = f"{way} on this machine" if way != "cluster" else f"a cluster of {CLUSTER_WORKERS}"
        print(f"{grid[0]} x {grid[1]} tiles of {' x '.join(map(str, tile))}, workers: {name}")
        costs = build(source, out, grid, way)
        if is_published and way == "2":
            around = f"by two workers, {range_of([*costs.values()])}"
            publish("scene", "Phases of the build", COLUMNS, rows_of(costs), around)
        digests[way] = digests_of_build(out)
    print_sizes(out)
    first, *others = digests.values()
    are_same = all(first == other for other in others)
    print(f"Same bytes by {', '.join(digests)}: {'yes' if are_same else 'NO'}", flush=True)
    return 0 if walk_over(out / "bundle") and are_same else 1


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("grid", nargs="?", default="x".join(map(str, GRID)))
    parser.add_argument("tile", nargs="?", default=",".join(map(str, TILE)))
    parser.add_argument("ways", nargs="?", default=",".join(WAYS))
    parser.add_argument("--publish", action="store_true", help="put the figures into the docs")
    given = parser.parse_args()
    with stated():
        columns, rows = map(int, given.grid.split("x"))
        z, y, x = map(int, given.tile.split(","))
        ways = tuple(given.ways.split(","))
        sys.exit(main(given.folder, (columns, rows), (z, y, x), ways, given.publish))
