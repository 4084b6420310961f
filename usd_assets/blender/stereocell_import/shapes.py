"""Turn the normals and tangents of a surface with it when its points are moved."""

import numpy as np


def turn_with(vectors, before, after, triangles, groups):
    """Return the vectors (n, 3) at a mesh's vertices, turned as the surface around them turned.

    Vectors of vertices whose triangles did not change are returned bit for bit.

    before     positions of the vertices before the edit (n, 3)
    after      positions of the vertices after the edit (n, 3)
    triangles  vertices of the triangles (m, 3)
    groups     group of each vertex (n,); the copies of a vertex along a UV seam share a group
    """
    moved = (before != after).any(axis=1)
    touched = np.zeros(len(before), bool)
    touched[triangles[moved[triangles].any(axis=1)]] = True
    touched = np.isin(groups, groups[touched])
    old, new = (_facing(points, triangles, groups)[touched] for points in (before, after))
    given = vectors[touched].astype(np.float64)
    # Rodrigues' formula for the shortest rotation from old to new
    axis, cosine = np.cross(old, new), (old * new).sum(axis=1, keepdims=True)
    along = (axis * given).sum(axis=1, keepdims=True)
    turned = cosine * given + np.cross(axis, given) + axis * along / np.maximum(1 + cosine, 1e-6)
    known = (np.abs(old).sum(axis=1) > 0) & (np.abs(new).sum(axis=1) > 0)
    turned = np.where(cosine < -1 + 1e-6, -given, turned)
    result = vectors.astype(np.float32).copy()
    result[touched] = np.where(known[:, None], turned, given)
    return result


def group_seams(before, after, normals):
    """Return a group for each vertex (n,): vertices with equal positions and normals share one."""
    rows = np.concatenate([before, after, normals], axis=1)
    return np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)


def cut_fans(counts, indices):
    """Return the triangles (m, 3) of polygons, each cut into a fan from its first corner.

    counts   number of corners of each polygon
    indices  vertices of all corners, polygon after polygon
    """
    starts = np.cumsum(counts) - counts
    fans = np.maximum(counts - 2, 0)
    first = np.repeat(starts, fans)
    step = np.arange(fans.sum()) - np.repeat(np.cumsum(fans) - fans, fans)
    return indices[np.stack([first, first + step + 1, first + step + 2], axis=1)]


def _facing(points, triangles, groups):
    """Return each vertex's unit normal (n, 3): the area-weighted mean over its group's triangles.

    The normal is 0 if the group has no triangles with an area.
    """
    a, b, c = points.astype(np.float64)[triangles].transpose(1, 0, 2)
    total = np.zeros((int(groups.max(initial=0)) + 1, 3))
    for corner in triangles.T:
        np.add.at(total, groups[corner], np.cross(b - a, c - a))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.divide(total, length, out=np.zeros_like(total), where=length > 1e-30)[groups]
