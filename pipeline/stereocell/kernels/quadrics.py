"""Quadric errors: the distance of a vertex from the planes of the triangles that it represents.

A price is the mean squared distance of a position from these planes. Its unit is the square of the
largest allowed error, so a price above 1 is not allowed. Prices fall into a few classes of cost,
and the cheapest class is processed first.

References
M. Garland & P. S. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.
doi:10.1145/258734.258849
"""

import numpy as np

from stereocell.kernels.compiled import part
from stereocell.kernels.triangles import Points, doubled_area

CLASSES = 6  # number of classes of cost
NEVER = 32000  # class of a vertex that has no collapse
SURE = 1 - 1e-9  # share of a class's bound; a lower price is in no higher class even after rounding


@part
def price_of(quadrics: Points, u: int, at: Points, v: int) -> float:
    """Return the mean squared distance of v from u's planes, in squares of u's error."""
    # Elements are indexed singly, because numba would count references to an array of one row.
    x, y, z = at[v, 0], at[v, 1], at[v, 2]
    square = quadrics[u, 0] * x * x + quadrics[u, 1] * y * y + quadrics[u, 2] * z * z
    square += quadrics[u, 9]
    square += 2 * (
        quadrics[u, 3] * x * y
        + quadrics[u, 4] * x * z
        + quadrics[u, 5] * y * z
        + quadrics[u, 6] * x
        + quadrics[u, 7] * y
        + quadrics[u, 8] * z
    )
    return max(square, 0.0) / quadrics[u, 10] if quadrics[u, 10] > 0 else 0.0


@part
def class_of(price: float) -> int:
    """Return the class of cost of a price; NEVER above 1."""
    return int(np.sqrt(price) * CLASSES) if price <= 1 else NEVER


@part
def add_plane(at: Points, a: int, b: int, c: int, errors: Points, quadrics: Points) -> None:
    """Add a triangle's plane, weighted by its doubled area, to its corners' quadrics.

    at        float64 (n, 3)
    errors    float64 (n,), largest allowed distance of each vertex from its planes
    quadrics  float64 (n, 11), written
    """
    x, y, z = doubled_area(at, a, b, c)
    w = np.sqrt(x * x + y * y + z * z)
    if w <= 0:
        return
    x, y, z = x / w, y / w, z / w
    d = -(x * at[a, 0] + y * at[a, 1] + z * at[a, 2])
    for v in (a, b, c):
        quadrics[v, 0] += w * x * x
        quadrics[v, 1] += w * y * y
        quadrics[v, 2] += w * z * z
        quadrics[v, 3] += w * x * y
        quadrics[v, 4] += w * x * z
        quadrics[v, 5] += w * y * z
        quadrics[v, 6] += w * x * d
        quadrics[v, 7] += w * y * d
        quadrics[v, 8] += w * z * d
        quadrics[v, 9] += w * d * d
        quadrics[v, 10] += w * errors[v] * errors[v]
