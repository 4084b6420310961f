"""Print the tables of `make bench-unit`: a whole unit, and other programs' meshes of its solids.

Our rows are the whole unit from voxels (8-bit volume, four sound levels, distances, occlusion), and
only the part that the first paper describes (iso-surface, filter, closed wrap, simplification).
Other rows are the paper's chain (seedchain.cpp, CGAL), VTK's FlyingEdges with pyvista's decimation
and gltfpack, and zmesh, the mesher of igneous, on the same solids as labels. A missing program is
skipped with a line.

All except the whole unit start from the smoothed volume. They run alternately in one process, and
rows are medians of --rounds. Other programs must make as many faces as our part. The unit's row
measures lod0, which is finer. Bytes are those of our .glb encoder, or of gltfpack if the row names
it.
"""

import argparse
import importlib.util
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import cc3d
import numpy as np
import pyvista as pv
import trimesh
from machine import Spent, stated, timed, typical
from wrap import (
    ALPHA,
    SAMPLES,
    SHAPE,
    Input,
    build_chain,
    chain,
    iso_surface,
    kept,
    prepare,
    volumes,
    wrap,
)

from stereocell.formats.gltf import Material, choose_step, encode_glb
from stereocell.isosurface.repair_options import RepairOptions
from stereocell.isosurface.repair_rules import choose_repair, sum_components
from stereocell.meshes.distance import Nearest, measure_spread
from stereocell.meshes.validity import find_defects
from stereocell.model.lattice import Lattice
from stereocell.model.lattice_field import LatticeField
from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.planning.settings import Settings
from stereocell.planning.unit_steps import unit_options
from stereocell.steps.unit import UnitInput, build_unit

Run = Callable[[], tuple[Mesh, Spent]]
ROUNDS = 3
DECIMATED = 0.98  # largest share of faces that decimation may remove


def whole_unit(volume: Volume, given: Input) -> Mesh:
    """Return lod0 of a unit that is the only tile, with a build's settings."""
    settings = Settings()
    surface = settings.surface.resolved(volume.spacing_um)
    settings = replace(settings, surface=surface)
    box = Box((0, 0, 0), volume.voxels.shape)
    most = RepairOptions(
        alpha_um=float(surface.max_alpha_um),
        min_diagonal_um=float(surface.min_diagonal_um),
        max_cavity_um=float(surface.max_cavity_um),
        max_fragment_um=float(surface.max_fragment_um),
    )
    sums = sum_components(
        given.field > np.float32(given.iso), volume.spacing_um, most.min_diagonal_um
    )
    unit = build_unit(
        volume,
        UnitInput(
            lattice=Lattice.of_whole(box, volume.spacing_um),
            iso=LatticeField(((0.0,), (0.0,), (0.0,)), np.full((1, 1, 1), given.iso)),
            background=None,
            repair=choose_repair(
                [asdict(sums)], most, surface=surface, spacing_um=volume.spacing_um
            ),
            step=(1, 1, 1),
            intensity_window=(float(volume.voxels.min()), float(volume.voxels.max())),
            options=unit_options(settings),
        ),
    )
    return unit.lods[0].mesh


def decimated(given: Input, faces: int) -> Mesh:
    """Return the mesh of FlyingEdges and pyvista's quadric decimation."""
    surface = iso_surface(given)
    poly = pv.PolyData.from_regular_faces(surface.positions, surface.triangles.astype(np.int64))
    share = min(max(1 - faces / max(len(surface.triangles), 1), 0.0), DECIMATED)
    return to_mesh(poly.decimate(share))


def to_mesh(poly: Any) -> Mesh:
    """Return a pyvista surface as a mesh."""
    positions = np.asarray(poly.points, np.float32)
    return Mesh(positions, poly.regular_faces.astype(np.uint32), np.zeros_like(positions))


def pack(mesh: Mesh, program: str, folder: Path) -> int:
    """Return the bytes of gltfpack's file of a mesh, with its strongest compression."""
    source, packed = folder / "peer.glb", folder / "packed.glb"
    smooth = trimesh.Trimesh(mesh.positions, mesh.triangles, process=False)
    _ = smooth.vertex_normals  # our meshes have normals, too
    smooth.export(source, include_normals=True)
    subprocess.run([program, "-cc", "-i", source, "-o", packed], check=True, capture_output=True)
    return packed.stat().st_size


def label_meshes(zmesh: Any, given: Input, faces: int) -> Mesh:
    """Return zmesh's meshes of the solids as labels, joined."""
    labels = cc3d.connected_components(given.field > np.float32(given.iso), connectivity=26)
    mesher = zmesh.Mesher(given.spacing)
    mesher.mesh(labels.astype(np.uint32))
    parts = [mesher.get(number, normals=False) for number in mesher.ids()]
    factor = max(1, round(sum(len(part.faces) for part in parts) / faces))
    parts = [mesher.get(k, normals=False, reduction_factor=factor) for k in mesher.ids()]
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    z, y, x = np.concatenate([part.vertices for part in parts]).T
    positions = np.stack([x, -y, z], axis=1).astype(np.float32)
    triangles = np.concatenate(
        [part.faces.astype(np.int64) + start for part, start in zip(parts, starts, strict=False)]
    )
    return Mesh(positions, triangles.astype(np.uint32), np.zeros_like(positions))


