"""Print the tables of `make bench-cells`: surfaces of touching cells, ours beside zmesh's.

Our rows are the surfaces of a build, without its measurements. Seconds and memory of a level
include all finer levels. zmesh, the mesher of igneous, makes each label's surface separately. Its
`max_error` is searched so that it has as many triangles as our level of some 450 per cell; the
search is not timed. Another row has igneous's own settings. Each run has its own process, programs
alternate, and rows are medians of --rounds.

Distances are measured in both directions, from points spread over both surfaces. The reference is
the truth if a formula is known, otherwise the faces between voxels. Volumes are compared with the
same reference. The exact check finds faults in each object, as made and on the lattice of our .glb.
For the bytes, all meshes are stored in that .glb.
"""

import argparse
import importlib
import importlib.util
import json
import os
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, astuple, dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import tifffile
from cell_truth import (
    BallsCut,
    Truth,
    VoxelFaces,
    measure_overlap,
    numbered,
    split,
    volume_of,
)
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1]))
from machine import measure_reference, stated

from stereocell.formats.gltf import Material, choose_step, encode_glb
from stereocell.meshes.distance import Nearest
from stereocell.meshes.validity import find_defects
from stereocell.model.mesh import Mesh
from stereocell.model.volume import zyx_to_xyz
from stereocell.objects.build_objects import MARGIN
from stereocell.objects.interfaces import extract_interfaces, put_on_lattice, surfaces_of
from stereocell.objects.options import ObjectOptions
from stereocell.objects.simplify_interfaces import simplify_interfaces
from stereocell.objects.well_composed import make_well_composed
from support.touching_cells import RADIUS_UM, touching_cells

ROUNDS = 3
SMALL, LARGE = (48, 112, 112), (112, 368, 368)  # voxels of the phantom
SPACING_UM = (1.0, 0.5, 0.5)  # um, spacing of the phantom (z, y, x)
NEAR = 450  # triangles per cell at which programs are compared
SAMPLES = 500  # points on each surface of a cell
INSIDE = 200_000  # points that are tested for lying in several cells
IGNEOUS = 100, 0.04  # its default reduction_factor and max_error, um
MAX_FACTOR = 1000  # a reduction_factor so large that only max_error limits
HALVINGS = 12

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Case:
    name: str
    labels: NDArray[np.int32]  # (z, y, x), 1 to n
    spacing_um: Triple
    truth: Truth

    @property
    def step_um(self) -> float:
        """The spacing, um, of the lattice to which a bundle of only this tile rounds positions."""
        sizes = np.multiply(self.labels.shape, self.spacing_um)
        return choose_step(float(sizes.max())) * 1e6


@dataclass(frozen=True, slots=True)
class Spent:
    seconds: float
    cpu_s: float
    peak_mb: float  # peak above the memory at the start


@dataclass(frozen=True, slots=True)
class Figures:
    """Figures of all objects of a mesh; distances in um, shares in percent."""

    triangles: float  # per cell
    mean: float
    p95: float
    bias: tuple[float, float, float]  # errors of volumes, %: 2nd, 50th and 98th percentile
    faulty: int  # number of objects that are faulty or empty as the program made them
    faulty_stored: int  # the same number after positions are rounded to the lattice of our .glb
    overlap: float
    size: int  # bytes of the .glb of all objects


Made = list[tuple[str, Mesh, Spent]]


class Meter:
    """Measures time and memory since its construction."""

    def __init__(self) -> None:
        Path("/proc/self/clear_refs").write_text("5")  # resets the peak to the present memory
        self._held, _ = _memory_mb()
        self._start, self._cpu = time.perf_counter(), time.process_time()

    def read(self) -> Spent:
        seconds, cpu = time.perf_counter() - self._start, time.process_time() - self._cpu
        return Spent(seconds, cpu, _memory_mb()[1] - self._held)


def _memory_mb() -> tuple[float, float]:
    """Return the present and the peak memory of this process."""
    lines = Path("/proc/self/status").read_text("utf-8").splitlines()
    fields = dict(line.split(":", 1) for line in lines)
    return int(fields["VmRSS"].split()[0]) / 1024, int(fields["VmHWM"].split()[0]) / 1024


def ours(labels: NDArray[np.int32], spacing_um: Triple, step_um: float) -> Made:
    """Return the meshes of all levels, with their costs."""
    small = np.zeros((9, 9, 9), np.int32)
    small[3:6, 3:6, 2:7] = 1
    _levels(small, spacing_um, step_um)  # loads compiled code before the measurement
    return _levels(labels, spacing_um, step_um)


