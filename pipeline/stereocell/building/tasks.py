"""What a worker is given and does: find a window, find an iso-value, build a unit. Picklable.

The keys of the results hold this module's whole lineage: see lineage.py.
"""

import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.building.open_source import SourceRef, open_source
from stereocell.building.settings import Settings
from stereocell.building.unit import UnitInput, build_unit
from stereocell.building.unit_files import save_unit
from stereocell.filters.background import find_background
from stereocell.filters.denoise import denoise
from stereocell.isosurface.isovalue import ADAPTIVE, IsoValue, IsoValueOptions, find_iso_value
from stereocell.isosurface.repair_rules import sum_solids
from stereocell.model.errors import NoSurfaceError
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.read import Dataset
from stereocell.storage.json_files import write_json
from stereocell.transfer.adaptive_threshold import Histogram, make_histogram
from stereocell.transfer.boundaries import Proposal, propose
from stereocell.transfer.channel_statistics import Display, display_to_json, find_display
from stereocell.transfer.joint_histogram import (
    COLUMNS,
    FINE_ROWS,
    STEEPEST,
    count_joint,
    sample_boxes,
    to_eight_bits,
)

SURVEY_VOXELS = 16_000_000  # a channel's window is found on at most about so many
# Peaks of the histogram are told from chance by their counts: of a head of 384 x 384 x 274 voxels
# the second-highest stands 6.5 deviations high with all of them, 3.7 with every third plane
COUNTED_VOXELS = 64_000_000
COUNTED_PLANES = 16  # at once
JOINT_VOXELS = 8_000_000  # and its boundaries on so many at full resolution


@dataclass(frozen=True, slots=True)
class DisplayTask:
    ref: SourceRef
    level: int
    channel: int
    region: Box
    settings: Settings
    subtracts: bool  # a background
    window: tuple[float, float] | None = None  # None: it is found


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
class UnitTask:
    ref: SourceRef
    level: int
    channel: int
    given: UnitInput
    directory: Path
    painted: int | None = None  # the channel that is painted on the surface


def write_display(task_and_file: tuple[DisplayTask, Path]) -> None:
    """Find a channel's window and write it down."""
    task, file = task_and_file
    write_json(file, display_to_json(run_display(task)))


