"""Find the interfaces that objects share, and their areas, triangle by triangle.

At the finest level, two neighbours have identical triangles at their interface, to the last bit,
even in different tiles. A triangle that occurs twice therefore belongs to an interface.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.model.mesh import Mesh

_ODD = (0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9)  # odd factors, as in xxHash


@dataclass(frozen=True, slots=True)
class Surfaces:
    """The finest surfaces of a tile's n objects.

    labels      uint64 (n,), numbers of the objects in the label map
    area_um2    float64 (n,), area of each whole surface
    shared_um2  float64 (n,), area of its interfaces with other objects of the tile
    pairs       uint64 (m, 2), labels of two objects of the tile with an interface, each pair once
    keys        uint64 (k,), keys of triangles that may be an interface with another tile's object
    of          int64 (k,), index of the object of each such triangle
    key_um2     float64 (k,), area of each such triangle
    """

    labels: NDArray[np.uint64]
    area_um2: NDArray[np.float64]
    shared_um2: NDArray[np.float64]
    pairs: NDArray[np.uint64]
    keys: NDArray[np.uint64]
    of: NDArray[np.int64]
    key_um2: NDArray[np.float64]


NO_SURFACES = Surfaces(
    np.zeros(0, np.uint64),
    np.zeros(0),
    np.zeros(0),
    np.zeros((0, 2), np.uint64),
    np.zeros(0, np.uint64),
    np.zeros(0, np.int64),
    np.zeros(0),
)


def find_surfaces(mesh: Mesh, labels: NDArray[np.uint64], beyond: NDArray[np.float32]) -> Surfaces:
    """Return areas and shared triangles of the surfaces of a tile's objects.

    labels  uint64 (n,), labels in the order of `mesh.objects`
    beyond  float32 (tiles, 6), smallest and largest (x, y, z), um, of other tiles' objects
    """
    if mesh.objects is None:
        return NO_SURFACES
    corners = mesh.positions[mesh.triangles].astype(np.float32) + np.float32(0)  # -0 becomes 0
    a, b, c = corners.astype(np.float64).transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    of = mesh.objects[mesh.triangles[:, 0]].astype(np.int64)
    keys = _keys(corners)
    first, second = _find_pairs(keys)
    other = labels[of[first]] != labels[of[second]]
    first, second = first[other], second[other]
    interfaces = np.concatenate([first, second])
    count = len(labels)
    pairs = np.sort(np.stack([labels[of[first]], labels[of[second]]], axis=1), axis=1)
    left = np.ones(len(keys), bool)
    left[interfaces] = False
    is_near = np.zeros(len(keys), bool)
    low, high = corners.min(axis=1), corners.max(axis=1)
    for box in beyond:
        is_near |= ((high >= box[:3]) & (low <= box[3:])).all(axis=1)
    kept = left & is_near
    return Surfaces(
        labels,
        np.bincount(of, area, count).astype(np.float64),
        np.bincount(of[interfaces], area[interfaces], count).astype(np.float64),
        np.unique(pairs, axis=0),
        keys[kept],
        of[kept],
        area[kept],
    )


def join_surfaces(
    tiles: Sequence[Surfaces],
) -> tuple[list[NDArray[np.float64]], NDArray[np.uint64]]:
    """Return the area of each object's interfaces, by tile, and all pairs with one, (m, 2)."""
    shared = [one.shared_um2.copy() for one in tiles]
    if not tiles:
        return shared, np.zeros((0, 2), np.uint64)
    keys = np.concatenate([one.keys for one in tiles])
    tile = np.repeat(np.arange(len(tiles)), [len(one.keys) for one in tiles])
    of, area = (np.concatenate([getattr(one, name) for one in tiles]) for name in ("of", "key_um2"))
    names = np.concatenate([one.labels[one.of] for one in tiles])
    first, second = _find_pairs(keys)
    other = names[first] != names[second]
    first, second = first[other], second[other]
    for found in (first, second):
        for number, part in enumerate(shared):
            own = found[tile[found] == number]
            part += np.bincount(of[own], area[own], len(part))
    across = np.sort(np.stack([names[first], names[second]], axis=1), axis=1)
    return shared, np.unique(np.concatenate([across, *(one.pairs for one in tiles)]), axis=0)


def _keys(corners: NDArray[np.float32]) -> NDArray[np.uint64]:
    """Return a key for each triangle (m, 3, 3); the order of its corners does not matter."""
    bits = np.ascontiguousarray(corners).view(np.uint32).astype(np.uint64)
    mixed = np.zeros(bits.shape[:2], np.uint64)
    for axis, odd in enumerate(_ODD):
        mixed = (mixed ^ bits[..., axis]) * np.uint64(odd)
        mixed ^= mixed >> np.uint64(29)
    return mixed.sum(axis=1, dtype=np.uint64)


def _find_pairs(keys: NDArray[np.uint64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first and the second index of each key that occurs twice."""
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    return order[same], order[same + 1]
