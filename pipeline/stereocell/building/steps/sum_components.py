"""Sum up the components of one (tile, channel) at its level, on a worker. Picklable."""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from stereocell.building.open_source import SourceRef, open_source
from stereocell.filters.denoise import denoise
from stereocell.isosurface.repair_rules import sum_components
from stereocell.model.lattice import Step
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Box
from stereocell.storage.json_files import write_sealed


@dataclass(frozen=True, slots=True)
class ComponentsTask:
    """One tile of a channel.

    iso              the tile's level, above the background, voxel values
    background       near the tile, voxel values; None: none is subtracted
    min_diagonal_um  smaller components are left out
    max_shift        by how much smoothing may move a value, voxel values; None: by any
    step             voxels (z, y, x) between planes that carry the surface
    higher           a higher level that `iso` is compared with, in the same values; None: none
    """

    ref: SourceRef
    level: int
    channel: int
    box: Box
    smoothing_um: float
    iso: float
    background: LatticeField | None
    min_diagonal_um: float
    max_shift: float | None
    step: Step = (1, 1, 1)
    higher: float | None = None


def write_components(task_and_file: tuple[ComponentsTask, Path]) -> None:
    """Sum up a tile's components and write the sums."""
    task, file = task_and_file
    volume = open_source(task.ref).read(task.channel, task.box, task.level)
    field = denoise(volume, task.smoothing_um, task.max_shift)
    if task.background is not None:
        field -= task.background.at(task.box)
    inside = field > np.float32(task.iso)
    higher = None if task.higher is None else field > np.float32(task.higher)
    found = sum_components(
        inside, volume.spacing_um, task.min_diagonal_um, task.step, higher=higher
    )
    write_sealed(file, {"components": asdict(found)})
