"""Join overlapping bed positions of a whole-body PET scan, so that each place has one image.

A scanner is less sensitive towards the ends of its field of view, so each bed overlaps the next.
Most scanners merge the overlap; others write both images. The image that is farther from the end of
its bed has less noise and is used.
"""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.counted import agreeing, counted
from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.formats.dicom.split_kinds import find_runs

_LEAST_SLICES = 3  # fewest slices of a bed position


@dataclass(frozen=True, slots=True)
class _Bed:
    """Frames of one bed position, with the positions of the first and the last one, mm."""

    frames: tuple[Frame, ...]
    low: float
    high: float


def join_beds(
    frames: Sequence[Frame], normal: NDArray[np.float64], near_mm: float
) -> tuple[tuple[Frame, ...], tuple[str, ...]]:
    """Return one frame for each place of overlapping PET beds, and a note; other frames unchanged.

    normal   (3,), normal of all planes
    near_mm  planes that are closer together count as one place
    """
    given = tuple(frames)
    if any(frame.modality != "PT" for frame in given):
        return given, ()
    beds = _find_beds(given, normal, near_mm)
    if not any(after.low <= before.high + near_mm for before, after in pairwise(beds)):
        return given, ()
    taken = tuple(
        replace(frame, stated=replace(frame.stated, slices=None))
        for bed in beds
        for frame in bed.frames
        if _is_deepest(float(normal @ frame.position), bed, beds, near_mm)
    )
    lost = len(given) - len(taken)
    note = (
        f"{counted(len(beds), 'bed position')} overlap: where two beds have images at one place, "
        f"the image farther from the end of its bed is used, and {counted(lost, 'image')} "
        f"{agreeing(lost, 'is', 'are')} left out"
    )
    return taken, (note,)


def _find_beds(
    frames: tuple[Frame, ...], normal: NDArray[np.float64], near_mm: float
) -> list[_Bed]:
    """Return the beds from one end to the other; empty: no attribute separates beds."""
    by_value = [_by(frames, lambda f: f.kind.reference_time), _by(frames, _acquisition)]
    for groups in (*by_value, find_runs(frames, normal, near_mm)):
        if len(groups) < 2 or min(map(len, groups)) < _LEAST_SLICES:
            continue
        beds = sorted((_bed(group, normal) for group in groups), key=lambda bed: bed.low)
        is_stepped = all(
            after.low > before.low + near_mm and after.high > before.high + near_mm
            for before, after in pairwise(beds)
        )
        if is_stepped and all(_has_one_each(bed, normal, near_mm) for bed in beds):
            return beds
    return []


def _acquisition(frame: Frame) -> float | None:
    return frame.kind.acquisition


def _by(frames: Sequence[Frame], find: Callable[[Frame], Any]) -> list[tuple[Frame, ...]]:
    found: dict[Any, list[Frame]] = defaultdict(list)
    for frame in frames:
        found[find(frame)].append(frame)
    return [] if None in found else [tuple(group) for group in found.values()]


def _bed(frames: Sequence[Frame], normal: NDArray[np.float64]) -> _Bed:
    heights = [float(normal @ frame.position) for frame in frames]
    return _Bed(tuple(frames), min(heights), max(heights))


def _has_one_each(bed: _Bed, normal: NDArray[np.float64], near_mm: float) -> bool:
    heights = np.sort([float(normal @ frame.position) for frame in bed.frames])
    return bool((np.diff(heights) > near_mm).all())


def _is_deepest(height: float, bed: _Bed, beds: Sequence[_Bed], near_mm: float) -> bool:
    """Return whether the image is at least as far from its bed's ends as images of other beds."""
    own = min(height - bed.low, bed.high - height)
    for other in beds:
        depth = min(height - other.low, other.high - height)
        if other is bed or depth < -near_mm:
            continue
        # At equal distances, the image of the lower bed is used.
        if depth > own + near_mm or (abs(depth - own) <= near_mm and other.low < bed.low):
            return False
    return True
