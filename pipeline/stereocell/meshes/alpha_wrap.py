"""Wrap triangles by the alpha wrap of Portaneri et al., for comparison with the wrap of voxels.

The wrap of voxels (isosurface/repair.py) is the default, and much faster.

MeshLab offers the alpha wrap of CGAL. It closes each tile by itself, so its mesh does not meet the
meshes of neighbours. So it is only for builds of a single tile.

References
C. Portaneri, M. Rouxel-Labbe, M. Hemmer, D. Cohen-Steiner & P. Alliez, "Alpha wrapping with an
offset", ACM Trans. Graphics 41(4), 2022. doi:10.1145/3528223.3530152
"""

from typing import Any

import numpy as np

from stereocell.model.extra_packages import import_extra, version_of
from stereocell.model.mesh import Mesh

LIBRARY = "pymeshlab"


def find_wrapper() -> str:
    """Return the version of the wrapping package. Raises UsageError if it is not installed."""
    _import_wrapper()
    return version_of(LIBRARY)


def alpha_wrap(mesh: Mesh, alpha_um: float, offset_um: float) -> Mesh:
    """Return a closed mesh `offset_um` outside the triangles.

    mesh       positions float32 (n, 3) in um, triangles uint32 (m, 3)
    alpha_um   size of the gaps that are closed
    offset_um  distance of the result from the triangles
    """
    pymeshlab = _import_wrapper()
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(mesh.positions.astype(np.float64), mesh.triangles))
    meshes.generate_alpha_wrap(
        alpha=pymeshlab.PureValue(alpha_um), offset=pymeshlab.PureValue(offset_um)
    )
    wrapped = meshes.current_mesh()
    positions = wrapped.vertex_matrix().astype(np.float32)
    triangles = wrapped.face_matrix().astype(np.uint32)
    corners = positions[triangles].astype(np.float64)
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.stack(
        [np.bincount(triangles.ravel(), np.repeat(axis, 3), len(positions)) for axis in area.T], 1
    )
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh(positions, triangles, (normals / np.maximum(length, 1e-30)).astype(np.float32))


def _import_wrapper() -> Any:
    return import_extra(LIBRARY, extra="alpha-wrap", wanted_by="surface.wrap 'alpha-wrap'")
