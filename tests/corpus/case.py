"""One volume of the corpus: how it is loaded, and what is true of it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]
Group = Literal["labelled", "outlined", "made", "nested", "empty", "looked at"]
Kind = Literal["microscopy", "CT", "MR"]


@dataclass(frozen=True)
class Case:
    """A volume of one channel.

    group       labelled: a person or a model marked each voxel; outlined: physics or a plain
                threshold says where the outside ends; made: by script; nested: by script too,
                bodies within bodies; empty: nothing is there; looked at: nobody says what is
                there, so that only methods can be compared
    spacing_um  (z, y, x)
    load        returns the voxels (z, y, x) and the truth, bool (z, y, x); None: nothing
                is there, or nobody says what
    grid        rows and columns of the tiles it is cut into
    held_out    whether it was kept from all choosing of constants
    rung        which surface the truth is of: 0 the outer, 1 the next one within it
    source      who made the volume; volumes of one source are held out together
    """

    name: str
    group: Group
    spacing_um: tuple[float, float, float]
    load: Callable[[], tuple[NDArray[Any], Mask | None]]
    kind: Kind = "microscopy"
    grid: tuple[int, int] = (2, 2)
    held_out: bool = False
    rung: int = 0
    source: str = "made"
