"""Print the table of `make bench-wrap`: closing on voxels, and the paper's chain on triangles.

Both go from the smoothed volume to a closed mesh, each in one process; rows are medians of ROUNDS.
The time that the other chain needs for files is not counted. Both keep the same components by the
first paper's rule, bridge gaps of ALPHA and stay OFFSET away. The other chain is seedchain.cpp in
this folder (CGAL: components, hole filling, alpha wrap), which is built here.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from machine import Spent, stated, timed, typical
from numpy.typing import NDArray

from stereocell import read
from stereocell.isosurface.array_levels import find_array_levels
from stereocell.isosurface.components import find_components
from stereocell.isosurface.distance_field import signed_distance
from stereocell.isosurface.extract import extract_surface
from stereocell.isosurface.repair import repair
from stereocell.isosurface.repair_options import RepairOptions
from stereocell.meshes.distance import Nearest, measure_enclosure, measure_spread
from stereocell.meshes.simplify import compact
from stereocell.meshes.simplify_valid import simplify_without_defects
from stereocell.meshes.validity import find_defects, label_components
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.samples.cycif_geometry import grow_tissue
from stereocell.samples.microscope import SPACING_UM, STAINS, record

ROUNDS = 5
SHAPE = (194, 512, 512)
ALPHA = 7.2  # finest spacings: 1 um on the phantoms
OFFSET = 0.1  # share of alpha
SAMPLES = 20_000

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Input:
    name: str
    field: NDArray[np.float32]  # smoothed voxels minus their background
    spacing: Triple
    iso: float
    # Both are shares of alpha, chosen so that our mesh has no more faces and no larger distances
    # than the paper's.
    grid: float  # largest spacing of the voxels that are used; the voxels between are left out
    error: float  # largest error of simplification


def inputs() -> Iterator[Input]:
    """Yield the inputs one after another."""
    for name, volume, grid, error in volumes(SHAPE):
        yield prepare(name, volume, grid, error)


def volumes(shape: tuple[int, int, int]) -> Iterator[tuple[str, Volume, float, float]]:
    """Yield names and voxels, with the `grid` and `error` of `Input`."""
    size = tuple(n * h for n, h in zip(shape, SPACING_UM, strict=True))
    for name, stain, seed, grid, error in (
        ("nuclei, seed 0", 0, 0, 0.42, 0.1),
        ("nuclei, seed 1", 0, 1, 0.42, 0.1),
        ("nuclei, seed 2", 0, 2, 0.42, 0.1),
        ("membranes", 1, 0, 0.56, 0.25),
        ("vessels", 2, 0, 0.56, 0.1),
    ):
        tissue = grow_tissue((size[0], size[1], size[2]), seed, 1.0)
        voxels = record(tissue, stain, box=Box((0, 0, 0), shape), seed=seed)
        yield f"{name} ({STAINS[stain].name})", Volume(voxels, SPACING_UM), grid, error
    folder = os.environ.get("STEREOCELL_DATA", "")
    file = Path(folder) / "brain_cells_2ch" / "brain_cells_2ch.ome.tif"
    if not folder or not file.exists():
        print("real stack                skipped: STEREOCELL_DATA names no folder that holds it")
        return
    source = read.open(str(file))
    volume = source.read(0, Box((0, 0, 0), source.levels[0].shape), 0)
    yield "brain cells, real", volume, 0.42, 0.15


def prepare(name: str, volume: Volume, grid: float, error: float) -> Input:
    """Return a volume smoothed by the pipeline, and the iso-value that the pipeline finds."""
    found = find_array_levels(volume)
    return Input(name, found.field, volume.spacing_um, found.levels.clear[0].value, grid, error)


def wrap(given: Input) -> Mesh:
    """Return this project's closed mesh of the solids that the rule keeps."""
    alpha = ALPHA * min(given.spacing)
    step = [max(1, int(given.grid * alpha / h + 0.01)) for h in given.spacing]
    z, y, x = (h * k for h, k in zip(given.spacing, step, strict=True))
    field = np.ascontiguousarray(given.field[:: step[0], :: step[1], :: step[2]])
    spacing = (z, y, x)
    distance = signed_distance(
        field, np.float32(given.iso), spacing_um=spacing, value_range=float(np.ptp(field))
    )
    components = find_components(distance > 0, spacing, 26)
    options = RepairOptions(
        alpha_um=alpha,
        offset_um=OFFSET * alpha,
        min_diagonal_um=float(components.diagonal_um.mean()) / 2,
        min_faces=float(components.faces().mean()) / 2,
        max_fragment_um=np.inf,
        max_cavity_um=np.inf,
    )
    whole = Box((0, 0, 0), distance.shape)
    closed = repair(distance, spacing, options=options).distance
    surface = extract_surface(closed, Lattice.of_whole(whole, spacing))
    return simplify_without_defects(surface, (), max_error_um=given.error * alpha).mesh


def iso_surface(given: Input) -> Mesh:
    """Return the unchanged iso-surface of the smoothed volume."""
    whole = Box((0, 0, 0), given.field.shape)
    height = given.field - np.float32(given.iso)
    # Values are clipped as extraction expects. Only their signs and ratios matter.
    height *= np.float32(2 * max(given.spacing)) / np.abs(height).max()
    return extract_surface(height, Lattice.of_whole(whole, given.spacing))


