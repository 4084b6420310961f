"""Find the iso-value of one (tile, channel), on a worker. Picklable."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.building.open_source import SourceRef, open_source
from stereocell.building.settings import Settings
from stereocell.filters.denoise import denoise
from stereocell.isosurface.isovalue import IsoValue, find_iso_value
from stereocell.isosurface.options import CRITERIA, IsoValueOptions
from stereocell.isosurface.repair_rules import sum_components
from stereocell.model.errors import NoSurfaceError
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.storage.json_files import write_sealed


@dataclass(frozen=True, slots=True)
class IsoTask:
    ref: SourceRef
    level: int
    channel: int
    box: Box
    settings: Settings
    given: float | None
    background: LatticeField | None


@dataclass(frozen=True, slots=True)
class IsoField:
    """The field in which an iso-value is searched, float32 (z, y, x): denoised, above background.

    below     mean of the background over the tile, voxel values; 0: none
    constant  the value of all voxels, background included; None: they differ
    """

    values: NDArray[np.float32]
    volume: Volume
    below: float
    constant: float | None

    def find_iso_value(self, options: IsoValueOptions) -> IsoValue:
        """Return the iso-value. Raises NoSurfaceError where all voxels are equal."""
        if self.constant is not None:  # the message has the voxels' value, background included
            raise NoSurfaceError(f"every voxel is {self.constant:g}")
        return find_iso_value(self.values, self.volume.spacing_um, options)


def read_iso_field(task: IsoTask) -> IsoField:
    """Read one unit's voxels, without a halo, and return the field to search in."""
    volume = open_source(task.ref).read(task.channel, task.box, task.level)
    field = denoise(volume, float(task.settings.surface.smoothing_um))
    first, below = float(field.flat[0]), 0.0
    is_constant = bool((field == first).all())
    if task.background is not None:
        under = task.background.at(task.box)
        below = float(np.mean(np.broadcast_to(under, field.shape), dtype=np.float64))
        field -= under
    return IsoField(field, volume, below, first if is_constant else None)


def write_iso(task_and_file: tuple[IsoTask, Path]) -> None:
    """Find one unit's iso-value and write it with its curve."""
    task, file = task_and_file
    write_sealed(file, _find(task))


def _find(task: IsoTask) -> dict[str, Any]:
    field = read_iso_field(task)
    result: dict[str, Any] = {
        "value": None, "confidence": 0.0, "reason": "", "background": field.below
    }  # fmt: skip
    try:
        if task.given is None and not CRITERIA[task.settings.isovalue.criterion].by_tile:
            raise NoSurfaceError("the channel's histogram has no peak: it has no threshold")
        found = field.find_iso_value(task.settings.isovalue)
    except NoSurfaceError as error:
        result["reason"] = str(error)
    else:
        result |= {"value": found.value, "found": found.value, "confidence": found.confidence}
        result |= {name: getattr(found, name) for name in ("sharpness", "raggedness", "strength")}
        level = found.value if task.given is None else task.given
        smallest = float(task.settings.surface.min_diagonal_um)
        sums = sum_components(field.values > level, field.volume.spacing_um, smallest)
        result["solids"] = asdict(sums)
        result["levels"] = [float(f"{v:.6g}") for v in found.levels]
        result["score"] = [round(float(v), 5) for v in found.score]
    if task.given is not None and "found" in result:  # a given value counts as certain
        result |= {"value": task.given, "confidence": 1.0}
    return result
