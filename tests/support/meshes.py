"""Small closed meshes with known faults."""

from dataclasses import replace

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from stereocell.meshes.validity import Defects
from stereocell.model.mesh import Mesh


def to_mesh(surface: pv.PolyData) -> Mesh:
    positions = np.asarray(surface.points, np.float32)
    triangles = surface.regular_faces.astype(np.uint32)
    return Mesh(positions, triangles, np.zeros_like(positions))


def ball(radius: float = 5.0, sides: int = 24) -> Mesh:
    return to_mesh(pv.Sphere(radius=radius, theta_resolution=sides, phi_resolution=sides))


def joined(*meshes: Mesh) -> Mesh:
    starts = np.cumsum([0, *(len(mesh.positions) for mesh in meshes)])
    return Mesh(
        np.concatenate([mesh.positions for mesh in meshes]),
        np.concatenate(
            [m.triangles + np.uint32(start) for m, start in zip(meshes, starts[:-1], strict=True)]
        ),
        np.concatenate([mesh.normals for mesh in meshes]),
    )


def turned(mesh: Mesh) -> Mesh:
    return replace(mesh, triangles=np.ascontiguousarray(mesh.triangles[:, ::-1]))


def moved(mesh: Mesh, by: tuple[float, float, float]) -> Mesh:
    return replace(mesh, positions=mesh.positions + np.float32(by))


def crowd() -> Mesh:
    """Return a ball that six others almost touch; moves of full length would make them cross."""
    one, ways = ball(5.0, 60), 10.01 * np.concatenate([np.eye(3), -np.eye(3)])
    return joined(one, *(moved(one, tuple(way)) for way in ways))


def kinds(defects: Defects) -> set[str]:
    return {kind for kind, count in defects.counts.items() if count}


def _with(mesh: Mesh, triangles: NDArray[np.integer]) -> Mesh:
    return replace(mesh, triangles=triangles.astype(np.uint32))


SOUND = {
    "ball": ball(),
    "torus": to_mesh(pv.ParametricTorus(u_res=40, v_res=20).triangulate().clean()),
    "box": to_mesh(pv.Box((0, 1, 0, 2, 0, 3)).triangulate().clean()),
    "ball with a cavity": joined(ball(), turned(ball(3.0))),
    "ball in the cavity of a ball": joined(ball(), turned(ball(3.0)), ball(2.0)),
    "two balls": joined(ball(), moved(ball(), (11.0, 0.0, 0.0))),
    "nothing": _with(ball(), np.zeros((0, 3))),
}


def enclosed_volume(mesh: Mesh) -> float:
    """Return the volume by the divergence theorem; positive if triangles are wound outwards."""
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


def open_edges(mesh: Mesh) -> int:
    """Return the directed edges without an opposite edge."""
    t = mesh.triangles.astype(np.int64)
    edges = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    count = len(mesh.positions)
    return len(np.setdiff1d(edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]))


def welded(meshes: list[Mesh]) -> Mesh:
    """Join meshes into one that has one vertex at each place."""
    places, number = np.unique(
        np.concatenate([mesh.positions for mesh in meshes]), axis=0, return_inverse=True
    )
    starts = np.cumsum([0, *(len(mesh.positions) for mesh in meshes)])[:-1]
    triangles = np.concatenate(
        [
            mesh.triangles.astype(np.int64) + start
            for mesh, start in zip(meshes, starts, strict=True)
        ]
    )
    return Mesh(places, number.ravel()[triangles].astype(np.uint32), np.zeros_like(places))
