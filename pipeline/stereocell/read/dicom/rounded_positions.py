"""Restore positions of slices that were rounded to whole millimetres, as some programs write them.

Slices 0.625 mm apart then share places, and slices 1.25 mm apart seem to miss some. Where another
attribute states a distance, and slices at that distance in the order of their instance numbers
round to the stated positions, the slices lie at this distance.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stereocell.read.dicom.frame import Frame

_LEAST = 4  # fewest slices that show a distance
_ROUNDED_MM = 1.0 + 1e-6  # largest difference of two errors of rounding


def restore_positions(
    frames: Sequence[Frame], normal: NDArray[np.float64]
) -> tuple[list[Frame], tuple[str, ...]]:
    """Return frames at their positions before rounding, and a note; else the same frames.

    normal  (3,), of all planes
    """
    positions = np.array([frame.position for frame in frames])
    numbers = np.array([frame.number for frame in frames], np.float64)
    is_counted = len(frames) >= _LEAST and len(set(numbers)) == len(frames)
    if not is_counted or not np.array_equal(positions, np.rint(positions)):
        return list(frames), ()
    heights = positions @ normal
    sign = np.sign(np.corrcoef(numbers, heights)[0, 1]) if np.ptp(heights) else 0.0
    for name, distance in _distances(frames, numbers):
        shifts = numbers[:, None] * (sign * distance * normal)
        starts = positions - shifts
        is_rounding = np.ptp(starts, axis=0).max() <= _ROUNDED_MM
        if sign and not distance.is_integer() and is_rounding:
            middle = (starts.max(axis=0) + starts.min(axis=0)) / 2
            x_y_z = (middle + shifts).tolist()
            found = [
                replace(frame, position=(x, y, z))
                for frame, (x, y, z) in zip(frames, x_y_z, strict=True)
            ]
            note = (
                "ImagePositionPatient holds whole millimetres alone, as after rounding: the slices "
                f"lie {distance:.4g} mm apart by {name}, in the order of InstanceNumber"
            )
            return found, (note,)
    return list(frames), ()


def _distances(
    frames: Sequence[Frame], numbers: NDArray[np.float64]
) -> Iterator[tuple[str, float]]:
    """Yield each attribute that states one distance of neighbouring slices, mm."""
    locations = [frame.stated.location_mm for frame in frames]
    order = np.argsort(numbers)
    known = np.array([np.nan if value is None else value for value in locations])[order]
    steps = np.abs(np.diff(known) / np.diff(numbers[order]))
    if np.isfinite(steps).all() and np.ptp(steps) <= 0.01 * steps.max(initial=0.0):
        yield "SliceLocation", float(steps.mean())
    for name, field in (("SpacingBetweenSlices", "between_mm"), ("SliceThickness", "thickness_mm")):
        values = {getattr(frame.stated, field) for frame in frames}
        value = values.pop()
        if not values and value:
            yield name, float(value)
