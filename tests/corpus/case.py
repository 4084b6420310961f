"""One volume of the corpus, with its truth."""

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

    group       labelled: a person or a model marked each voxel; outlined: the boundary follows
                from physics or a plain threshold; made: made by a script; nested: made by a
                script, objects within objects; empty: without a specimen; looked at: without a
                known truth, so that methods can only be compared with each other
    spacing_um  voxel spacing (z, y, x)
    load        returns the voxels (z, y, x) and the truth, bool (z, y, x); the truth is None if
                the volume is empty or the truth is unknown
    grid        rows and columns of the tiles that the volume is cut into
    held_out    whether no constant was chosen on this volume
    level       index of the level whose surface the truth belongs to: 0 is the outer one, 1
                the next one inside it
    source      origin of the volume; volumes of one source are held out together
    """

    name: str
    group: Group
    spacing_um: tuple[float, float, float]
    load: Callable[[], tuple[NDArray[Any], Mask | None]]
    kind: Kind = "microscopy"
    grid: tuple[int, int] = (2, 2)
    held_out: bool = False
    level: int = 0
    source: str = "made"