def run_of(make: Callable[[], Mesh]) -> Run:
    """Return a run whose time is measured here."""

    def run() -> tuple[Mesh, Spent]:
        with timed() as spent:
            mesh = make()
        return mesh, spent

    return run


def runs_of(
    volume: Volume, given: Input, binary: Path | None, folder: Path, sizes: dict[str, int]
) -> dict[str, Run]:
    """Return the runs by name. Rows that write their own files put the bytes into `sizes`."""
    runs = {
        "ours, whole unit": run_of(lambda: whole_unit(volume, given)),
        "ours, paper's part": run_of(lambda: wrap(given)),
    }
    faces = len(wrap(given).triangles)
    if binary is not None:
        alpha, made = ALPHA * min(given.spacing), binary

        def paper() -> tuple[Mesh, Spent]:
            with timed() as spent:
                surface = iso_surface(given)
            mesh, further = chain(made, surface, alpha, folder)
            return mesh, Spent(spent.seconds + further, spent.cpu + further)  # it has one thread

        runs["paper's chain"] = paper
    runs["FlyingEdges, pyvista"] = run_of(lambda: decimated(given, faces))
    gltfpack = find_gltfpack()
    if gltfpack is not None:
        name, program = "the same, gltfpack", gltfpack

        def packed() -> Mesh:
            mesh = decimated(given, faces)
            sizes[name] = pack(mesh, program, folder)
            return mesh

        runs[name] = run_of(packed)
    if importlib.util.find_spec("zmesh"):
        zmesh = importlib.import_module("zmesh")
        runs["zmesh"] = run_of(lambda: label_meshes(zmesh, given, faces))
    return runs


def find_gltfpack() -> str | None:
    """Return gltfpack from the folder that GLTFPACK names, or from PATH."""
    return shutil.which("gltfpack", path=os.environ.get("GLTFPACK")) or shutil.which("gltfpack")


def size_of(mesh: Mesh) -> int:
    """Return the bytes of the mesh as .glb, on the lattice of a tile this large."""
    extent = float(np.ptp(mesh.positions, axis=0).max())
    material = Material((1.0, 1.0, 1.0))
    glb = encode_glb(mesh, choose_step(extent), material=material, name="mesh", extras={})
    return len(glb.data)


def compare(
    name: str, given: Input, runs: dict[str, Run], count: int, sizes: dict[str, int]
) -> None:
    """Print a row for each run: time, faces, bytes, distances in both directions, faults.

    count  number of rounds
    sizes  bytes of the rows that write their own files
    """
    rounds: dict[str, list[Spent]] = {label: [] for label in runs}
    meshes: dict[str, Mesh] = {}
    for _ in range(count):
        for label, run in runs.items():
            meshes[label], took = run()
            rounds[label].append(took)
    surface = iso_surface(given)
    reference, everything = Nearest(kept(surface), SAMPLES), Nearest(surface, SAMPLES)
    print(f"{name}: {' x '.join(map(str, given.field.shape))} voxels, um: mean / p95")
    for label, mesh in meshes.items():
        target = Nearest(mesh, SAMPLES)
        there, back = measure_spread(reference, target), measure_spread(target, everything)
        size = sizes.get(label) or size_of(mesh)
        print(
            f"  {label:<21} {typical(*rounds[label])}  {len(mesh.triangles):8d} "
            f"faces  {size / 1e3:7.0f} kB  iso to mesh {there.mean:.3f} / {there.p95:.3f}"
            f"  mesh to iso {back.mean:.3f} / {back.p95:.3f}  {find_defects(mesh).total} faults",
            flush=True,
        )


def main() -> None:
    """Run all comparisons."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--shape", default=",".join(map(str, SHAPE)), help="z,y,x voxels")
    parser.add_argument("--only", default="", help="volumes whose name begins so")
    given = parser.parse_args()
    z, y, x = (int(n) for n in given.shape.split(","))
    if not importlib.util.find_spec("zmesh"):
        print("bench-unit: zmesh skipped: pip install zmesh (LGPL-3.0)")
    if find_gltfpack() is None:
        print("bench-unit: gltfpack skipped: npm install gltfpack (MIT)")
    with tempfile.TemporaryDirectory() as name:
        binary = build_chain(Path(name))
        for label, volume, grid, error in volumes((z, y, x)):
            if label.startswith(given.only):
                one = prepare(label, volume, grid, error)
                sizes: dict[str, int] = {}
                runs = runs_of(volume, one, binary, Path(name), sizes)
                compare(label, one, runs, given.rounds, sizes)


if __name__ == "__main__":
    with stated():
        main()
