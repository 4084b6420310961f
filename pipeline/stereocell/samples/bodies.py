"""Solids with known surfaces: ellipsoids, balls and tubes. Lengths in um, axes (z, y, x).

Points are three arrays z, y, x (um) that broadcast together, so that a grid needs no full
coordinates. Sums are written out in code: a BLAS with more threads may add in another order, but
the samples must be equal to the last bit.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Triple = tuple[float, float, float]
Points = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Nucleus:
    """The nucleus of a cell: an ellipsoid, with a ball around it as the cell's body.

    center_um     (z, y, x)
    semi_axes_um  along the columns of `rotation`, a (3, 3) rotation of (z, y, x)
    brightness    brightness of the dye inside, as a factor of the channel's amplitude
    cell_um       radius of the cell body, a ball around the same centre; 0 outside the tumour
    """

    center_um: Triple
    semi_axes_um: Triple
    rotation: NDArray[np.float64]
    brightness: float
    cell_um: float

    @property
    def reach_um(self) -> float:
        """The largest distance of the surface from the centre."""
        return max(self.semi_axes_um)

    def distance(self, points: Points) -> Values:
        """Return signed distances in um, negative inside, in the broadcast shape of `points`.

        The first-order approximation is k0 (k0 - 1) / k1 with k0 = |p / a| and k1 = |p / a^2|. It
        is exact on the surface, and has a small relative error near it.

        References: Quilez, "Ellipsoid SDF", https://iquilezles.org/articles/ellipsoids/
        """
        z, y, x = _offsets(points, self.center_um)
        k0 = np.zeros(np.broadcast_shapes(z.shape, y.shape, x.shape))
        k1 = np.zeros_like(k0)
        for column, axis in zip(self.rotation.T, self.semi_axes_um, strict=True):
            square = (z * column[0] + y * column[1] + x * column[2]) ** 2
            k0 += square / axis**2
            k1 += square / axis**4
        k0, k1 = np.sqrt(k0), np.sqrt(k1)
        deepest = np.full_like(k0, -min(self.semi_axes_um))  # at the centre, where k1 is 0
        return np.divide(k0 * (k0 - 1.0), k1, out=deepest, where=k1 > 1e-9)

    def cell_distance(self, points: Points) -> Values:
        """Return signed distances in um to the cell body's ball, negative inside."""
        return _length(*_offsets(points, self.center_um)) - self.cell_um


@dataclass(frozen=True, slots=True)
class Tube:
    """A piece of vessel: all points within `radius_um` of a segment, with round ends."""

    start_um: Triple
    end_um: Triple
    radius_um: float

    @property
    def low_um(self) -> Triple:
        """The lower corner (z, y, x) of the bounding box."""
        z, y, x = (min(a, b) for a, b in zip(self.start_um, self.end_um, strict=True))
        return z - self.radius_um, y - self.radius_um, x - self.radius_um

    @property
    def high_um(self) -> Triple:
        """The upper corner (z, y, x) of the bounding box."""
        z, y, x = (max(a, b) for a, b in zip(self.start_um, self.end_um, strict=True))
        return z + self.radius_um, y + self.radius_um, x + self.radius_um

    def distance(self, points: Points) -> Values:
        """Return signed distances in um to the outer surface, negative inside."""
        z, y, x = _offsets(points, self.start_um)
        dz, dy, dx = (b - a for a, b in zip(self.start_um, self.end_um, strict=True))
        t = np.clip((z * dz + y * dy + x * dx) / (dz * dz + dy * dy + dx * dx), 0.0, 1.0)
        return _length(z - t * dz, y - t * dy, x - t * dx) - self.radius_um


def rotation_of(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (3, 3) rotation of a quaternion (w, x, y, z), float64 (4,), of any length above 0.

    A quaternion of four normally distributed numbers gives each rotation with equal probability.
    """
    w, x, y, z = quaternion
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return np.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
        ]
    )


def _offsets(points: Points, origin: Triple) -> Points:
    z, y, x = (axis - start for axis, start in zip(points, origin, strict=True))
    return z, y, x


def _length(z: Values, y: Values, x: Values) -> Values:
    return np.sqrt(z * z + y * y + x * x)
