"""Where a tile's samples lie: the voxels read, the tile's own points, the region that is built."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stereocell.model.spacing import Point, Spacing
from stereocell.model.tiling import Box
from stereocell.model.volume import zyx_to_xyz

Step = tuple[int, int, int]  # every how many planes of voxels one is kept, (z, y, x)
Plane = tuple[int, float]  # axis of a position (0 x, 1 y, 2 z), and its value in um


@dataclass(frozen=True, slots=True)
class Lattice:
    """Where a tile's samples lie; boxes are half-open, (z, y, x), in voxels of the level.

    window      voxels that were read: arrays of the lattice cover them
    own         the tile's lattice points: the tile's cells lie between them
    region      voxels of the whole build: a tile is cut where `own` ends before the region does
    spacing_um  distance between samples, (z, y, x)
    origin_um   centre of voxel (0, 0, 0), (z, y, x); the same for all tiles of a build
    """

    window: Box
    own: Box
    region: Box
    spacing_um: Spacing
    origin_um: Point

    @classmethod
    def of_whole(cls, box: Box, spacing_um: Spacing, *, origin_um: Point = (0, 0, 0)) -> "Lattice":
        """Return the lattice of a volume that is a single tile, and the whole region."""
        return cls(box, box, box, spacing_um, origin_um)

    def alone(self) -> "Lattice":
        """Return the lattice of the tile's own points as if no other tile followed."""
        return Lattice.of_whole(self.own, self.spacing_um, origin_um=self.origin_um)

    def grown(self, voxels: int) -> "Lattice":
        """Return the lattice with `voxels` more own points on each side, within the region."""
        return replace(self, own=self.own.grown((voxels, voxels, voxels), self.region))

    def thinned(self, step: Step) -> "Lattice":
        """Return the lattice of every `step`-th plane (z, y, x), from the region's first on."""
        if step == (1, 1, 1):
            return self
        z, y, x = (h * k for h, k in zip(self.spacing_um, step, strict=True))
        first = zip(self.origin_um, self.region.start, self.spacing_um, strict=True)
        oz, oy, ox = (origin + start * h for origin, start, h in first)
        return Lattice(
            self.window.thinned(self.region, step),
            self.own.thinned(self.region, step, outward=True),
            self.region.thinned(self.region, step),
            (z, y, x),
            (oz, oy, ox),
        )

    def slices_of_thinned(self, step: Step) -> tuple[slice, slice, slice]:
        """Return the planes of the window that `thinned` keeps, as slices (z, y, x)."""
        starts = zip(
            self.window.thinned(self.region, step).start,
            self.region.start,
            self.window.start,
            step,
            strict=True,
        )
        z, y, x = (slice(a * k + first - low, None, k) for a, first, low, k in starts)
        return z, y, x

    def cuts(self) -> Iterator[tuple[int, int]]:
        """Yield each cut, where another tile follows: axis (0 z, 1 y, 2 x), index of the plane."""
        for axis in range(3):
            if self.own.start[axis] != self.region.start[axis]:
                yield axis, self.own.start[axis]
            if self.own.stop[axis] != self.region.stop[axis]:
                yield axis, self.own.stop[axis] - 1

    def own_box(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the least and largest corner of the tile's own points, float64 (x, y, z), um."""
        ends = np.array([self.own.start, np.array(self.own.stop) - 1])
        corners = zyx_to_xyz(ends * np.array(self.spacing_um) + np.array(self.origin_um))
        return corners.min(axis=0), corners.max(axis=0)

    def cut_planes(self) -> tuple[Plane, ...]:
        """Return the planes in which an extracted mesh is open: another tile follows there.

        Values are rounded to float32, as the mesh's positions are.
        """
        planes = []
        for axis, place in self.cuts():
            zyx = np.zeros(3)
            zyx[axis] = place * self.spacing_um[axis] + self.origin_um[axis]
            value = zyx_to_xyz(zyx).astype(np.float32)[2 - axis]  # rounded as vertices are
            planes.append((2 - axis, float(value)))
        return tuple(planes)
