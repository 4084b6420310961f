"""Tangents by the rules of MikkTSpace, the convention that glTF and USD name.

Each triangle has one direction along +u, of unit length. A vertex takes the directions of its
triangles. Each of them is projected onto the plane across the vertex's normal, normalized again,
and weighted by the angle of the triangle's corner in that plane. The sum is normalized. The sign
shows on which side of normal and tangent +v lies: bitangent = sign * cross(normal, tangent).

No package for this can be installed: `pymikktspace` is available as source only and does not build.
The rules differ in one case. If triangles that are mirrored in UV space meet others at a vertex,
MikkTSpace splits it; here the larger angle decides. Charts of xatlas are not mirrored inside. Stage
and bundle contain these tangents, and maps are baked with them, so no reader has to derive its own.

References
M. S. Mikkelsen, "Simulation of wrinkled surfaces revisited", University of Copenhagen, 2008.
"""

import numpy as np
from numpy.typing import NDArray

from stereocell.model.mesh import Mesh


def make_tangents(mesh: Mesh) -> NDArray[np.float32]:
    """Return the tangent of each vertex, float32 (n, 4).

    mesh    with UVs float32 (n, 2), origin at the lower left
    result  a unit vector along +u, across the normal, and the bitangent's sign
    """
    assert mesh.uvs is not None
    p, t = mesh.positions.astype(np.float64), mesh.uvs.astype(np.float64)
    normals = mesh.normals.astype(np.float64)
    a, b, c = mesh.triangles.T
    e1, e2, d1, d2 = p[b] - p[a], p[c] - p[a], t[b] - t[a], t[c] - t[a]
    signed = d1[:, 0] * d2[:, 1] - d2[:, 0] * d1[:, 1]  # twice the area in UV space
    side = np.where(signed < 0, -1.0, 1.0)
    along = _unit((e1 * d2[:, 1:] - e2 * d1[:, 1:]) * side[:, None])
    along[signed == 0] = 0.0  # without area in UV space a triangle has no direction

    total, handed = np.zeros_like(p), np.zeros(len(p))
    for here, after, before in ((a, b, c), (b, c, a), (c, a, b)):
        n = normals[here]
        there, back = (_unit(_across(n, p[other] - p[here])) for other in (after, before))
        angle = np.arccos(np.clip((there * back).sum(axis=1), -1, 1))
        angle[signed == 0] = 0.0
        part = _unit(_across(n, along)) * angle[:, None]
        for axis in range(3):
            total[:, axis] += np.bincount(here, part[:, axis], len(p))
        handed += np.bincount(here, side * angle, len(p))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    # Without a direction from triangles, any direction across the normal will do.
    beside = np.where(np.abs(normals[:, :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    spare = _unit(np.cross(normals, beside))
    tangent = np.where(length > 1e-12, total / np.maximum(length, 1e-12), spare)
    sign = np.where(handed < 0, -1.0, 1.0)
    return np.concatenate([tangent, sign[:, None]], axis=1).astype(np.float32)


def _across(normals: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the vectors without their components along the normals."""
    return vectors - normals * (normals * vectors).sum(axis=1, keepdims=True)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the vectors at unit length. Zero vectors stay zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 1e-30)
