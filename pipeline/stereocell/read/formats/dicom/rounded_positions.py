"""Give slices with rounded positions the regular distance that other attributes state.

Some tools for de-identification round ImagePositionPatient to whole millimetres. Slices 0.625 mm
apart are then 0 or 1 mm apart, so some seem to be duplicates and others seem to be missing.
Positions count as rounded if all of these hold:

- they are multiples of 1 or 0.1 mm, and their gaps are uneven or some are 0;
- SliceLocation, or the order of InstanceNumber with SpacingBetweenSlices or SliceThickness, states
  a regular distance that is not a multiple of that step;
- rounding explains all of them: each is within half a step of its regular place.

References: DICOM PS3.3 C.7.6.2 (Image Plane module).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.plane_stack import REGULAR
from stereocell.read.statements import Statement, Subject, Trust, settle

_STEPS_MM = (1.0, 0.1)  # steps of the rounding; finer ones leave the gaps even enough
_LEAST = 4  # fewest slices that show a regular distance
_SAME_PLANE = 1e-3  # share of the step; coordinates and places that differ less are equal
_DISTANCE = Subject("distance of slices", "mm", REGULAR, "--spacing-um z,y,x replaces it")
_BY_NUMBER = "with consecutive InstanceNumbers"


@dataclass(frozen=True, slots=True)
class _Regular:
    """A regular distance of slices that an attribute states.

    order  (n,): whole numbers, the place of each frame among the slices along the normal
    """

    distance_mm: float
    order: NDArray[np.float64]
    place: str
    trust: Trust


def restore_positions(
    frames: Sequence[Frame], normal: NDArray[np.float64]
) -> tuple[list[Frame], tuple[str, ...]]:
    """Return the frames at regular places if theirs were rounded, and the note on it.

    normal  (3,), normal of all planes
    """
    positions = np.array([frame.position for frame in frames])
    heights = positions @ normal
    step = _step_of(positions[:, np.abs(normal) > _SAME_PLANE])
    if len(frames) < _LEAST or step is None or _are_regular(heights, step):
        return list(frames), ()
    bound = step / 2 * float(np.abs(normal).sum()) * (1 + _SAME_PLANE)
    found = [
        one
        for one in _candidates(frames, heights)
        if not _is_multiple(one.distance_mm, step) and _spread(heights, one) <= 2 * bound
    ]
    if not found:
        return list(frames), ()
    gaps = np.diff(np.sort(heights))
    rounded = Statement(
        f"{gaps.min():.4g} to {gaps.max():.4g} mm",
        f"ImagePositionPatient, rounded to {step:g} mm,",
        Trust.DERIVED,
    )
    stated = [Statement(one.distance_mm, one.place, one.trust) for one in found]
    settled = settle(_DISTANCE, [*stated, rounded])
    chosen = found[stated.index(settled.chosen)]
    moved = _regular_positions(positions, normal, chosen, bound)
    return [
        replace(frame, position=(x, y, z))
        for frame, (x, y, z) in zip(frames, moved.tolist(), strict=True)
    ], settled.notes


def _step_of(coordinates: NDArray[np.float64]) -> float | None:
    """Return the step of which all coordinates are multiples; None: they are not rounded."""
    return next((step for step in _STEPS_MM if _is_multiple(coordinates, step)), None)


def _is_multiple(values: NDArray[np.float64] | float, step: float) -> bool:
    shares = np.asarray(values) / step
    return bool((np.abs(shares - np.rint(shares)) <= _SAME_PLANE).all())


def _are_regular(heights: NDArray[np.float64], step: float) -> bool:
    """Return whether the places are even, or whole multiples of one gap with some missing.

    The same number of frames at each place are time points.
    """
    rising = np.sort(heights)
    gaps = np.diff(rising)
    is_place = np.concatenate([[True], gaps > _SAME_PLANE * step])
    counts = np.diff(np.append(np.flatnonzero(is_place), len(rising)))
    if len(counts) < 2:  # all lie in one plane, so there is no distance
        return True
    if len(set(counts.tolist())) > 1:
        return False
    apart = gaps[gaps > _SAME_PLANE * step]
    multiples = apart / np.median(apart)
    return bool((np.abs(multiples - np.rint(multiples)) <= REGULAR * multiples).all())


def _candidates(frames: Sequence[Frame], heights: NDArray[np.float64]) -> list[_Regular]:
    found = []
    locations = _distinct([frame.stated.location_mm for frame in frames])
    if locations is not None:
        gap = float(np.median(np.diff(np.sort(locations))))
        order = np.rint((locations - locations.min()) / gap)
        if order.max() > 0 and len(set(order.tolist())) == len(order):
            distance = float(np.ptp(locations) / order.max())
            found.append(_directed(distance, order, heights, "SliceLocation", Trust.MEASURED))
    numbers = _distinct([float(frame.number) for frame in frames])
    if numbers is None:
        numbers = _distinct([frame.stated.in_stack for frame in frames])
    if numbers is None:
        return found
    for name, trust, values in (
        ("SpacingBetweenSlices", Trust.STATED, [f.stated.between_mm for f in frames]),
        ("SliceThickness", Trust.REPEATED, [f.stated.thickness_mm for f in frames]),
    ):
        same = set(values)
        distance = next(iter(same)) or 0.0
        if len(same) == 1 and distance > 0:
            place = f"{name} ({_BY_NUMBER})"
            found.append(_directed(distance, numbers - numbers.min(), heights, place, trust))
    return found


def _distinct(values: Sequence[float | None]) -> NDArray[np.float64] | None:
    """Return the values as an array; None: some are missing, or two are equal."""
    if None in values or len(set(values)) < len(values):
        return None
    return np.array(values, np.float64)


def _directed(
    distance: float,
    order: NDArray[np.float64],
    heights: NDArray[np.float64],
    place: str,
    trust: Trust,
) -> _Regular:
    """Return the statement with the order along the normal."""
    falls = float((order - order.mean()) @ (heights - heights.mean())) < 0
    return _Regular(distance, order.max() - order if falls else order, place, trust)


def _spread(heights: NDArray[np.float64], one: _Regular) -> float:
    """Return the range of the deviations from the regular places."""
    return float(np.ptp(heights - one.distance_mm * one.order))


def _regular_positions(
    positions: NDArray[np.float64], normal: NDArray[np.float64], one: _Regular, bound: float
) -> NDArray[np.float64]:
    """Return regular positions (n, 3), without a sideways drift that rounding explains."""
    centred = one.order - one.order.mean()
    drift = centred @ positions / (centred @ centred)
    drift -= (drift @ normal) * normal
    if np.abs(drift).max() * np.ptp(one.order) <= 2 * bound:
        drift = np.zeros(3)
    along = drift + one.distance_mm * normal
    return np.asarray(positions.mean(axis=0) + centred[:, None] * along)
