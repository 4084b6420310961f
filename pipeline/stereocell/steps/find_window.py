"""The step that finds a channel's window, histogram and suggested 2D function."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from stereocell.engine.step import Document, Step
from stereocell.filters.background import find_background
from stereocell.filters.noise import NoiseSample, find_max_shift
from stereocell.isosurface.find_holder import find_holder
from stereocell.isosurface.holder import Holder
from stereocell.isosurface.level_evidence import (
    MAX_PADDING,
    Counting,
    denoising_reach,
    find_padding,
)
from stereocell.isosurface.level_histogram import Scale
from stereocell.model.image_plane import back_of_three, first_of_three, slices_back, slices_first
from stereocell.model.sample_boxes import SAMPLE_EDGE, sample_boxes
from stereocell.model.tiling import Box
from stereocell.read import Dataset
from stereocell.steps.open_source import Voxels, open_source
from stereocell.steps.units_again import AGAIN
from stereocell.transfer.adaptive_threshold import make_histogram
from stereocell.transfer.boundaries import SuggestedShapes, suggest
from stereocell.transfer.channel_statistics import ChannelStatistics, find_statistics
from stereocell.transfer.joint_histogram import (
    COLUMNS,
    FINE_ROWS,
    STEEPEST,
    count_joint,
    to_eight_bits,
)
from stereocell.transfer.options import WindowOptions

SURVEY_VOXELS = 16_000_000  # about the most voxels from which a channel's window is found
# Most voxels that are read at once and counted for the histogram. More voxels make a peak more
# certain. In a head of 384 x 384 x 274 voxels the second-highest peak rose 6.5 deviations above
# chance with all voxels, and 3.7 with every third plane.
COUNTED_VOXELS = 64_000_000
JOINT_VOXELS = 8_000_000  # most voxels at full resolution from which boundaries are found


@dataclass(frozen=True, slots=True)
class Window:
    """The first pass's results for a channel.

    counting   scale and padding with which the histograms of its tiles are counted
    holder     a CT's table or head holder, which is left out; None: there is none
    max_shift  most that smoothing may move the value of a voxel, in voxel values; None: no bound
    """

    statistics: ChannelStatistics
    counting: Counting
    holder: Holder | None = None
    max_shift: float | None = None


@cache
def _adapter() -> TypeAdapter[Window]:
    return TypeAdapter(Window)


def window_to_json(window: Window) -> dict[str, Any]:
    """Return a channel's window as plain values."""
    return dict(_adapter().dump_python(window, mode="json"))


def window_from_json(content: Mapping[str, Any]) -> Window:
    """Return the window from the output of `window_to_json`, which must have passed its schema."""
    return _adapter().validate_python(
        {key: content[key] for key in ("statistics", "counting", "holder", "max_shift")}
    )


WINDOW = Document("units.schema.json#Window", window_to_json, window_from_json, AGAIN)


@dataclass(frozen=True, slots=True)
class FindWindow(Step[Window]):
    """Find a channel's window and histogram, from a coarse level or from some of the planes.

    smoothing_um   standard deviation of the surface's smoothing
    background_um  size of the largest structures in front of the background; 0: none is subtracted
    max_shift      most that smoothing may move a value, in deviations of the noise; 0: no bound
    finds_holder   whether to look for a CT's table or head holder
    window         display window in voxel values, if the settings state it; None: it is found
    """

    VERSION: ClassVar[int] = 4
    FORM: ClassVar[Document[Window]] = WINDOW

    voxels: Voxels
    region: Box
    options: WindowOptions
    smoothing_um: float
    background_um: float
    max_shift: float
    finds_holder: bool = False
    window: tuple[float, float] | None = None

    def run(self) -> Window:
        """Return the window. Raises SourceError."""
        return _measure(self)


