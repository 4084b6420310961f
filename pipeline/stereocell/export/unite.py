"""Make one closed solid of a channel's surfaces, which are open where tiles meet.

Neighbouring tiles have exactly the same vertices where they meet, at each level of detail. Caps
close surfaces at the ends of the built region (isosurface/extract.py). So tiles need no boolean
operation to be united: vertices at equal positions are merged. Tiles that are not exported are cut
off afterwards by boxes.

If a tile is hidden or was moved, its neighbours are closed at the shared face (cap.py). Tiles that
were moved are united with the others by manifold3d.
"""

from collections.abc import Sequence
from itertools import product

import manifold3d
import numpy as np
from numpy.typing import NDArray

from stereocell.meshes.validity import border
from stereocell.model.errors import StageError

# Smallest length of an edge, as a share of the longest edge of a solid's box. Boolean operations
# leave shorter edges, which are removed: both ends could be the same position in float32, and other
# programs would then treat the solid as open.
_HAIR = 1e-5
# Overlap of neighbouring boxes, and margin to a cut, as a share of the shortest edge of all boxes
_REACH = 3e-4
Corners = tuple[NDArray[np.float64], NDArray[np.float64]]


def weld(
    parts: Sequence[tuple[NDArray[np.float32], NDArray[np.uint32]]],
) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Join meshes; merge vertices at equal positions, and drop triangles that collapse."""
    firsts = np.cumsum([0, *(len(positions) for positions, _ in parts)])
    # Adding 0 turns -0.0 into 0.0, so that equal positions have equal bytes.
    places = np.concatenate([positions for positions, _ in parts]) + np.float32(0)
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
    """Convert a closed mesh to a solid. Raises StageError if it is open or not a manifold."""
    mesh = manifold3d.Mesh(positions, triangles)
    solid = manifold3d.Manifold(mesh)
    if solid.status() != manifold3d.Error.NoError and mesh.merge():
        solid = manifold3d.Manifold(mesh)  # `merge` joined vertices of open edges that nearly met
    if solid.status() == manifold3d.Error.NoError:
        return solid
    edges = border(triangles)
    if not len(edges):
        raise StageError(
            f"{name}: found a surface with the fault {solid.status().name}, expected one that "
            "encloses a solid: repair it"
        )
    x, y, z = positions[edges[0, 0]].tolist()
    raise StageError(
        f"{name}: found {len(edges)} open edges, one at ({x:.4g}, {y:.4g}, {z:.4g}) um, expected a "
        "closed surface: close it in the program that edited it"
    )


def to_mesh(solid: manifold3d.Manifold) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return positions, float32 (n, 3), and triangles, uint32 (m, 3), of a solid.

    No two vertices have the same position. Vertices that are equal in float32 are merged. Where the
    solid touches itself, they are moved slightly inwards instead, because other programs merge
    equal positions and would get edges of four triangles.
    """
    found = solid.to_mesh()
    positions = np.ascontiguousarray(found.vert_properties[:, :3], np.float32)
    triangles = np.ascontiguousarray(found.tri_verts, np.uint32)
    joined = weld([(positions, triangles)])
    if len(joined[0]) == len(positions):
        return positions, triangles
    edges = np.sort(joined[1][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    return joined if (counts == 2).all() else (_drawn_in(positions, triangles), triangles)


def _drawn_in(positions: NDArray[np.float32], triangles: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Return the positions; equal ones are moved slightly inwards, against their normals."""
    _, number, counts = np.unique(positions, axis=0, return_inverse=True, return_counts=True)
    shared = np.flatnonzero(counts[number.ravel()] > 1)
    a, b, c = positions[triangles].astype(np.float64).transpose(1, 0, 2)
    facing = np.cross(b - a, c - a)
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-30)
    normals = np.zeros((len(positions), 3))
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], facing)
    inwards = -normals[shared] / np.maximum(
        np.linalg.norm(normals[shared], axis=1, keepdims=True), 1e-30
    )
    moved = positions.copy()
    moved[shared] += _HAIR * float(np.ptp(positions, axis=0).max()) * inwards.astype(np.float32)
    return moved


def unite(solids: Sequence[manifold3d.Manifold]) -> manifold3d.Manifold:
    """Return the union of solids, which may touch and overlap."""
    if len(solids) == 1:
        return solids[0]
    return _tidy(manifold3d.Manifold.batch_boolean(list(solids), manifold3d.OpType.Add))


def cut_to(solid: manifold3d.Manifold, boxes: Sequence[Corners]) -> manifold3d.Manifold:
    """Return the part of a solid inside of boxes, which may touch each other.

    Vertices lie on the planes where tiles meet, and a cut through a vertex would give a solid that
    touches itself. So outer faces of boxes are moved slightly inwards, and faces between two boxes
    slightly outwards.
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
        has_next = any(
            np.isclose(other[axis], high[axis], atol=_HAIR * size) for other, _ in beside
        )
        high[axis] += reach * (1 if has_next else -1)
        has_next = any(np.isclose(other[axis], low[axis], atol=_HAIR * size) for _, other in beside)
        low[axis] -= reach * (1 if has_next else -1)
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
