"""Turn a surface's normals and tangents with it when its points are moved."""

import numpy as np


def turn_with(vectors, before, after, triangles, groups):
    """Return vectors (n, 3) at the vertices of a mesh turned as the surface round them turned.

    before, after  places (n, 3); triangles: (m, 3)
    groups         a number for each vertex (n,): vertices along a seam of UVs share theirs

    Vertices none of whose triangles changed keep theirs, bit by bit.
    """
    moved = (before != after).any(axis=1)
    touched = np.zeros(len(before), bool)
    touched[triangles[moved[triangles].any(axis=1)]] = True
    touched = np.isin(groups, groups[touched])
    old, new = (_facing(points, triangles, groups)[touched] for points in (before, after))
    given = vectors[touched].astype(np.float64)
    # the shortest turn from old to new (Rodrigues)
    axis, cosine = np.cross(old, new), (old * new).sum(axis=1, keepdims=True)
    along = (axis * given).sum(axis=1, keepdims=True)
    turned = cosine * given + np.cross(axis, given) + axis * along / np.maximum(1 + cosine, 1e-6)
    known = (np.abs(old).sum(axis=1) > 0) & (np.abs(new).sum(axis=1) > 0)
    turned = np.where(cosine < -1 + 1e-6, -given, turned)
    result = vectors.astype(np.float32).copy()
    result[touched] = np.where(known[:, None], turned, given)
    return result


def group_seams(before, after, normals):
    """Return a number for each vertex: those at one place with one normal share theirs."""
    rows = np.concatenate([before, after, normals], axis=1)
    return np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)


def cut_fans(counts, indices):
    """Return the triangles (m, 3) of faces with any number of corners."""
    starts = np.cumsum(counts) - counts
    fans = np.maximum(counts - 2, 0)
    first = np.repeat(starts, fans)
    step = np.arange(fans.sum()) - np.repeat(np.cumsum(fans) - fans, fans)
    return indices[np.stack([first, first + step + 1, first + step + 2], axis=1)]


def _facing(points, triangles, groups):
    """Return unit normals (n, 3) of the triangles round each group, by area; 0 where none are."""
    a, b, c = points.astype(np.float64)[triangles].transpose(1, 0, 2)
    total = np.zeros((int(groups.max(initial=0)) + 1, 3))
    for corner in triangles.T:
        np.add.at(total, groups[corner], np.cross(b - a, c - a))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.divide(total, length, out=np.zeros_like(total), where=length > 1e-30)[groups]
