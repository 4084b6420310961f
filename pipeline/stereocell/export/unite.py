"""Make one closed solid of a channel's surfaces, which are open where tiles meet.

Neighbouring tiles have the same vertices where they meet, bit by bit and at each level, and a
surface is closed where the specimen ends (isosurface/extract.py). So the union of all tiles takes
no boolean operation: equal places become one vertex. What is not wanted is cut off then, by solid
boxes. Tiles that an edit moved are united by manifold3d.
"""

from collections.abc import Sequence
from itertools import product

import manifold3d
import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import StageError

# share of a solid's size; shorter edges that an operation left are closed: as float32 their ends
# could be one place, and other programs would find the solid open
_HAIR = 1e-5
# share of the shortest edge by which a box reaches into the next, or ends before its cut
_REACH = 3e-4
Corners = tuple[NDArray[np.float64], NDArray[np.float64]]


def weld(
    parts: Sequence[tuple[NDArray[np.float32], NDArray[np.uint32]]],
) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return the meshes as one with no two vertices alike, and no triangle without area."""
    firsts = np.cumsum([0, *(len(positions) for positions, _ in parts)])
    places = np.concatenate([positions for positions, _ in parts]) + np.float32(0)  # no -0.0
    triangles = np.concatenate(
        [part.astype(np.int64) + first for (_, part), first in zip(parts, firsts[:-1], strict=True)]
    )
    unique, number = np.unique(places, axis=0, return_inverse=True)
    joined = number.ravel()[triangles]
    has_area = (joined != np.roll(joined, 1, axis=1)).all(axis=1)
    return unique, joined[has_area].astype(np.uint32)


def to_solid(
    positions: NDArray[np.float32], triangles: NDArray[np.uint32], name: str
) -> manifold3d.Manifold:
    """Return a closed mesh as a solid. Raises StageError where it is open or no surface."""
    mesh = manifold3d.Mesh(positions, triangles)
    solid = manifold3d.Manifold(mesh)
    if solid.status() != manifold3d.Error.NoError and mesh.merge():
        solid = manifold3d.Manifold(mesh)  # vertices of open edges that were a hair apart
    if solid.status() == manifold3d.Error.NoError:
        return solid
    edges = open_edges(triangles)
    if not len(edges):
        raise StageError(f"{name}: can't be made one solid: {solid.status().name}")
    x, y, z = positions[edges[0, 0]].tolist()
    raise StageError(
        f"{name}: its surface is open at {len(edges)} edges, one at ({x:.4g}, {y:.4g}, {z:.4g}) um:"
        " an edit moved, hid or opened a part of it: expected a closed surface"
    )


def to_mesh(solid: manifold3d.Manifold) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return positions float32 (n, 3) and triangles uint32 (m, 3) of a solid.

    Vertices that float32 can't tell apart are one, unless the solid touches itself there.
    """
    found = solid.to_mesh()
    positions = np.ascontiguousarray(found.vert_properties[:, :3], np.float32)
    triangles = np.ascontiguousarray(found.tri_verts, np.uint32)
    joined = weld([(positions, triangles)])
    edges = np.sort(joined[1][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    is_closed = len(joined[0]) < len(positions) and bool((counts == 2).all())
    return joined if is_closed else (positions, triangles)


def open_edges(triangles: NDArray[np.uint32]) -> NDArray[np.int64]:
    """Return the edges (n, 2) that only one triangle has."""
    wide = triangles.astype(np.int64)
    edges = np.concatenate([wide[:, [0, 1]], wide[:, [1, 2]], wide[:, [2, 0]]])
    count = int(wide.max()) + 1
    here, back = edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]
    return edges[~np.isin(here, back)]


def unite(solids: Sequence[manifold3d.Manifold]) -> manifold3d.Manifold:
    """Return the union of solids, which may touch and overlap."""
    if len(solids) == 1:
        return solids[0]
    return _tidy(manifold3d.Manifold.batch_boolean(list(solids), manifold3d.OpType.Add))


def cut_to(solid: manifold3d.Manifold, boxes: Sequence[Corners]) -> manifold3d.Manifold:
    """Return what of a solid lies in any of some boxes, which touch or lie apart.

    Faces are moved inwards by a hair, since vertices lie on the planes where tiles meet: a cut
    through a vertex leaves a solid that touches itself.
    """
    ends = [(low.copy(), high.copy()) for low, high in boxes]
    reach = _REACH * min(float((high - low).min()) for low, high in boxes)
    for (low, high), axis in product(ends, range(3)):
        across = [k for k in range(3) if k != axis]
        beside = [
            (other_low, other_high)
            for other_low, other_high in boxes
            if (other_low[across] < high[across]).all() and (low[across] < other_high[across]).all()
        ]
        size = high[axis] - low[axis]
        is_met = any(np.isclose(other[axis], high[axis], atol=_HAIR * size) for other, _ in beside)
        high[axis] += reach * (1 if is_met else -1)
        is_met = any(np.isclose(other[axis], low[axis], atol=_HAIR * size) for _, other in beside)
        low[axis] -= reach * (1 if is_met else -1)
    cubes = [
        manifold3d.Manifold.cube((high - low).tolist()).translate(low.tolist())
        for low, high in ends
    ]
    return _tidy(solid ^ manifold3d.Manifold.batch_boolean(cubes, manifold3d.OpType.Add))


def _tidy(solid: manifold3d.Manifold) -> manifold3d.Manifold:
    if solid.is_empty():
        return solid
    ends = solid.bounding_box()
    return solid.simplify(_HAIR * max(ends[axis + 3] - ends[axis] for axis in range(3)))
