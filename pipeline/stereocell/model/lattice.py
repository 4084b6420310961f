"""The lattice of a tile: the voxels that are read, its own points, and the region that is built."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stereocell.model.spacing import Point, Spacing
from stereocell.model.tiling import Box
from stereocell.model.volume import zyx_to_xyz

# Voxel spacings from the outermost points of a region to its caps, which close the surface. The
# block of voxels ends there.
CAP = 0.5
Step = tuple[int, int, int]  # (z, y, x): k keeps every k-th plane of voxels
Plane = tuple[int, float]  # axis of a position (0 x, 1 y, 2 z), and its value in um


@dataclass(frozen=True, slots=True)
class Lattice:
    """The lattice of a tile. Boxes are half-open, (z, y, x), in voxels of the level that is built.

    window      voxels that were read; arrays of the lattice cover them
    own         the tile's lattice points; the tile's cells lie between them
    region      voxels of the whole build; a tile is cut where `own` ends before the region does
    spacing_um  distance between samples, (z, y, x)
    origin_um   centre of voxel (0, 0, 0), (z, y, x); the same for all tiles of a build
    cap         distance of the caps from the region's outermost points, 0..1 spacings; None: the
                surface stays open there, as it does at a cut
    """

    window: Box
    own: Box
    region: Box
    spacing_um: Spacing
    origin_um: Point
    cap: float | None = CAP

    @classmethod
    def of_whole(cls, box: Box, spacing_um: Spacing, *, origin_um: Point = (0, 0, 0)) -> "Lattice":
        """Return the lattice of a volume that is the whole region and a single tile."""
        return cls(box, box, box, spacing_um, origin_um)

    def alone(self) -> "Lattice":
        """Return the lattice of the tile's own points, closed as if it had no neighbours."""
        cap = CAP if self.cap is None else self.cap
        return replace(self, window=self.own, region=self.own, cap=cap)

    def grown(self, voxels: int) -> "Lattice":
        """Return the lattice with `voxels` more own points on each side, but within the region."""
        return replace(self, own=self.own.grown((voxels, voxels, voxels), self.region))

    def thinned(self, step: Step) -> "Lattice":
        """Return the lattice of every `step`-th plane (z, y, x), from the region's first plane."""
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
        """Yield axis (0 z, 1 y, 2 x) and index of each plane in which the surface is open.

        Another tile follows there, or the region ends without a cap.
        """
        for axis in range(3):
            if self.cap is None or self.own.start[axis] != self.region.start[axis]:
                yield axis, self.own.start[axis]
            if self.cap is None or self.own.stop[axis] != self.region.stop[axis]:
                yield axis, self.own.stop[axis] - 1

    def ends(self) -> Iterator[tuple[int, float]]:
        """Yield axis (0 z, 1 y, 2 x) and fractional index of each plane of a cap."""
        if self.cap is None:
            return
        for axis in range(3):
            if self.own.start[axis] == self.region.start[axis]:
                yield axis, self.own.start[axis] - self.cap
            if self.own.stop[axis] == self.region.stop[axis]:
                yield axis, self.own.stop[axis] - 1 + self.cap

    def own_box(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the lower and upper corner of the tile's own points, float64 (x, y, z), um."""
        ends = np.array([self.own.start, np.array(self.own.stop) - 1])
        corners = zyx_to_xyz(ends * np.array(self.spacing_um) + np.array(self.origin_um))
        return corners.min(axis=0), corners.max(axis=0)

    def cut_planes(self) -> tuple[Plane, ...]:
        """Return the planes in which an extracted mesh is open, in world coordinates.

        Values are rounded to float32, like the mesh's positions.
        """
        return tuple(self._plane(axis, place) for axis, place in self.cuts())

    def cap_planes(self) -> tuple[Plane, ...]:
        """Return the planes of an extracted mesh's caps in world coordinates, in float32."""
        return tuple(self._plane(axis, place) for axis, place in self.ends())

    def _plane(self, axis: int, place: float) -> Plane:
        zyx = np.zeros(3)
        zyx[axis] = place * self.spacing_um[axis] + self.origin_um[axis]
        value = zyx_to_xyz(zyx).astype(np.float32)[2 - axis]  # rounded to float32 like vertices
        return 2 - axis, float(value)
