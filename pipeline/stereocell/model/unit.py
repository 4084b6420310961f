"""The result of a unit: the surface and the volume of one (tile, channel)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.mesh import Lod, Mesh


@dataclass(frozen=True, slots=True)
class Closed:
    """A closed copy of a tile's surface.

    faults     defects that are left by the exact check
    fallbacks  components that were not simplified; all of them, if simplification left defects
    """

    mesh: Mesh
    faults: int
    fallbacks: int


@dataclass(frozen=True, slots=True)
class ObjectFacts:
    """Measurements of the n objects, or pieces of cut objects, in a unit of a label map.

    labels    uint64 (n,), labels, ascending
    voxels    int64 (n,), number of voxels
    area_um2  float64 (n,), area of the surface without the planes that cut an object into pieces
    interface_objects  int32 (m,), index of the object at each interface
    beside    uint64 (m,), label of the object on the other side
    interface_um2  float64 (m,), area of the interface
    means     float64 (n, channels), means of the image's channels over an object's voxels
    p95s      float64 (n, channels), their 95th percentiles; NaN for a piece
    pieces    int32 (k,), indices of the pieces
    quantiles float32 (k, channels, q), evenly spaced quantiles of each piece, from which the 95th
              percentile of the whole object is found
    changed   number of voxels changed so that no object touches itself at an edge or a corner
    bias      largest relative error of an object's volume in each level of detail
    stopped   levels of detail whose simplification stopped early, so that they are too fine
    thin      uint64 (k,), labels of objects too thin to be built; they are not among the n
    """

    labels: NDArray[np.uint64]
    voxels: NDArray[np.int64]
    area_um2: NDArray[np.float64]
    interface_objects: NDArray[np.int32]
    beside: NDArray[np.uint64]
    interface_um2: NDArray[np.float64]
    means: NDArray[np.float64]
    p95s: NDArray[np.float64]
    pieces: NDArray[np.int32]
    quantiles: NDArray[np.float32]
    changed: int
    bias: tuple[float, ...]
    stopped: tuple[int, ...]
    thin: NDArray[np.uint64]


# Share of the source's voxels above the level, 0..1; a note names a surface that leaves out more.
MAX_MISSING = 0.05


@dataclass(frozen=True, slots=True)
class Cover:
    """Numbers of voxels that show how well a solid encloses the source's voxels above the level.

    source   voxels of the source above the level, before any filter
    covered  voxels of `source` that lie in the solid
    solid    voxels in the solid
    """

    source: int
    covered: int
    solid: int

    def __add__(self, other: "Cover") -> "Cover":
        return Cover(
            self.source + other.source, self.covered + other.covered, self.solid + other.solid
        )

    @property
    def missing(self) -> float:
        """The share of the source's voxels above the level that the solid leaves out, 0..1."""
        return 1 - self.covered / self.source if self.source else 0.0

    @property
    def added(self) -> float:
        """The share of the solid in which the source lies below the level, 0..1."""
        return 1 - self.covered / self.solid if self.solid else 0.0

    @property
    def words(self) -> str:
        """The shares as text for a reader."""
        return (
            f"the solid covers {1 - self.missing:.1%} of the source's voxels above the iso-value, "
            f"and {self.added:.1%} of the solid lies below it"
        )


@dataclass(frozen=True, slots=True)
class Unit:
    """The result of one unit of work.

    closed    closed copy of lod0, if it is requested and the tile has a surface; otherwise None
    volume    uint8 (z, y, x): the lattice's voxels, window applied, and APRON voxels on every side;
              None for a label map
    reason    why there is no surface; empty: there is one
    seconds   seconds spent on each part of the work, such as `extract` (see Clock)
    measured  voxels of `volume` as measured; None: not kept, or equal to `volume`
    window    values of `measured` that are 0 and 255 in `volume`
    objects   measurements of a label map's objects; None for a channel of an image
    cover     how much of the source's voxels the solid encloses; None: there is no level, or this
              is a label map
    """

    lods: tuple[Lod, ...]
    closed: Closed | None
    volume: NDArray[np.uint8] | None
    reason: str
    fragments_dropped: int
    cavities_filled: int
    seconds: dict[str, float]
    measured: NDArray[Any] | None = None
    objects: ObjectFacts | None = None
    cover: Cover | None = None
    window: tuple[float, float] = (0.0, 255.0)
