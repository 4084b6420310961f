"""Make all levels of detail of one unit from its fine surface; each is validated and measured."""

import numpy as np

from stereocell.meshes.distance import Nearest, measure_distance, measure_enclosure, measure_spread
from stereocell.meshes.fairing import make_fair
from stereocell.meshes.options import LodOptions
from stereocell.meshes.simplify_valid import simplify_without_defects
from stereocell.meshes.validity import find_defects
from stereocell.model.lattice import Plane
from stereocell.model.mesh import Lod, Mesh, Quality
from stereocell.model.timing import Clock
from stereocell.textures.bake import Baker, FineSurface
from stereocell.textures.options import UnwrapOptions
from stereocell.textures.texture_lod import texture_lod

STRAY = 3.0  # errors; largest distance of a vertex from the next level; about .1 % would exceed it
SLIDE = 0.5  # finest voxel spacings; largest slide of a vertex of lod0 along the surface


def make_levels(
    fine: Mesh,
    planes: tuple[Plane, ...],
    *,
    spacing_um: tuple[float, float, float],
    lod: LodOptions,
    unwrap: UnwrapOptions,
    clock: Clock,
    source: FineSurface | None = None,
    first: int = 0,
) -> tuple[Lod, ...]:
    """Return lod0, lod1, ... of the fine surface, which is open on the planes and nowhere else.

    fine        positions float32 (n, 3) in um, world space (x, y, z)
    planes      the cut planes
    spacing_um  of the voxels, (z, y, x)
    source      the surface that maps are baked from: the fine one, continued past the planes;
                None: the fine surface alone, without ambient occlusion
    first       the first level that is made; `fine` is then the level before it

    Meshes are validated before the seams of charts split their vertices: positions stay the same.
    """
    lods: list[Lod] = []
    mesh = fine
    unwrapping = unwrap.resolved(spacing_um)
    with clock("bake"):
        baker = Baker(source or FineSurface.bare(fine))
    with clock("measure"):
        to_fine = Nearest(fine, lod.samples)
    for level, error in list(enumerate(lod.errors))[first:]:
        with clock("simplify"):
            length = error * min(spacing_um)
            simplified = simplify_without_defects(
                mesh, planes, max_error_um=length, max_away_um=STRAY * length
            )
            mesh = simplified.mesh
        if level == 0:
            with clock("fair"):
                mesh = make_fair(
                    mesh,
                    planes,
                    max_slide_um=SLIDE * min(spacing_um),
                    max_turn_um=error * min(spacing_um),
                )
        with clock("certify"):
            left = find_defects(mesh, planes).total
        with clock("measure"):
            to_mesh = Nearest(mesh, lod.samples)
            distance = measure_distance(to_fine, to_mesh)
            # a coarser level is no more accurate: sampling errors must not break the viewers' order
            distance = max(distance, lods[-1].distance_um if lods else 0.0)
            quality = Quality(
                away=measure_spread(to_fine, to_mesh),
                back=measure_spread(to_mesh, to_fine),
                mended=simplified.simplified_again,
                fallbacks=simplified.fallbacks,
                faults=left,
                angle_deg=sharpest_angle(mesh),
                enclosed=measure_enclosure(to_fine, to_mesh),
            )
        made = Lod(mesh, distance, quality=quality)
        if len(mesh.triangles):
            made = texture_lod(made, level, baker=baker, options=unwrapping, clock=clock)
        lods.append(made)
    return tuple(lods)


def sharpest_angle(mesh: Mesh) -> float:
    """Return the 1st percentile, in degrees, of the triangles' smallest angles."""
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    sides = np.sort(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2), axis=1)
    a, b, c = sides.T  # the smallest angle is opposite the shortest side
    cosine = (b**2 + c**2 - a**2) / np.maximum(2 * b * c, 1e-30)
    smallest = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    return float(np.percentile(smallest, 1))
