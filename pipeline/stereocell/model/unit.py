"""A unit as it was built: the surface and the volume of one (tile, channel)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.model.mesh import Lod, Mesh


@dataclass(frozen=True, slots=True)
class Closed:
    """A closed copy of a tile.

    faults     that are left, by the exact check
    fallbacks  bodies that simplification left as they were: all, where it left faults
    """

    mesh: Mesh
    faults: int
    fallbacks: int


@dataclass(frozen=True, slots=True)
class Unit:
    """What a unit leaves.

    closed   a closed copy of lod0, if that is asked for and there are solids
    volume   uint8 (z, y, x): the lattice's voxels, window applied, APRON voxels more on every side
    reason   why there is no surface; empty if there is one
    seconds  by step
    """

    lods: tuple[Lod, ...]
    closed: Closed | None
    volume: NDArray[np.uint8]
    reason: str
    fragments_dropped: int
    cavities_filled: int
    seconds: dict[str, float]
