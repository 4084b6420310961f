"""Measures of single triangles, from which larger kernels are built."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import part

Points = NDArray[np.float64]
Triple = tuple[float, float, float]


@part
def doubled_area(at: Points, a: int, b: int, c: int) -> Triple:
    """Return the normal of the triangle (a, b, c), whose length is twice the area."""
    ux, uy, uz = at[b, 0] - at[a, 0], at[b, 1] - at[a, 1], at[b, 2] - at[a, 2]
    vx, vy, vz = at[c, 0] - at[a, 0], at[c, 1] - at[a, 1], at[c, 2] - at[a, 2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@part
def smallest_angle_cosine(at: Points, a: int, b: int, c: int) -> float:
    """Return the cosine of the smallest angle, .5 (best) to 1 (no area)."""
    x, y, z = 0.0, 0.0, 0.0
    for k in range(3):
        p, q, r = at[b, k] - at[c, k], at[c, k] - at[a, k], at[a, k] - at[b, k]
        x += p * p
        y += q * q
        z += r * r
    shortest = min(x, min(y, z))  # the smallest angle is opposite the shortest side
    others = max(x * y, max(y * z, z * x))
    if others <= 0:
        return 1.0
    return (x + y + z - 2 * shortest) / (2 * np.sqrt(others))


@part
def _square(x: float, y: float, z: float) -> float:
    return x * x + y * y + z * z


@part
def closest(
    px: float, py: float, pz: float, at: Points, a: int, b: int, c: int
) -> tuple[float, int]:
    """Return the squared distance of a point from the triangle (a, b, c), and the nearest part.

    The part is 0, 1, 2 for the corners a, b, c; 3, 4, 5 for the sides ab, bc, ca; 6 for the inside.

    References
    C. Ericson, "Real-Time Collision Detection", 2004, section 5.1.5
    """
    abx, aby, abz = at[b, 0] - at[a, 0], at[b, 1] - at[a, 1], at[b, 2] - at[a, 2]
    acx, acy, acz = at[c, 0] - at[a, 0], at[c, 1] - at[a, 1], at[c, 2] - at[a, 2]
    apx, apy, apz = px - at[a, 0], py - at[a, 1], pz - at[a, 2]
    d1, d2 = abx * apx + aby * apy + abz * apz, acx * apx + acy * apy + acz * apz
    if d1 <= 0 and d2 <= 0:
        return _square(apx, apy, apz), 0
    bpx, bpy, bpz = px - at[b, 0], py - at[b, 1], pz - at[b, 2]
    d3, d4 = abx * bpx + aby * bpy + abz * bpz, acx * bpx + acy * bpy + acz * bpz
    if d3 >= 0 and d4 <= d3:
        return _square(bpx, bpy, bpz), 1
    vc = d1 * d4 - d3 * d2
    if vc <= 0 and d1 >= 0 and d3 <= 0:
        v = d1 / (d1 - d3)
        return _square(apx - v * abx, apy - v * aby, apz - v * abz), 3
    cpx, cpy, cpz = px - at[c, 0], py - at[c, 1], pz - at[c, 2]
    d5, d6 = abx * cpx + aby * cpy + abz * cpz, acx * cpx + acy * cpy + acz * cpz
    if d6 >= 0 and d5 <= d6:
        return _square(cpx, cpy, cpz), 2
    vb = d5 * d2 - d1 * d6
    if vb <= 0 and d2 >= 0 and d6 <= 0:
        w = d2 / (d2 - d6)
        return _square(apx - w * acx, apy - w * acy, apz - w * acz), 5
    va = d3 * d6 - d5 * d4
    if va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        x, y, z = bpx - w * (acx - abx), bpy - w * (acy - aby), bpz - w * (acz - abz)
        return _square(x, y, z), 4
    whole = va + vb + vc
    if whole <= 0:  # no area
        return _square(apx, apy, apz), 0
    v, w = vb / whole, vc / whole
    return _square(apx - abx * v - acx * w, apy - aby * v - acy * w, apz - abz * v - acz * w), 6
