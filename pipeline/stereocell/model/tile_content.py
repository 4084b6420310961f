"""The content of a tile. Units of work produce it, and the stage writer writes it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stereocell.model.channel import PaintColors
from stereocell.model.mesh import Lod
from stereocell.model.object_table import ObjectTable, SharedInterfaces
from stereocell.model.spacing import Point, Spacing

APRON = 1  # voxels added on every side of a volume, which trilinear filtering reads
Provenance = dict[str, Any]
Representation = Literal["mesh", "volume", "both"]  # how a tile is drawn


@dataclass(frozen=True, slots=True)
class ChannelContent:
    """The result of one (tile, channel).

    lods      levels of detail, finest first; empty: no surface
    volume    uint8 (z, y, x), window applied, with an apron of APRON voxels on every side; None:
              this is a further surface of another channel's voxels
    paint     colours of the painted surface; None: no channel is painted on it
    closed    STL file of a closed copy of the surface; None: there is none
    measured  voxels of the volume as measured; None: they are not kept
    objects   table of the objects in `lods`; its rows are the meshes' numbers; None: this is not a
              label map
    touching  interfaces of these objects; None: not known
    color     linear RGB, 0..1, with which the tile shows the channel without its stage; None: the
              default
    """

    channel_id: str
    lods: tuple[Lod, ...]
    volume: NDArray[np.uint8] | None
    paint: PaintColors | None = None
    closed: Path | None = None
    measured: NDArray[Any] | None = None
    objects: ObjectTable | None = None
    touching: SharedInterfaces | None = None
    color: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class TileContent:
    """One tile with all its channels.

    spacing_um         distance between voxels, (z, y, x)
    first_um, last_um  centres (z, y, x) of its first own voxel and of its last lattice point. They
                       span the box that its meshes fill and that its volume shows
    own_shape          voxels (z, y, x) without the apron and the planes shared with neighbours. The
                       shape of a volume is that of the lattice (own and shared planes) + 2
    """

    id: str
    spacing_um: Spacing
    first_um: Point
    last_um: Point
    own_shape: tuple[int, int, int]
    channels: tuple[ChannelContent, ...]