def _levels(labels: NDArray[np.int32], spacing_um: Triple, step_um: float) -> Made:
    count = int(labels.max())
    volumes = np.bincount(labels.ravel()) * float(np.prod(spacing_um))
    z, y, x = (-MARGIN * s for s in spacing_um)
    meter, made = Meter(), []
    mended, _, _ = make_well_composed(np.pad(labels, MARGIN))
    walls = extract_interfaces(mended, spacing_um, step_um, origin_um=(z, y, x))
    for level, error in enumerate(ObjectOptions().errors):
        walls, _ = simplify_interfaces(walls, error * min(spacing_um), volumes, step_um)
        mesh = surfaces_of(walls, np.arange(1, count + 1, dtype=np.int32))
        made.append((f"ours, lod{level}", mesh, meter.read()))
    return made


def by_zmesh(
    labels: NDArray[np.int32], spacing_um: Triple, factor: int, error: float, name: str
) -> Made:
    mesher = _mesher(labels, spacing_um)  # loads libraries before the measurement
    meter = Meter()
    mesher = _mesher(labels, spacing_um)
    found = [
        mesher.get(number, normals=False, reduction_factor=factor, max_error=error)
        for number in range(1, int(labels.max()) + 1)
    ]
    spent = meter.read()
    counts = [len(part.vertices) for part in found]
    starts = np.cumsum([0, *counts])
    at = zyx_to_xyz(np.concatenate([part.vertices for part in found])).astype(np.float32)
    at -= zyx_to_xyz(np.asarray(spacing_um)).astype(np.float32)  # removes the offset of the padding
    faces = [part.faces.astype(np.int64) + starts[k] for k, part in enumerate(found)]
    triangles = np.concatenate(faces).astype(np.uint32)
    objects = np.repeat(np.arange(len(found), dtype=np.int32), counts)
    return [(name, Mesh(at, triangles, _normals(at, triangles), objects=objects), spent)]


def _mesher(labels: NDArray[np.int32], spacing_um: Triple) -> Any:
    mesher = importlib.import_module("zmesh").Mesher(spacing_um)
    mesher.mesh(np.pad(labels, 1).astype(np.uint32))  # padding closes objects at the border
    return mesher


def _normals(at: NDArray[np.float32], triangles: NDArray[np.uint32]) -> NDArray[np.float32]:
    corners = at.astype(np.float64)[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    columns = [np.bincount(triangles.ravel(), np.repeat(a, 3), len(at)) for a in area.T]
    normals = np.stack(columns, axis=1)
    lengths = np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)
    return (normals / lengths).astype(np.float32)


