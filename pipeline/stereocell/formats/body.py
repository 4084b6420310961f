"""A closed body with a name and a colour, as 3MF, OBJ and PLY have it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Body:
    """A triangle mesh.

    srgb       bytes of its colour
    positions  float32 (n, 3), x, y, z, in the file's unit
    triangles  uint32 (m, 3), counter-clockwise from outside
    filament   the number of the filament that a printer of several uses for it, from 1
    """

    name: str
    srgb: tuple[int, int, int]
    positions: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    filament: int = 1
