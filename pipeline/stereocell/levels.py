"""All levels of detail of one unit, from its fine surface; each certified, each measured."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from stereocell.certify import Plane, certify
from stereocell.config import Settings
from stereocell.distance import Nearest, measure_distance, measure_spread
from stereocell.flips import turn_edges
from stereocell.mend import simplify_soundly
from stereocell.mesh import Lod, Mesh, Quality
from stereocell.unwrap import bake_normals, unwrap


def make_levels(
    fine: Mesh,
    planes: tuple[Plane, ...],
    spacing: tuple[float, float, float],
    settings: Settings,
    clock: "Clock",
) -> tuple[Lod, ...]:
    """Return lod0, lod1, ... of the fine surface, which is open on the planes and nowhere else.

    Meshes are certified before seams of charts split their vertices: places stay the same.
    """
    options = settings.lod
    lods: list[Lod] = []
    mesh = fine
    with clock("measure"):
        to_fine = Nearest(fine, options.samples)
    for level, error in enumerate(options.errors):
        with clock("simplify"):
            mended = simplify_soundly(mesh, planes, error * min(spacing))
            mesh = mended.mesh
        if level == 0:
            with clock("turn"):
                mesh = turn_edges(mesh, planes, error * min(spacing))
        with clock("certify"):
            left = certify(mesh, planes).total
        with clock("measure"):
            to_mesh = Nearest(mesh, options.samples)
            distance = measure_distance(to_fine, to_mesh)
            # coarser can't be truer: sampling may say so by a hair, and viewers rely on the order
            distance = max(distance, lods[-1].distance_um if lods else 0.0)
            quality = Quality(
                away=measure_spread(to_fine, to_mesh),
                back=measure_spread(to_mesh, to_fine),
                mended=mended.mended,
                fallbacks=mended.fallbacks,
                faults=left,
                angle_deg=sharpest_angle(mesh),
            )
        if level >= len(options.errors) - settings.unwrap.coarse_lods and len(mesh.triangles):
            with clock("unwrap"):
                unwrapped, size = unwrap(mesh, settings.unwrap.max_texture, max(spacing))
            with clock("bake"):
                baked = bake_normals(unwrapped, fine, size)
            lods.append(Lod(unwrapped, distance, baked, quality))
        else:
            lods.append(Lod(mesh, distance, quality=quality))
    return tuple(lods)


def sharpest_angle(mesh: Mesh) -> float:
    """Return the 1st percentile, in degrees, of the triangles' smallest angles."""
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    sides = np.sort(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2), axis=1)
    a, b, c = sides.T  # the smallest angle lies across from the shortest side
    cosine = (b**2 + c**2 - a**2) / np.maximum(2 * b * c, 1e-30)
    smallest = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    return float(np.percentile(smallest, 1))


class Clock:
    """Seconds spent, by step."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, step: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.seconds[step] = self.seconds.get(step, 0.0) + time.perf_counter() - start
