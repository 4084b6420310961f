"""A sphere with UVs, and a surface without values at its vertices."""

import numpy as np
import pyvista as pv

from stereocell.model.mesh import Mesh
from stereocell.textures.bake import FineSurface
from stereocell.textures.options import UnwrapOptions
from stereocell.textures.unwrap import Unwrapped, unwrap

SPACING = (0.2, 0.1, 0.1)


OPTIONS = UnwrapOptions().resolved(SPACING)


def sphere(radius: float = 5.0, sides: int = 96) -> Mesh:
    body = pv.Sphere(radius=radius, theta_resolution=sides, phi_resolution=sides)
    positions = np.asarray(body.points, np.float32)
    return Mesh(positions, body.regular_faces.astype(np.uint32), positions / np.float32(radius))


def unwrapped(mesh: Mesh, options: UnwrapOptions = OPTIONS) -> Unwrapped:
    found = unwrap(mesh, options)
    assert isinstance(found, Unwrapped), found
    return found


def bare(mesh: Mesh) -> FineSurface:
    """Return a surface without ambient occlusion and without a sampled channel."""
    return FineSurface(mesh, np.ones(len(mesh.positions), np.float32))
