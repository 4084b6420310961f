"""Where a tile's samples lie: the voxels read, the tile's own points, the region that is built."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stereocell.model.spacing import Point, Spacing
from stereocell.model.tiling import Box
from stereocell.model.volume import zyx_to_xyz

# Spacings past the outermost points of a region at which a surface is closed: half a voxel, where
# the block ends
CAP = 0.5
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
    cap         spacings past the region's outermost points at which a surface is closed, between 0
                and 1; None: it stays open on these points' planes, as on those of a cut
    """

    window: Box
    own: Box
    region: Box
    spacing_um: Spacing
    origin_um: Point
    cap: float | None = CAP

    @classmethod
    def of_whole(cls, box: Box, spacing_um: Spacing, *, origin_um: Point = (0, 0, 0)) -> "Lattice":
        """Return the lattice of a volume that is a single tile, and the whole region."""
        return cls(box, box, box, spacing_um, origin_um)

    def alone(self) -> "Lattice":
        """Return the lattice of the tile's own points as if no other tile followed: closed."""
        cap = CAP if self.cap is None else self.cap
        return replace(self, window=self.own, region=self.own, cap=cap)

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
            self.cap,
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
        """Yield each plane in which a surface is open: axis (0 z, 1 y, 2 x), index of the plane.

        Another tile follows there, or the region ends and has no cap.
        """
        for axis in range(3):
            if self.cap is None or self.own.start[axis] != self.region.start[axis]:
                yield axis, self.own.start[axis]
            if self.cap is None or self.own.stop[axis] != self.region.stop[axis]:
                yield axis, self.own.stop[axis] - 1

    def ends(self) -> Iterator[tuple[int, float]]:
        """Yield each plane of a cap: axis (0 z, 1 y, 2 x), and where, as an index."""
        if self.cap is None:
            return
        for axis in range(3):
            if self.own.start[axis] == self.region.start[axis]:
                yield axis, self.own.start[axis] - self.cap
            if self.own.stop[axis] == self.region.stop[axis]:
                yield axis, self.own.stop[axis] - 1 + self.cap

    def own_box(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the least and largest corner of the tile's own points, float64 (x, y, z), um."""
        ends = np.array([self.own.start, np.array(self.own.stop) - 1])
        corners = zyx_to_xyz(ends * np.array(self.spacing_um) + np.array(self.origin_um))
        return corners.min(axis=0), corners.max(axis=0)

    def cut_planes(self) -> tuple[Plane, ...]:
        """Return the planes in which an extracted mesh is open, in the world.

        Values are rounded to float32, as the mesh's positions are.
        """
        return tuple(self._plane(axis, place) for axis, place in self.cuts())

    def cap_planes(self) -> tuple[Plane, ...]:
        """Return the planes of an extracted mesh's caps, in the world; rounded to float32."""
        return tuple(self._plane(axis, place) for axis, place in self.ends())

    def _plane(self, axis: int, place: float) -> Plane:
        zyx = np.zeros(3)
        zyx[axis] = place * self.spacing_um[axis] + self.origin_um[axis]
        value = zyx_to_xyz(zyx).astype(np.float32)[2 - axis]  # rounded as vertices are
        return 2 - axis, float(value)
