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
class Unit:
    """The result of one unit of work.

    closed   a closed copy of lod0, if one is asked for and the tile has connected components
    volume   uint8 (z, y, x): the lattice's voxels, window applied, and APRON voxels on every side
    reason   why there is no surface; empty if there is one
    seconds  time spent, by step
    measured  the same voxels as they were read; None: not kept, or `volume` is no different
    """

    lods: tuple[Lod, ...]
    closed: Closed | None
    volume: NDArray[np.uint8]
    reason: str
    fragments_dropped: int
    cavities_filled: int
    seconds: dict[str, float]
    measured: NDArray[Any] | None = None
