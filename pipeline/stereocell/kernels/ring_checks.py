"""Check whether the triangles around a vertex stay valid when it moves onto a neighbour."""

import numpy as np

from stereocell.kernels.compiled import step
from stereocell.kernels.interface_rings import find_beyond
from stereocell.kernels.mesh_rings import is_surface
from stereocell.kernels.rings import TRIANGLES, Mesh, Ring
from stereocell.kernels.triangles import (
    Points,
    Triple,
    closest,
    doubled_area,
    smallest_angle_cosine,
)

TURN = 0.25  # squared cosine of the largest turn of a triangle: 60 degrees
SLIVER = 0.9945  # cosine of 6 degrees; the normal of a sharper triangle is not reliable


@step
def measure_ring(u: int, mesh: Mesh, ring: Ring, by_area: bool) -> tuple[Triple, float]:
    """Return the sum of the normals around u, each twice its triangle's area long, and a cosine.

    The cosine is that of the sharpest angle of the triangles around u.

    by_area  whether normals are summed; otherwise the sum is 0
    """
    worst, sum_x, sum_y, sum_z = 0.0, 0.0, 0.0, 0.0
    for k in range(ring.sizes[TRIANGLES]):
        a, b = ring.first[k], ring.second[k]
        worst = max(worst, smallest_angle_cosine(mesh.at, u, a, b))
        if by_area:
            x, y, z = doubled_area(mesh.at, u, a, b)
            sum_x, sum_y, sum_z = sum_x + x, sum_y + y, sum_z + z
    return (sum_x, sum_y, sum_z), worst


@step
def check_normals(u: int, v: int, mesh: Mesh, ring: Ring, form: tuple[Triple, float]) -> bool:
    """Return whether v may take the place of u in the triangles around u.

    form  sum of the normals around u from `measure_ring`, with which normals of slivers are
          compared (0: no sliver may turn), and the largest allowed cosine of a smallest angle
    """
    at, planes, ((sum_x, sum_y, sum_z), allowed) = mesh.at, mesh.planes, form
    length = sum_x * sum_x + sum_y * sum_y + sum_z * sum_z
    for k in range(ring.sizes[TRIANGLES]):
        x, y = ring.first[k], ring.second[k]
        if x == v or y == v:
            continue
        if planes[v] & planes[x] & planes[y]:
            return False
        ax, ay, az = doubled_area(at, u, x, y)
        nx, ny, nz = doubled_area(at, v, x, y)
        before, after = ax * ax + ay * ay + az * az, nx * nx + ny * ny + nz * nz
        along = ax * nx + ay * ny + az * nz
        if along <= 0 or along * along < TURN * before * after:
            if smallest_angle_cosine(at, u, x, y) < SLIVER:
                return False
            along = sum_x * nx + sum_y * ny + sum_z * nz
            if along <= 0 or along * along < TURN * length * after:
                return False
        if smallest_angle_cosine(at, v, x, y) > allowed:
            return False
    return True


@step
def measure_stray(u: int, v: int, mesh: Mesh, ring: Ring) -> float:
    """Return the distance of u, and of all vertices merged into it, from the result at v.

    The result is the triangles that replace those of u, or the line that u is on.
    """
    at = mesh.at
    if not is_surface(mesh) and mesh.on_line[u]:
        beyond = find_beyond(v, ring)
        if beyond >= 0:
            return at[u, 3] + _distance_to_segment(at, u, v, beyond)
    least = np.inf
    for k in range(ring.sizes[TRIANGLES]):
        x, y = ring.first[k], ring.second[k]
        if x != v and y != v:
            square, _ = closest(at[u, 0], at[u, 1], at[u, 2], at, v, x, y)
            least = min(least, square)
    return at[u, 3] + np.sqrt(least)


@step
def _distance_to_segment(at: Points, u: int, v: int, w: int) -> float:
    """Return the distance of u from the segment vw."""
    px, py, pz = at[w, 0] - at[v, 0], at[w, 1] - at[v, 1], at[w, 2] - at[v, 2]
    qx, qy, qz = at[u, 0] - at[v, 0], at[u, 1] - at[v, 1], at[u, 2] - at[v, 2]
    length = px * px + py * py + pz * pz
    share = (px * qx + py * qy + pz * qz) / length if length > 0 else 0.0
    share = min(max(share, 0.0), 1.0)
    dx, dy, dz = qx - share * px, qy - share * py, qz - share * pz
    return np.sqrt(dx * dx + dy * dy + dz * dz)