def chain(binary: Path, surface: Mesh, alpha: float, folder: Path) -> tuple[Mesh, float]:
    """Return the paper's chain's mesh of the iso-surface, and its seconds."""
    source, target = folder / "in.ply", folder / "out.ply"
    write_ply(source, surface)
    command = [binary, source, target, str(alpha), str(OFFSET * alpha)]
    printed = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return read_ply(target), printed["s_components"] + printed["s_holes"] + printed["s_wrap"]


def kept(mesh: Mesh) -> Mesh:
    """Return the components that the paper's rule keeps."""
    number = label_components(mesh.triangles, len(mesh.positions))
    faces = np.bincount(number[mesh.triangles[:, 0]])
    low, high = np.full((len(faces), 3), np.inf), np.full((len(faces), 3), -np.inf)
    np.minimum.at(low, number, mesh.positions)
    np.maximum.at(high, number, mesh.positions)
    diagonal = np.linalg.norm(high - low, axis=1)
    good = (faces >= faces.mean() / 2) & (diagonal >= diagonal.mean() / 2)
    return compact(mesh, mesh.triangles[good[number[mesh.triangles[:, 0]]]])


def write_ply(file: Path, mesh: Mesh) -> None:
    """Write a binary PLY."""
    faces = np.empty(len(mesh.triangles), [("n", "u1"), ("corners", "<i4", 3)])
    faces["n"], faces["corners"] = 3, mesh.triangles
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.positions)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    file.write_bytes(head.encode() + mesh.positions.astype("<f4").tobytes() + faces.tobytes())


def read_ply(file: Path) -> Mesh:
    """Read a binary PLY of CGAL, with doubles and only triangles."""
    head, _, body = file.read_bytes().partition(b"end_header\n")
    words = head.decode().split()
    counts = [int(words[i + 2]) for i, word in enumerate(words) if word == "element"]
    kind = "<f8" if "double" in words else "<f4"
    size = counts[0] * 3 * np.dtype(kind).itemsize
    positions = np.frombuffer(body[:size], kind).reshape(-1, 3).astype(np.float32)
    faces = np.frombuffer(body[size:], [("n", "u1"), ("corners", "<i4", 3)])
    return Mesh(positions, faces["corners"].astype(np.uint32), np.zeros_like(positions))


def build_chain(folder: Path) -> Path | None:
    """Return the compiled seedchain; prints the reason and returns None if it can't be built."""
    compiler = shutil.which("g++")
    if compiler is None:
        print("the paper's chain is skipped: no g++ to build seedchain.cpp with")
        return None
    binary, source = folder / "seedchain", Path(__file__).with_name("seedchain.cpp")
    flags = ["-O3", "-DNDEBUG", "-march=native", "-std=c++17"]
    made = subprocess.run(
        [compiler, *flags, source, "-o", binary, "-lgmp", "-lmpfr"], capture_output=True, text=True
    )
    if made.returncode:
        reason = next((line for line in made.stderr.splitlines() if "error" in line), "g++ failed")
        print(f"the paper's chain is skipped: {reason.strip()}")
        print("  it needs CGAL 5.5 or newer: apt install libcgal-dev")
        return None
    return binary


def compare(given: Input, binary: Path, rounds: int, folder: Path) -> None:
    """Print a row for each chain: time, faces, distances."""
    alpha = ALPHA * min(given.spacing)
    spent: dict[str, list[Spent]] = {"ours": [], "peer": []}
    for _ in range(rounds):
        with timed() as own:
            ours = wrap(given)
        with timed() as extraction:
            surface = iso_surface(given)
        peer, further = chain(binary, surface, alpha, folder)
        both = Spent(extraction.seconds + further, extraction.cpu + further)  # it has one thread
        spent["ours"].append(own)
        spent["peer"].append(both)
    a, b = (typical(*spent[label]) for label in ("ours", "peer"))
    reference, everything = Nearest(kept(surface), SAMPLES), Nearest(surface, SAMPLES)
    print(f"{given.name}: {b.seconds / a.seconds:.1f} x as fast")
    for label, mesh, took in (("ours", ours, a), ("paper's chain", peer, b)):
        target = Nearest(mesh, SAMPLES)
        there, back = measure_spread(reference, target), measure_spread(target, everything)
        print(
            f"  {label:<14} {took} | {len(mesh.triangles):8d} faces | iso to mesh "
            f"{there.mean:.3f} / {there.p95:.3f} / {there.max:.2f}  mesh to iso "
            f"{back.mean:.3f} / {back.p95:.3f} / {back.max:.2f} um (mean / p95 / max)  "
            f"{measure_enclosure(reference, target):.0%} enclosed  "
            f"{find_defects(mesh).total} faults",
            flush=True,
        )


def main() -> None:
    """Run all comparisons."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    rounds = parser.parse_args().rounds
    with tempfile.TemporaryDirectory() as name:
        binary = build_chain(Path(name))
        if binary is None:
            sys.exit(0)
        for given in inputs():
            compare(given, binary, rounds, Path(name))


if __name__ == "__main__":
    with stated():
        main()
