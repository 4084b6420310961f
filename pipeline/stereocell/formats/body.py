"""A closed body with a name and a colour, as stored in 3MF, OBJ and PLY."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Body:
    """A closed triangle mesh with a name and a colour.

    srgb       colour, one byte for each of red, green and blue
    positions  float32 (n, 3), x, y, z, in the file's unit
    triangles  uint32 (m, 3), counter-clockwise from outside
    filament   number of the filament in a printer with several, from 1
    """

    name: str
    srgb: tuple[int, int, int]
    positions: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    filament: int = 1
