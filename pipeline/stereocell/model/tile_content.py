"""The content of a tile: what the units of work leave and the stage writer takes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.channel import PaintColors
from stereocell.model.mesh import Lod

APRON = 1  # voxels around the lattice's on every side of a volume: what trilinear filtering reads
Provenance = dict[str, Any]


@dataclass(frozen=True, slots=True)
class ChannelContent:
    """One (tile, channel): what a unit of work leaves.

    lods    finest first; empty: no surface
    volume  uint8 (z, y, x), window applied, with an apron of APRON voxels on every side
    paint   colours of the channel that is painted on the surface; None: none is
    closed  the STL of a closed copy of the surface; None: there is none
    """

    channel_id: str
    lods: tuple[Lod, ...]
    volume: NDArray[np.uint8]
    paint: PaintColors | None = None
    closed: Path | None = None


@dataclass(frozen=True, slots=True)
class TileContent:
    """One tile with all its channels.

    first_um, last_um  (z, y, x) centres of its first own voxel and of its last lattice point: the
                       box that its meshes fill and that its volume shows
    own_shape          voxels (z, y, x) without the apron and without the neighbours' shared plane.
                       The volumes' shape is the lattice's (own + shared planes) + 2
    """

    id: str
    spacing_um: tuple[float, float, float]
    first_um: tuple[float, float, float]
    last_um: tuple[float, float, float]
    own_shape: tuple[int, int, int]
    channels: tuple[ChannelContent, ...]
