"""Separate the objects of one mesh."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from stereocell.model.mesh import Mesh


def split_objects(mesh: Mesh) -> Iterator[tuple[int, Mesh]]:
    """Yield the number of each object, rising, and a mesh of its triangles alone."""
    assert mesh.objects is not None
    order = np.argsort(mesh.objects, kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    triangles = rank[mesh.triangles]
    triangles = triangles[np.argsort(triangles[:, 0], kind="stable")]
    numbers, firsts = np.unique(mesh.objects[order], return_index=True)
    ends = [*firsts[1:].tolist(), len(order)]
    rows = np.searchsorted(np.sort(triangles[:, 0]), [*firsts, len(order)])
    for number, first, end, row, stop in zip(
        numbers.tolist(), firsts.tolist(), ends, rows[:-1], rows[1:], strict=True
    ):
        own = order[first:end]
        if row == stop:
            continue
        yield (
            number,
            replace(
                mesh,
                positions=mesh.positions[own],
                triangles=(triangles[row:stop] - first).astype(np.uint32),
                normals=mesh.normals[own],
                uvs=None,
                tangents=None,
                colors=None if mesh.colors is None else mesh.colors[own],
                openness=None if mesh.openness is None else mesh.openness[own],
                objects=None,
            ),
        )
