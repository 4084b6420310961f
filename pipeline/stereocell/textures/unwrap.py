"""UVs of a level of detail: charts that end at sharp edges, packed at a given density of texels.

xatlas makes the charts and packs them. It finds sharp edges by the normals alone, and our normals
are smooth. So xatlas gets the mesh cut along sharp edges, with the parts' own normals.

Padding and mip levels: a bilinear lookup inside a chart at mip level k reaches 1.5 * 2^k texels
beyond it, and two charts share the texels between them equally. So `padding` texels keep charts
apart up to the level k for which padding >= 3 * 2^k. With 6 texels these are levels 0 and 1. The
viewer replaces a level of detail by a coarser one before its texels, each as wide as a coarse
voxel, become much smaller than a pixel. So deeper mip levels, which mix the edges of charts, matter
only for the coarsest level.

On six of the demo's units, lod1 to lod3, charts cover 15 to 38 % of the texels: they are small, and
padding takes much of the rest. With 3 texels of padding (only mip level 0) they cover 25 to 41 %.
With texels a quarter as wide, 6 to 13 times as many, they cover 38 to 55 %. Packing by brute force
adds up to 4 %, and a larger `max_cost` of charts hardly anything.
"""

import atexit
import ctypes
import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.union_find import label_pairs
from stereocell.model.mesh import Mesh
from stereocell.textures.map_packages import import_unwrapper
from stereocell.textures.options import UnwrapOptions
from stereocell.textures.tangents import make_tangents

# xatlas 0.0.11 stops its worker threads without holding the lock on which they sleep. An atlas that
# is destroyed just when a worker goes to sleep then waits for it forever (seen once, in
# ~TaskScheduler). So an atlas is destroyed some unwraps later, when its workers sleep. The last
# ones are never destroyed, and end with the process.
ATLASES_KEPT = 4  # largest number of atlases that wait for their workers
_past_atlases: deque[Any] = deque()

SHARP_DEG = 75.0  # degrees between two triangles; on coarse levels 60 degrees are common
# Texels; edges of a map are multiples of this, so that mip level 1 still has blocks of 4
MULTIPLE = 8
# Largest number of times that texels grow, each by at least sqrt 2, before a level gets no maps
COARSENINGS = 3


@dataclass(frozen=True, slots=True)
class Unwrapped:
    """A mesh with UVs and tangents, split along the seams of its charts.

    size      (height, width) of its maps, texels
    texel_um  edge of a texel on the surface, um
    charts    number of charts
    """

    mesh: Mesh
    size: tuple[int, int]
    texel_um: float
    charts: int


def mip_levels_apart(padding: int) -> int:
    """Return the number of mip levels, from 0 on, at which a lookup in a chart reads no other.

    padding  texels between charts; see the module's docstring
    """
    return int(math.log2(padding / 3)) + 1


def unwrap(mesh: Mesh, options: UnwrapOptions) -> Unwrapped | str:
    """Return the mesh with UVs, or the reason why it has none: too many triangles or charts.

    mesh     positions float32 (n, 3) in um, triangles uint32 (m, 3); its normals do not change
    options  options whose `auto` lengths are replaced, see `UnwrapOptions.resolved`

    Raises UsageError without xatlas, which is a package of the extra `maps`.

    >>> import trimesh
    >>> ball = trimesh.creation.icosphere(subdivisions=3, radius=10)
    >>> corners, normals = np.float32(ball.vertices), np.float32(ball.vertex_normals)
    >>> mesh = Mesh(corners, np.uint32(ball.faces), normals)
    >>> found = unwrap(mesh, UnwrapOptions(texel_um=0.5))
    >>> found.charts > 1, found.mesh.uvs.shape == found.mesh.positions[:, :2].shape
    (True, True)
    >>> bool((found.mesh.uvs >= 0).all() and (found.mesh.uvs <= 1).all())
    True
    """
    xatlas = import_unwrapper()
    if len(mesh.triangles) > options.max_triangles:
        return f"{len(mesh.triangles):,} triangles, more than {options.max_triangles:,}"
    vertices, corners, normals = split_sharp_edges(mesh)
    texel_um = float(options.texel_um)
    for _ in range(COARSENINGS + 1):
        atlas = xatlas.Atlas()
        atlas.add_mesh(mesh.positions[vertices], corners, normals)
        charts, pack = xatlas.ChartOptions(), xatlas.PackOptions()
        charts.max_iterations = 1
        charts.normal_seam_weight = 1000.0  # with 1000 or more no chart crosses a seam
        pack.texels_per_unit, pack.padding = 1 / texel_um, options.padding
        atlas.generate(charts, pack)
        width, height = atlas.width, atlas.height
        longest = max(width, height)
        if longest <= options.max_texture:
            break
        count = atlas.chart_count
        _retire(atlas)
        texel_um *= max(math.sqrt(2), 1.05 * longest / options.max_texture)
    else:
        return f"{count:,} charts, too many for a map of {options.max_texture} texels"
    count = atlas.chart_count
    own, triangles, uvs = atlas.get_mesh(0)
    _retire(atlas)
    size = _rounded(height), _rounded(width)
    # The map is a few empty texels larger than the atlas.
    scale = np.array([width / size[1], height / size[0]])
    at = vertices[own]
    split = Mesh(
        mesh.positions[at],
        triangles.astype(np.uint32),
        mesh.normals[at],
        (uvs.astype(np.float64) * scale).astype(np.float32),
    )
    return Unwrapped(replace(split, tangents=make_tangents(split)), size, texel_um, count)


def split_sharp_edges(
    mesh: Mesh,
) -> tuple[NDArray[np.int64], NDArray[np.uint32], NDArray[np.float32]]:
    """Return the mesh cut open along its sharp edges, for xatlas.

    result  int64 (n,), the original vertex of each new one; triangles uint32 (m, 3); normals
            float32 (n, 3), means by area over triangles that no sharp edge separates
    """
    triangles = mesh.triangles.astype(np.int64)
    a, b, c = mesh.positions[triangles].astype(np.float64).transpose(1, 0, 2)
    facing = np.cross(b - a, c - a)
    unit = facing / np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-30)
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    corner = np.arange(start.size)
    after = np.roll(corner.reshape(-1, 3), -1, axis=1).ravel()
    edge = np.minimum(start, end) * len(mesh.positions) + np.maximum(start, end)
    order = np.argsort(edge, kind="stable")
    pair = np.flatnonzero(edge[order][1:] == edge[order][:-1])
    one, two = order[pair], order[pair + 1]
    cosine = (unit[one // 3] * unit[two // 3]).sum(axis=1)
    is_smooth = cosine > math.cos(math.radians(SHARP_DEG))
    one, two = one[is_smooth], two[is_smooth]
    # Two triangles have their common edge in opposite directions.
    joined = np.concatenate([one, after[one]]), np.concatenate([after[two], two])
    label, count = label_pairs(*joined, start.size)
    _, first = np.unique(label, return_index=True)
    total = [np.bincount(label, np.repeat(facing[:, k], 3), count) for k in range(3)]
    normals = np.stack(total, axis=1).astype(np.float64)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return start[first], label.reshape(-1, 3).astype(np.uint32), normals.astype(np.float32)


def _rounded(texels: int) -> int:
    return max(-(-texels // MULTIPLE), 1) * MULTIPLE


def _retire(atlas: Any) -> None:
    _past_atlases.append(atlas)
    if len(_past_atlases) > ATLASES_KEPT:
        _past_atlases.popleft()


@atexit.register
def _never_destroy_the_last() -> None:
    for atlas in _past_atlases:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(atlas))
