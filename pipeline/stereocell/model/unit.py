"""The result of a unit: the surface and the volume of one (tile, channel)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.mesh import Lod, Mesh


@dataclass(frozen=True, slots=True)
class Closed:
    """A closed copy of a tile's surface.

    faults     defects that are left, by the exact check
    fallbacks  bodies that were not simplified: all of them, if simplification left defects
    """

    mesh: Mesh
    faults: int
    fallbacks: int


@dataclass(frozen=True, slots=True)
class ObjectFacts:
    """What a unit of a label map knows of its n objects, or pieces of objects, by their order.

    labels    uint64 (n,), their numbers in the label map, ascending
    voxels    int64 (n,)
    area_um2  float64 (n,), of the surface, without the planes that cut it into pieces
    walls     int32 (m,), which object touches another one; `beside` uint64 (m,), that one's number;
              `wall_um2` float64 (m,), the area that they share
    means     float64 (n, channels), of the image's channels over an object's voxels
    p95s      float64 (n, channels), their 95th percentiles; NaN: of a piece
    pieces    int32 (k,), which of the n are pieces; `quantiles` float32 (k, channels, q), of each,
              evenly from its least to its largest: the pieces' p95s are found together
    changed   voxels that were changed so that no object touches itself by an edge or a corner
    bias      the largest share of an object's volume that a level has more or less, by level
    stopped   levels of which simplifying did not come to an end: they are finer than is asked for
    thin      uint64 (k,), the numbers of objects too thin to be built, which are not among the n
    """

    labels: NDArray[np.uint64]
    voxels: NDArray[np.int64]
    area_um2: NDArray[np.float64]
    walls: NDArray[np.int32]
    beside: NDArray[np.uint64]
    wall_um2: NDArray[np.float64]
    means: NDArray[np.float64]
    p95s: NDArray[np.float64]
    pieces: NDArray[np.int32]
    quantiles: NDArray[np.float32]
    changed: int
    bias: tuple[float, ...]
    stopped: tuple[int, ...]
    thin: NDArray[np.uint64]


# Share of the source's voxels above a level, beyond which a surface that leaves them out is named
MAX_MISSING = 0.05


@dataclass(frozen=True, slots=True)
class Cover:
    """Voxels of the source above a surface's level, and the solid that is built, by their number.

    source   voxels above the level, as they were read
    covered  those of them that lie in the solid
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
        """Both shares, for a reader."""
        return (
            f"the solid covers {1 - self.missing:.1%} of the source's voxels above the level, and "
            f"{self.added:.1%} of the solid lies below it"
        )


@dataclass(frozen=True, slots=True)
class Unit:
    """The result of one unit of work.

    closed   a closed copy of lod0, if one is asked for and the tile has connected components
    volume   uint8 (z, y, x): the lattice's voxels, window applied, and APRON voxels on every side;
             None: of a label map
    reason   why there is no surface; empty if there is one
    seconds  time spent, by step
    measured  the same voxels as they were read; None: not kept, or `volume` is no different
    objects   of a label map; None: of an image's channel
    cover     of the surface by the source's voxels; None: there is no level, or a label map's
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
