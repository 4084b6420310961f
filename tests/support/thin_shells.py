"""Thin sheets and shells of known thickness, which filters must not remove.

This module does not use stereocell. A voxel's value grows with the share that the body fills, so a
wall thinner than a voxel is a partial volume, as in an instrument.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from support.exhaustive import IS_EXHAUSTIVE

FINER = 4  # samples along each edge of a voxel
SIZE = 32  # voxels along an axis of spacing 1
GROUND, BODY = 100.0, 1100.0  # voxel values
NORMALS = {
    "across z": (1.0, 0.0, 0.0),
    "across y": (0.0, 1.0, 0.0),
    "across x": (0.0, 0.0, 1.0),
    "oblique": (0.48, 0.6, 0.64),
    "diagonal": (1.0, 1.0, 1.0),
}


@dataclass(frozen=True)
class ThinBody:
    """One body in a volume whose slices lie `ratio` times as far apart as pixels.

    shape       sphere, box, or one of NORMALS: a flat sheet
    thickness   of a sheet in voxels along its normal; of other walls in finest spacings
    slice_axis  index among (z, y, x) of the axis along which slices are stacked
    """

    shape: str
    thickness: float
    ratio: float
    slice_axis: int

    @property
    def spacing(self) -> tuple[float, float, float]:
        z, y, x = (self.ratio if axis == self.slice_axis else 1.0 for axis in range(3))
        return z, y, x

    def voxels(self, noise: float = 0.0) -> NDArray[np.float32]:
        """Return the voxels (z, y, x); `noise` is the standard deviation of their noise."""
        values = GROUND + (BODY - GROUND) * self._filled()
        if noise:
            values += np.random.default_rng(0).normal(0.0, noise, values.shape)
        return values.astype(np.float32)

    def _filled(self) -> NDArray[np.float64]:
        counts = [max(10, round(SIZE / step)) for step in self.spacing]
        fine = np.meshgrid(
            *((np.arange(n * FINER) + 0.5) / FINER - n / 2 for n in counts),
            indexing="ij",
            sparse=True,
        )
        inside = self._inside(fine)
        blocks = inside.reshape([part for n in counts for part in (n, FINER)])
        return blocks.mean(axis=(1, 3, 5))

    def _inside(self, fine: list[NDArray[np.float64]]) -> NDArray[np.bool_]:
        """Return which samples are in the wall; `fine` has their places in voxels."""
        if self.shape in NORMALS:
            normal = np.array(NORMALS[self.shape])
            normal /= np.linalg.norm(normal)
            away = sum(part * along for part, along in zip(normal, fine, strict=True)) - 0.3
            return np.abs(away) <= self.thickness / 2
        apart = [along * step - 0.3 * step for along, step in zip(fine, self.spacing, strict=True)]
        away = np.sqrt(sum(along**2 for along in apart))
        if self.shape == "box":
            away = np.maximum(np.maximum(np.abs(apart[0]), np.abs(apart[1])), np.abs(apart[2]))
        return np.abs(away - 0.36 * SIZE) <= self.thickness / 2


def thin_bodies() -> Iterator[ThinBody]:
    """Yield bodies of all shapes, thicknesses, ratios and slice axes.

    The sweep combines each body with every slice axis; otherwise the axes alternate.
    """
    shapes = ("sphere", "box", *NORMALS)
    cases = product(shapes, (0.5, 1, 1.5, 2, 3), (1, 2, 8))
    for number, (shape, thickness, ratio) in enumerate(cases):
        axes = range(3) if IS_EXHAUSTIVE else ((number + number // 3) % 3,)
        for axis in axes if ratio > 1 else (0,):
            yield ThinBody(shape, thickness, ratio, axis)


def count_components(solid: NDArray[np.bool_]) -> int:
    """Return the number of 26-connected components."""
    return int(ndimage.label(solid, np.ones((3, 3, 3)))[1])
