"""The content of a tile: units of work produce it, the stage writer takes it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stereocell.model.channel import PaintColors
from stereocell.model.mesh import Lod
from stereocell.model.object_table import ObjectTable, SharedWalls
from stereocell.model.spacing import Point, Spacing

APRON = 1  # voxels added around a volume on every side; trilinear filtering reads them
Provenance = dict[str, Any]
Representation = Literal["mesh", "volume", "both"]  # what is drawn of a tile


@dataclass(frozen=True, slots=True)
class ChannelContent:
    """The result of one (tile, channel).

    lods    finest first; empty: no surface
    volume  uint8 (z, y, x), window applied, with an apron of APRON voxels on every side; None: this
            is a further surface of another channel's voxels
    paint   colours of the channel that is sampled on the surface; None: no channel
    closed  STL file of a closed copy of the surface; None: no file
    measured  the volume's voxels as they were read; None: they are not kept
    objects   the table of the objects in `lods`, which count in it; None: it is no label map
    touching  walls of these objects to others; None: not known
    color     linear RGB 0..1, by which the tile shows the channel without its stage; None: by none
    """

    channel_id: str
    lods: tuple[Lod, ...]
    volume: NDArray[np.uint8] | None
    paint: PaintColors | None = None
    closed: Path | None = None
    measured: NDArray[Any] | None = None
    objects: ObjectTable | None = None
    touching: SharedWalls | None = None
    color: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class TileContent:
    """One tile with all its channels.

    spacing_um         distance between voxels, (z, y, x)
    first_um, last_um  (z, y, x) centres of its first own voxel and of its last lattice point: the
                       box that its meshes fill and that its volume shows
    own_shape          voxels (z, y, x) without the apron and without the planes shared with
                       neighbours. A volume has the lattice's shape (own + shared planes) + 2
    """

    id: str
    spacing_um: Spacing
    first_um: Point
    last_um: Point
    own_shape: tuple[int, int, int]
    channels: tuple[ChannelContent, ...]