def search_error(labels: NDArray[np.int32], spacing_um: Triple, wanted: float) -> float:
    """Return the max_error, um, with which zmesh makes about this number of triangles per cell."""
    mesher = _mesher(labels, spacing_um)
    some = range(1, int(labels.max()) + 1, max(1, int(labels.max()) // 50))

    def triangles(error: float) -> float:
        parts = (
            mesher.get(number, normals=False, reduction_factor=MAX_FACTOR, max_error=error)
            for number in some
        )
        return float(np.mean([len(part.faces) for part in parts]))

    low, high = 0.01 * min(spacing_um), 1000 * max(spacing_um)
    for _ in range(HALVINGS):
        middle = (low * high) ** 0.5
        low, high = (middle, high) if triangles(middle) > wanted else (low, middle)
    return min(low, high, key=lambda error: abs(triangles(error) - wanted))


def measure(mesh: Mesh, case: Case) -> Figures:
    """Return the figures of a mesh of all the case's objects."""
    count = len(case.truth.volumes)
    # The lattice of a bundle is wide enough for a box of twice the size. A mesh that exceeds even
    # that gets a coarser lattice.
    step = max(case.step_um, choose_step(float(np.ptp(mesh.positions, axis=0).max()) / 2) * 1e6)
    parts = split(mesh, count)
    there = [k for k in range(count) if len(parts[k].triangles)]  # an object may vanish
    near = {k: Nearest(parts[k], SAMPLES) for k in there}
    away = np.concatenate([case.truth.distances(k, near[k]) for k in there])
    volumes = np.array([volume_of(part) for part in parts])
    low, middle, high = np.percentile(100 * (volumes / case.truth.volumes - 1), [2, 50, 98])
    glb = encode_glb(mesh, step / 1e6, material=Material((1, 1, 1)), name="cells", extras={})
    return Figures(
        len(mesh.triangles) / count,
        float(away.mean()),
        float(np.percentile(away, 95)),
        (float(low), float(middle), float(high)),
        sum(at_fault(part) for part in parts),
        sum(at_fault(stored(part, step)) for part in parts),
        100 * measure_overlap(list(near.values()), INSIDE),
        len(glb.data),
    )


def at_fault(part: Mesh) -> bool:
    return not len(part.triangles) or find_defects(part).total > 0


def stored(part: Mesh, step_um: float) -> Mesh:
    """Return a mesh with its positions rounded to the lattice, as a bundle stores them."""
    at = put_on_lattice(part.positions.astype(np.float64), step_um)
    return replace(part, positions=at.astype(np.float32))


def alone(make: Callable[..., Made], *given: Any) -> Made:
    """Run a method in a process of its own; return its meshes."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(make, *given).result()


def compare(case: Case, rounds: int) -> list[dict[str, Any]]:
    """Print a row for each mesh, and return the rows."""
    count = len(case.truth.volumes)
    given = case.labels, case.spacing_um
    ours_run = ours, *given, case.step_um
    first = alone(*ours_run)
    peers: list[tuple[Any, ...]] = []
    if importlib.util.find_spec("zmesh"):
        sizes = [len(mesh.triangles) / count for _, mesh, _ in first]
        error = search_error(*given, min(sizes, key=lambda size: abs(np.log(size / NEAR))))
        peers = [
            (by_zmesh, *given, MAX_FACTOR, error, f"zmesh, max_error {error:.2g} um"),
            (by_zmesh, *given, *IGNEOUS, "zmesh, as igneous asks"),
        ]
    spent: dict[str, list[Spent]] = {}
    meshes: dict[str, Mesh] = {}
    for turn in range(rounds):
        made = alone(*ours_run) if turn else first
        for name, mesh, took in made + [one for peer in peers for one in alone(*peer)]:
            spent.setdefault(name, []).append(took)
            meshes[name] = mesh
    print(f"\n{case.name}: {count} cells, {case.labels.shape} voxels")
    print("| | triangles a cell | mean / p95 um | volume %, p2 / 50 / 98 | at fault: made, stored "
          "| overlap % | bytes a cell | CPU s | references | s | MB |")  # fmt: skip
    print("|---" * 11 + "|")
    rows, reference = [], measure_reference()
    for name, mesh in meshes.items():
        figures = measure(mesh, case)
        took = Spent(*map(statistics.median, zip(*map(astuple, spent[name]), strict=True)))
        print(row(name, figures, took, count, reference), flush=True)
        named = {"case": case.name, "cells": count, "name": name, "reference_s": reference}
        rows.append(named | asdict(figures) | asdict(took))
    return rows


def row(name: str, found: Figures, took: Spent, cells: int, reference: float) -> str:
    """Return a row of the table.

    reference  CPU seconds of the reference kernel (machine.py)
    """
    bias = " / ".join(f"{share:+.2f}" for share in found.bias)
    return (
        f"| {name} | {found.triangles:.0f} | {found.mean:.3f} / {found.p95:.3f} | {bias} "
        f"| {found.faulty}, {found.faulty_stored} | {found.overlap:.3f} | {found.size / cells:.0f} "
        f"| {took.cpu_s:.2f} | {took.cpu_s / reference:.1f} | {took.seconds:.2f} "
        f"| {took.peak_mb:.0f} |"
    )


def cases(large: bool, only: str) -> Iterator[Case]:
    """Yield the cases whose name begins with `only`, one after another."""
    if "touching cells".startswith(only):
        labels, centres = touching_cells(LARGE if large else SMALL, SPACING_UM)
        truth = BallsCut(centres, RADIUS_UM, SAMPLES)
        yield Case("touching cells, from the truth", labels, SPACING_UM, truth)
    folder = Path(os.environ.get("STEREOCELL_DATA", ""))
    masks: tuple[tuple[str, str, Triple, Callable[[Path], Any]], ...] = (
        # The file states no voxel spacing.
        ("nuclei", "nuclei_stardist/mask3d.tif", (1.0, 1.0, 1.0), tifffile.imread),
        ("ovule", "ovule_plantseg/sample_ovule.h5", (0.235, 0.15, 0.15), _ovule),
    )
    for name, file, spacing, read in masks:
        if not name.startswith(only):
            continue
        if not (folder / file).is_file():
            print(f"bench-cells: {name} skipped: no {file} below STEREOCELL_DATA")
            continue
        labels = numbered(read(folder / file), ObjectOptions().smallest_voxels)
        faces = VoxelFaces(labels, spacing, SAMPLES)
        yield Case(f"{name}, from the faces between voxels", labels, spacing, faces)


def _ovule(path: Path) -> Any:
    with h5py.File(path) as file:
        return file["label"][:]


def main() -> None:
    """Run all comparisons."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, help="the folder of cells.json")
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--large", action="store_true", help="a phantom of some 1500 cells")
    parser.add_argument("--only", default="", help="cases whose name begins so")
    given = parser.parse_args()
    if not importlib.util.find_spec("zmesh"):
        print("bench-cells: zmesh skipped: pip install zmesh (LGPL-3.0)")
    rows = []
    for case in cases(given.large, given.only):
        rows += compare(case, given.rounds)
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / "cells.json").write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    with stated():
        main()