def _measure(task: FindWindow) -> Window:
    dataset = open_source(task.voxels.ref)
    level = task.voxels.level
    # the finest resolution level that is small enough, or every k-th plane of the coarsest
    while level + 1 < len(dataset.levels) and _voxels(task, dataset, level) > SURVEY_VOXELS:
        level += 1
    box = _region_at(task, dataset, level)
    spacing, axis = dataset.levels[level].spacing_um, dataset.slice_axis(level)
    step = -(-int(np.prod(box.shape, dtype=np.int64)) // SURVEY_VOXELS)
    slices = (
        [box.slab(axis, k, k + 1) for k in range(box.start[axis], box.stop[axis], step)]
        if step > 1
        else [box]
    )
    voxels = np.concatenate(
        [dataset.read(task.voxels.channel, each, level).voxels for each in slices], axis
    )
    mask = _mask_of([voxels] if level == task.voxels.level else _blocks(task, dataset))
    # the dark value of a mask is not padding
    least = darkest = float(voxels.min()) if mask is None else None
    across, rows, columns = first_of_three(denoising_reach(task.smoothing_um, spacing, axis), axis)
    reach = (0 if step > 1 else across, rows, columns)
    padding = slices_back(find_padding(slices_first(voxels, axis), darkest, reach), axis)
    if padding.mean() > MAX_PADDING:
        padding[...], darkest = False, None
    scale, background = Scale.of(voxels, padding), None
    if task.background_um > 0 and mask is None:
        # Planes are not denoised, because hot voxels and noise don't affect a percentile of whole
        # blocks. A median changed the mean Dice over 48 tiles of known solids by only .0006.
        background = find_background(
            voxels,
            task.region,
            spacing_um=dataset.levels[task.voxels.level].spacing_um,
            block_um=task.background_um,
            padding=padding if padding.any() else None,
        )
    holder = None
    if task.finds_holder:
        between, *in_plane = first_of_three(spacing, axis)
        apart = back_of_three((step * between, *in_plane), axis)
        holder = find_holder(voxels, apart, task.region)
    scale_above = None if background is None else scale.above(background)
    del padding
    statistics = find_statistics(voxels, task.options, background=background, window=task.window)
    is_whole = voxels.shape == task.region.shape
    del voxels
    built = None
    if not is_whole and _voxels(task, dataset, task.voxels.level) <= COUNTED_VOXELS:
        built = task.voxels.read(task.region).voxels
        statistics = replace(statistics, values=make_histogram(built, statistics.window))
    suggested, noise = _look_closely(task, dataset, built, window=statistics.window, darkest=least)
    statistics = replace(statistics, suggested=suggested)
    shift = find_max_shift(noise, task.max_shift, mask) if task.max_shift > 0 else None
    return Window(statistics, Counting(scale, scale_above, darkest, mask), holder, shift)


def _look_closely(
    task: FindWindow,
    dataset: Dataset,
    built: NDArray[Any] | None,
    *,
    window: tuple[float, float],
    darkest: float | None,
) -> tuple[SuggestedShapes, float]:
    """Return a suggested 2D function and the noise's deviation.

    They come from blocks of the level that is built, because coarser levels have softer edges and
    less noise.

    built    the region's voxels (z, y, x) if they were read; None: the blocks are read
    darkest  value of padding, in which no noise can be measured; None: there is no padding
    """
    axis = dataset.slice_axis(task.voxels.level)
    spacing = first_of_three(dataset.levels[task.voxels.level].spacing_um, axis)
    fine, noise = np.zeros((FINE_ROWS, COLUMNS), np.int64), NoiseSample()
    for voxels in _blocks(task, dataset, built):
        turned = np.ascontiguousarray(slices_first(voxels, axis))
        noise.add(turned, darkest)
        fine += count_joint(
            to_eight_bits(turned, window),
            spacing,
            gradient_max=STEEPEST,
            rows=FINE_ROWS,
        )
    return suggest(fine, spacing_um=spacing), noise.deviation()


def _blocks(
    task: FindWindow, dataset: Dataset, built: NDArray[Any] | None = None
) -> Iterator[NDArray[Any]]:
    """Yield blocks (z, y, x) of the level that is built, spread over the region.

    built  the region's voxels (z, y, x) if they were read; None: the blocks are read
    """
    largest = back_of_three(SAMPLE_EDGE, dataset.slice_axis(task.voxels.level))
    for box in sample_boxes(task.region, JOINT_VOXELS, largest):
        around = box.grown((1, 1, 1), task.region)
        yield (
            task.voxels.read(around).voxels
            if built is None
            else built[around.slices_in(task.region)]
        )


def _mask_of(blocks: Iterable[NDArray[Any]]) -> tuple[float, float] | None:
    """Return the two values of a mask, ascending; None: there are more values, or only one."""
    low, high = np.inf, -np.inf
    for voxels in blocks:
        least, most = float(voxels.min()), float(voxels.max())
        if not ((voxels == least) | (voxels == most)).all():
            return None
        found = {value for value in (low, high, least, most) if np.isfinite(value)}
        if len(found) > 2:
            return None
        low, high = min(found), max(found)
    return (low, high) if low < high else None


def _voxels(task: FindWindow, dataset: Dataset, level: int) -> int:
    return int(np.prod(_region_at(task, dataset, level).shape, dtype=np.int64))


def _region_at(task: FindWindow, dataset: Dataset, level: int) -> Box:
    """Return the region in voxels of another resolution level."""
    fine, coarse = dataset.levels[task.voxels.level].shape, dataset.levels[level].shape
    start = [a * n // m for a, n, m in zip(task.region.start, coarse, fine, strict=True)]
    stop = [-(-b * n // m) for b, n, m in zip(task.region.stop, coarse, fine, strict=True)]
    z0, y0, x0 = start
    z1, y1, x1 = (max(b, a + 1) for a, b in zip(start, stop, strict=True))
    return Box((z0, y0, x0), (z1, y1, x1))