def run_display(task: DisplayTask) -> Display:
    """Return a channel's window and histogram, from a coarse level or from some of the planes."""
    dataset = open_source(task.ref)
    level = task.level
    # the finest level that is small enough; a source without one gives every k-th plane
    while level + 1 < len(dataset.levels) and _voxels(task, dataset, level) > SURVEY_VOXELS:
        level += 1
    box = _region_at(task, dataset, level)
    step = -(-int(np.prod(box.shape, dtype=np.int64)) // SURVEY_VOXELS)
    planes = range(box.start[0], box.stop[0], step)
    voxels = np.concatenate(
        [
            dataset.read(
                task.channel, Box((z, *box.start[1:]), (z + 1, *box.stop[1:])), level
            ).voxels
            for z in planes
        ]
        if step > 1
        else [dataset.read(task.channel, box, level).voxels]
    )
    background = None
    if task.subtracts:
        surface = task.settings.surface
        # sharp hot voxels and noise don't reach a percentile of whole blocks: planes as they are.
        # A median before changed the mean Dice over 48 tiles of known solids by .0006
        background = find_background(
            voxels,
            task.region,
            dataset.levels[task.level].spacing_um,
            float(surface.background_um),
        )
    display = find_display(voxels, task.settings.window, background, task.window)
    if len(voxels) < task.region.shape[0] and _voxels(task, dataset, task.level) <= COUNTED_VOXELS:
        display = replace(display, values=_count_values(task, dataset, display.window))
    return replace(display, proposal=_propose(task, dataset, display.window))


def _count_values(task: DisplayTask, dataset: Dataset, window: tuple[float, float]) -> Histogram:
    """Return the histogram of all voxels of the region within the window."""
    (z0, *start), (z1, *stop) = task.region.start, task.region.stop
    counts: list[NDArray[np.int64]] = []
    for z in range(z0, z1, COUNTED_PLANES):
        box = Box((z, start[0], start[1]), (min(z + COUNTED_PLANES, z1), stop[0], stop[1]))
        part = make_histogram(dataset.read(task.channel, box, task.level).voxels, window)
        counts.append(np.array(part.counts))
    return replace(part, counts=tuple(int(n) for n in np.sum(counts, axis=0)))


def _propose(task: DisplayTask, dataset: Dataset, window: tuple[float, float]) -> Proposal:
    """Return a 2D function from blocks of the level that is built: coarse ones have no edges."""
    spacing = dataset.levels[task.level].spacing_um
    fine = np.zeros((FINE_ROWS, COLUMNS), np.int64)
    for box in sample_boxes(task.region, JOINT_VOXELS):
        around = box.grown((1, 1, 1), task.region)
        voxels = dataset.read(task.channel, around, task.level).voxels
        fine += count_joint(to_eight_bits(voxels, window), spacing, STEEPEST, FINE_ROWS)
    return propose(fine, spacing)


def _voxels(task: DisplayTask, dataset: Dataset, level: int) -> int:
    return int(np.prod(_region_at(task, dataset, level).shape, dtype=np.int64))


def _region_at(task: DisplayTask, dataset: Dataset, level: int) -> Box:
    """Return the region in voxels of a coarser level."""
    fine, coarse = dataset.levels[task.level].shape, dataset.levels[level].shape
    start = [a * n // m for a, n, m in zip(task.region.start, coarse, fine, strict=True)]
    stop = [-(-b * n // m) for b, n, m in zip(task.region.stop, coarse, fine, strict=True)]
    z0, y0, x0 = start
    z1, y1, x1 = (max(b, a + 1) for a, b in zip(start, stop, strict=True))
    return Box((z0, y0, x0), (z1, y1, x1))


@dataclass(frozen=True, slots=True)
class IsoField:
    """What iso-values are sought in, float32 (z, y, x): denoised, above the background.

    below     the background, mean over the tile; 0: none
    constant  what every voxel is, background and all; None: they differ
    """

    values: NDArray[np.float32]
    volume: Volume
    below: float
    constant: float | None

    def find_iso_value(self, options: IsoValueOptions) -> IsoValue:
        """Return the iso-value. Raises NoSurfaceError."""
        if self.constant is not None:  # said of the voxels as they are, not above the background
            raise NoSurfaceError(f"every voxel is {self.constant:g}")
        return find_iso_value(self.values, self.volume.spacing_um, options)


def read_iso_field(task: IsoTask) -> IsoField:
    """Read one unit's voxels, without a halo, and make of them what iso-values are sought in."""
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
    """Find one unit's iso-value and write it down with its curve."""
    task, file = task_and_file
    write_json(file, _find(task))


def _find(task: IsoTask) -> dict[str, Any]:
    field = read_iso_field(task)
    result: dict[str, Any] = {
        "value": None, "confidence": 0.0, "reason": "", "background": field.below
    }  # fmt: skip
    try:
        if task.given is None and task.settings.isovalue.criterion == ADAPTIVE:
            raise NoSurfaceError("the channel's histogram has no peak: it has no threshold")
        found = field.find_iso_value(task.settings.isovalue)
    except NoSurfaceError as error:
        result["reason"] = str(error)
    else:
        result |= {"value": found.value, "found": found.value, "confidence": found.confidence}
        result |= {name: getattr(found, name) for name in ("sharpness", "raggedness", "strength")}
        level = found.value if task.given is None else task.given
        smallest = float(task.settings.surface.min_diagonal_um)
        sums = sum_solids(field.values > level, field.volume.spacing_um, smallest)
        result["solids"] = asdict(sums)
        result["levels"] = [float(f"{v:.6g}") for v in found.levels]
        result["score"] = [round(float(v), 5) for v in found.score]
    if task.given is not None and "found" in result:  # who gives a value is sure of it
        result |= {"value": task.given, "confidence": 1.0}
    return result


def run_unit(task: UnitTask) -> None:
    """Build one unit and write it down."""
    start = time.perf_counter()
    source, window = open_source(task.ref), task.given.window
    volume = source.read(task.channel, window, task.level)
    painted = None if task.painted is None else source.read(task.painted, window, task.level)
    seconds = time.perf_counter() - start
    built = build_unit(volume, task.given, painted)
    save_unit(task.directory, replace(built, seconds={"read": seconds, **built.seconds}))
