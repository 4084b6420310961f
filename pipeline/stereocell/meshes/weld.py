"""Join vertices that unwrapping copied along the seams of a mesh's UVs."""

import numpy as np
from numpy.typing import NDArray

from stereocell.model.mesh import Mesh


def weld_seams(mesh: Mesh) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the vertices to keep (k,), in order, and the kept vertex (n,) of each vertex.

    Vertices are joined if their positions, normals and objects are equal bit by bit, as unwrapping
    leaves them. Two surfaces that touch at a point have different normals there, and stay apart. A
    mesh without UVs has no seams.
    """
    every = np.arange(len(mesh.positions))
    if mesh.uvs is None or not len(every):
        return every, every
    columns = [mesh.positions, mesh.normals]
    rows = np.ascontiguousarray(np.hstack(columns), np.float32).view(np.uint32)
    if mesh.objects is not None:
        rows = np.column_stack([rows, mesh.objects.astype(np.uint32)])
    _, first, twin = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    kept = np.sort(first)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return kept, rank[twin.reshape(-1)]
