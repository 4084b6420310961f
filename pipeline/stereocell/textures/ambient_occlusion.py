"""Ambient occlusion: the part of the sky above a surface that its body and neighbours hide.

Rays start at points of the surface. They run through the repaired field from which the surface was
extracted, not through its triangles. The field reaches past the tile into its halo, while a mesh
ends at the cut. So neighbours find nearly the same values on both sides of a cut. A ray steps
through voxels (kernels/visibility.py), so that no ray tracer is needed; libigl's has no radius.

The directions are the same for every point and every tile, so there is no noise, and the bytes are
the same each time.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from stereocell.kernels.visibility import cast_rays
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Mesh
from stereocell.model.volume import xyz_to_zyx

DIRECTIONS = 48  # number of rays over the whole sphere; half of them rise above a surface
STEP = 0.75  # step along a ray, in coarsest voxel spacings
NEIGHBOURS = 4  # number of nearest known values whose weighted mean a point takes


def find_ambient_visibility(
    solid: NDArray[np.bool_],
    lattice: Lattice,
    mesh: Mesh,
    *,
    radius_um: float,
    thinned: bool = False,
) -> NDArray[np.float32]:
    """Return the ambient visibility of each vertex, float32 (n,), 0..1; 1 for a radius of 0.

    Ambient visibility is 1 - ambient occlusion; 1 is open, as in glTF's occlusion texture.

    solid      bool (z, y, x), covers `lattice.window`
    mesh       positions and unit normals in world space, um (x, y, z); triangles are not used
    radius_um  a hit counts less the farther it is, and not at all from this distance
    thinned    whether only one vertex per voxel casts rays, and others take the mean of near ones

    A direction's weight is its cosine to the normal. Rays start a STEP above the surface, so that
    its own voxels do not hide it.
    """
    points = mesh.positions
    if radius_um <= 0 or not len(points):
        return np.ones(len(points), np.float32)
    if not thinned:
        return _cast(solid, lattice, points, mesh.normals, radius_um)
    kept = thin_out(points, max(lattice.spacing_um))
    found = _cast(solid, lattice, points[kept], mesh.normals[kept], radius_um)
    return spread(points[kept], found, points)


def thin_out(points: NDArray[np.float32], edge_um: float) -> NDArray[np.int64]:
    """Return the index of the first point in each occupied cube of space, int64 (k,), rising.

    points   float32 (n, 3), um
    edge_um  edge length of a cube; all cubes lie on one grid in world space
    """
    blocks = np.floor(points / edge_um).astype(np.int64)
    blocks -= blocks.min(axis=0)
    size = blocks.max(axis=0) + 1
    number = (blocks[:, 0] * size[1] + blocks[:, 1]) * size[2] + blocks[:, 2]
    return np.sort(np.unique(number, return_index=True)[1])


def spread(
    known: NDArray[np.float32], values: NDArray[np.float32], points: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return values at points, float32 (n,): means of near known values, weighted by nearness.

    known   float32 (k, 3), um, where values are known
    values  float32 (k,)
    points  float32 (n, 3), um
    """
    tree = cKDTree(known, balanced_tree=False, compact_nodes=False)
    distance, nearest = tree.query(points, k=list(range(1, min(NEIGHBOURS, len(known)) + 1)))
    weights = 1 / (np.asarray(distance) + 1e-6)
    mean: NDArray[np.float64] = (values[nearest] * weights).sum(axis=1) / weights.sum(axis=1)
    return mean.astype(np.float32)


def _cast(
    solid: NDArray[np.bool_],
    lattice: Lattice,
    points: NDArray[np.float32],
    normals: NDArray[np.float32],
    radius_um: float,
) -> NDArray[np.float32]:
    spacing, origin = np.asarray(lattice.spacing_um), np.asarray(lattice.origin_um)
    offset = step = STEP * max(lattice.spacing_um)
    distances = np.arange(offset, radius_um + offset, step)
    up = xyz_to_zyx(normals.astype(np.float64))
    start = (xyz_to_zyx(points.astype(np.float64)) + offset * up - origin) / spacing
    start += 0.5 - np.asarray(lattice.window.start)  # makes truncation give the nearest voxel
    directions = sphere(DIRECTIONS)
    return cast_rays(
        solid,
        start.astype(np.float32),
        up.astype(np.float32),
        directions.astype(np.float32),
        (directions / spacing).astype(np.float32),
        distances.astype(np.float32),
        np.maximum(0.0, 1 - distances / radius_um).astype(np.float32),
    )


def sphere(count: int) -> NDArray[np.float64]:
    """Return unit vectors spread evenly over the sphere, float64 (count, 3): a Fibonacci spiral."""
    place = np.arange(count) + 0.5
    height = 1 - 2 * place / count
    turn = np.pi * (1 + np.sqrt(5)) * place
    across = np.sqrt(1 - height**2)
    return np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)
