"""Print the ratios of `make bench`: two calls timed in one run, medians of several rounds.

Machines are noisy, so a ratio within one run is more reliable than seconds. Seconds alone are
printed only where there is nothing to compare with. The bench never fails on a figure.
"""

import statistics
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy import ndimage
from skimage import measure

sys.path.insert(0, str(Path(__file__).parents[1]))
from machine import Spent, stated, timed, typical

from stereocell.building import phases
from stereocell.engine.run import Engine
from stereocell.filters import denoise
from stereocell.isosurface import extract, repair
from stereocell.isosurface.distance_field import signed_distance
from stereocell.meshes import simplify
from stereocell.model.lattice import Lattice
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.planning import settings as settings_module
from support.many_tiles import CHANNELS, COLUMNS, ROWS, open_unloaded, write_many
from support.phantoms import blurred_ball, write_ome_tiff

SPACING = (0.28, 0.14, 0.14)
ROUNDS = 5


def nuclei(shape: tuple[int, int, int], count: int, seed: int = 0) -> np.ndarray:
    """Return blurred balls on noise, float32 (z, y, x)."""
    rng = np.random.default_rng(seed)
    field = np.zeros(shape, np.float32)
    small = (24, 48, 48)
    ball = 1000 * blurred_ball(small, SPACING, (3.3, 3.3, 3.3), 2.4, 0.2)
    for corner in rng.integers(0, np.array(shape) - small, (count, 3)):
        part = tuple(slice(c, c + n) for c, n in zip(corner, small, strict=True))
        field[part] = np.maximum(field[part], ball)
    return (field + rng.normal(200, 30, shape)).astype(np.float32)


def compare(name: str, ours: Callable[[], object], peer: Callable[[], object], what: str) -> None:
    """Measure the CPU seconds of two calls alternately.

    Prints how many times as fast ours is, by the medians.
    """
    rounds: dict[str, list[Spent]] = {"ours": [], "peer": []}
    for _ in range(ROUNDS):
        for label, call in (("ours", ours), ("peer", peer)):
            with timed() as spent:
                call()
            rounds[label].append(spent)
    a, b = (typical(*rounds[label]) for label in ("ours", "peer"))
    print(f"{name:<34} {a}   {b.cpu / a.cpu:6.2f} x as fast as {what} ({b.cpu:.3f} s of CPU)")


def main() -> None:
    """Run all comparisons."""
    shape = (97, 256, 256)
    voxels = nuclei(shape, 150)
    volume = Volume(voxels, SPACING)
    region = Box((0, 0, 0), shape)
    field = denoise.smooth(volume, 0.14)
    distance = signed_distance(field, np.float32(700), spacing_um=SPACING, value_range=1000.0)
    print(f"phantom {shape}, {voxels.size / 1e6:.1f} M voxels; medians of {ROUNDS}")
    compare(
        "extract_surface",
        lambda: extract.extract_surface(distance, Lattice.of_whole(region, SPACING)),
        lambda: measure.marching_cubes(distance, 0.0, spacing=SPACING),
        "scikit-image's marching cubes",
    )
    options = repair.RepairOptions(0.56, 0.84, 1.1)
    solid = distance > 0

    def close_by_morphology() -> None:
        z, y, x = np.ogrid[-2:3, -4:5, -4:5]
        element = (z * 0.28) ** 2 + (y * 0.14) ** 2 + (x * 0.14) ** 2 <= 0.56**2
        ndimage.binary_closing(solid, element)

    compare(
        "repair (all of it)",
        lambda: repair.repair(distance.copy(), SPACING, options=options),
        close_by_morphology,
        "a binary closing alone",
    )
    fine = extract.extract_surface(distance, Lattice.of_whole(region, SPACING))

    def chain() -> None:
        mesh = fine
        for error in (0.05, 0.3, 1.0, 2.5):
            mesh = simplify.simplify(mesh, error * 0.28)

    compare(
        "four LODs, one from the other",
        chain,
        lambda: [simplify.simplify(fine, error * 0.28) for error in (0.05, 0.3, 1.0, 2.5)],
        "each from the finest",
    )
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "nuclei.ome.tif"
        write_ome_tiff(source, np.clip(voxels, 0, 65535).astype(np.uint16), spacing=SPACING)
        costs = {}
        for workers in (1, 2):
            out = Path(folder) / str(workers)
            phases.make_plan(
                str(source),
                out,
                settings_module.load("cycif", None, flags={"plan": {"grid": "4x2"}}),
            )
            engine = Engine(workers)
            engine.run("warm-up", abs, [("a", -1), ("b", -2)])
            with timed() as costs[workers]:
                phases.run_units(out, engine)
            engine.close()
        ratio = costs[1].seconds / costs[2].seconds
        print(f"units with 2 workers: {ratio:.2f} x as fast as with 1")
    with tempfile.TemporaryDirectory() as folder:
        stage = write_many(Path(folder))
        with timed() as spent:
            opened = [open_unloaded(stage) for _ in range(ROUNDS)]
        median = statistics.median(one["seconds"] for one in opened)
        growth = opened[0]["growth_kib"]
        held = "" if growth is None else f", {growth / 1024:.0f} MiB"
        units = COLUMNS * ROWS * CHANNELS
        print(f"a stage of {units} units opens unloaded in {median:.2f} s{held}; "
              f"{ROUNDS} processes that did this: {typical(spent)}")  # fmt: skip


if __name__ == "__main__":
    with stated():
        main()
