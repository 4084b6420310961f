"""Sweep tubes along lines of points: closed meshes with a round cross-section and flat ends."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from stereocell.model.mesh import Mesh

SIDES = 12  # edges of a tube's cross-section


def sweep_tubes(
    lines: Iterable[tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> Mesh | None:
    """Return the tubes of all lines as one mesh; None if no line has a length.

    lines  points (n, 3), and the diameter at each (n,)
    """
    places: list[NDArray[np.float64]] = []
    normals: list[NDArray[np.float64]] = []
    triangles: list[NDArray[np.int64]] = []
    count = 0
    for points, widths in lines:
        moves = np.linalg.norm(np.diff(points, axis=0), axis=1) > 0
        kept = np.concatenate([[True], moves])
        if kept.sum() < 2:
            continue
        tube = _sweep(points[kept], widths[kept])
        places.append(tube[0])
        normals.append(tube[1])
        triangles.append(tube[2] + count)
        count += len(tube[0])
    if not places:
        return None
    return Mesh(
        np.concatenate(places).astype(np.float32),
        np.concatenate(triangles).astype(np.uint32),
        np.concatenate(normals).astype(np.float32),
    )


def _sweep(
    points: NDArray[np.float64], widths: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Return the vertices, normals and triangles of one tube and its two flat ends."""
    steps = np.diff(points, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    along = np.concatenate([steps[:1], steps[:-1] + steps[1:], steps[-1:]])
    # Where the line turns back, the tube takes the direction of the next segment.
    short = np.linalg.norm(along, axis=1) < 1e-9
    along[short] = np.concatenate([steps, steps[-1:]])[short]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = _carry_across(along)
    up = np.cross(along, across)
    angles = 2 * np.pi * np.arange(SIDES) / SIDES
    out = (
        np.cos(angles)[None, :, None] * across[:, None]
        + np.sin(angles)[None, :, None] * up[:, None]
    )
    rings = points[:, None] + out * (widths / 2)[:, None, None]
    n = len(points)
    corner = np.arange(n * SIDES).reshape(n, SIDES)
    a, b = corner[:-1], np.roll(corner, -1, axis=1)[:-1]
    c, d = corner[1:], np.roll(corner, -1, axis=1)[1:]
    sides = np.concatenate([np.stack([a, b, d], -1), np.stack([a, d, c], -1)]).reshape(-1, 3)
    fan = np.stack([np.zeros(SIDES - 2, int), np.arange(1, SIDES - 1), np.arange(2, SIDES)], -1)
    first = n * SIDES
    ends = np.concatenate([fan[:, ::-1] + first, fan + first + SIDES])
    places = np.concatenate([rings.reshape(-1, 3), rings[0], rings[-1]])
    flat = [np.tile(-along[0], (SIDES, 1)), np.tile(along[-1], (SIDES, 1))]
    return places, np.concatenate([out.reshape(-1, 3), *flat]), np.concatenate([sides, ends])


def _carry_across(along: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a unit vector across the line at each point, with as little twist as possible."""
    axis = np.eye(3)[np.abs(along[0]).argmin()]
    carried = []
    for direction in along:
        across = axis - (axis @ direction) * direction
        if np.linalg.norm(across) < 1e-9:  # the line turned by a right angle towards the axis
            across = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
        axis = across / np.linalg.norm(across)
        carried.append(axis)
    return np.array(carried)
