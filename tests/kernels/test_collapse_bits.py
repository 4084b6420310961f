"""Collapses give the same meshes bit by bit, after each change of the code and on any processor.

The inputs are faces of voxels, so coordinates are whole numbers. Kernels add, multiply, divide and
take roots, which IEEE 754 defines to the last bit. A change that is meant to give other meshes
replaces the digests.
"""

import hashlib
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.kernels.collapse import collapse, collapse_interfaces
from stereocell.kernels.interface_rings import find_orders

SHARPEST = 0.978  # cosine of 12 degrees
NOTHING = np.zeros((0, 2), np.int32)
Labels = NDArray[np.int64]


def voxel_faces(labels: Labels) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return two triangles for each face between voxels of different labels."""
    numbers: dict[tuple[int, ...], int] = {}
    triangles = []
    for axis in range(3):
        low, high = (np.moveaxis(labels, axis, 0)[part] for part in (slice(-1), slice(1, None)))
        for start in np.argwhere(low != high):
            corners = []
            for more in ((0, 0), (1, 0), (1, 1), (0, 1)):
                place = np.insert(start[1:] + more, axis, start[0] + 1)
                corners.append(numbers.setdefault(tuple(place.tolist()), len(numbers)))
            a, b, c, d = corners if low[tuple(start)] > high[tuple(start)] else corners[::-1]
            triangles += [(a, b, c), (a, c, d)]
    return np.array([*numbers], np.float64), np.array(triangles, np.int32)


def balls(*centres: int) -> Labels:
    """Return a label map of balls in a row; each ball covers a part of the one before."""
    labels = np.zeros((24, 24, 48), np.int64)
    for (z, y, x), (label, centre) in product(np.ndindex(labels.shape), enumerate(centres, 1)):
        if (z - 12) ** 2 + (y - 11) ** 2 + (x - centre) ** 2 < 90:
            labels[z, y, x] = label
    return labels


def digest(*arrays: NDArray[np.generic]) -> str:
    return hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in arrays)).hexdigest()


@pytest.mark.parametrize(
    ("centres", "error", "surface", "interfaces"),
    [
        ((12,), 0.5, "aabce2a4321d52a9", "c04ff32f6e05f5c2"),
        ((12, 24, 36), 0.5, "a249e4813e9476cc", "72700689786197c8"),
        ((12, 24, 36), 3.0, "68e3a1a45b4c80d9", "5b89ae195dccf5db"),
    ],
)
def test_meshes_are_the_same_bit_by_bit(
    centres: tuple[int, ...], error: float, surface: str, interfaces: str
) -> None:
    labels = balls(*centres)
    at, triangles = voxel_faces(np.minimum(labels, 1))
    free, errors = np.zeros(len(at), bool), np.full(len(at), error)
    planes = (at[:, 0] == 12).astype(np.uint8)
    found = collapse(at, triangles, free, planes, errors, 3.0, SHARPEST, NOTHING)
    assert found[1].sum() < 0.8 * len(triangles)
    assert digest(*found)[:16] == surface
    at, triangles = voxel_faces(labels)
    free, errors = np.zeros(len(at), bool), np.full(len(at), error)
    orders = find_orders(triangles, len(at))
    found = collapse_interfaces(at, triangles, free, errors, 3.0, SHARPEST, orders, NOTHING)
    assert digest(orders, *found)[:16] == interfaces
