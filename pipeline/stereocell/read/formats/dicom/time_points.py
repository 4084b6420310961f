"""Find the time points of a stack: several images of the same slices, in the order of time.

Time points are separated by the attribute that gives each place one frame per value, or else by one
that orders the frames of each place. Without such an attribute the frames at a place are counted by
their instance numbers. A time point that lacks slices, such as the last one of an acquisition that
was stopped, is incomplete and becomes a separate stack.
"""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.formats.dicom.split_kinds import find_runs

AreEqual = Callable[[Frame, Frame], bool]
Place = Sequence[Frame]  # frames at one place, by instance number

BY_REPETITION = "RepetitionTime"
BY_POSITION = "TemporalPositionIdentifier"
BY_IMAGE_INDEX = "ImageIndex"
# attributes that number time points: field of FrameKind, name in the standard
_NUMBERED = (
    ("temporal", BY_POSITION),
    ("cardiac", "NominalPercentageOfCardiacPhase"),
    ("trigger_time", "TriggerTime"),
    ("acquisition", "AcquisitionNumber"),
    ("reference_time", "FrameReferenceTime"),
    ("time_slice", BY_IMAGE_INDEX),
    ("repetition_time", BY_REPETITION),
)
BY_NUMBER = "InstanceNumber"
# smallest share of the slices in a run of instance numbers that counts as a time point
_LEAST_OF_RUN = 0.5


@dataclass(frozen=True, slots=True)
class Points:
    """Time points of frames that are sorted by place.

    whole       one frame per place, for each complete time point
    incomplete  frames of time points that lack some places
    attribute   name of the attribute that separates the time points
    whole_places, incomplete_places  indices of these time points among all, in the order of time
    values      values of the attribute for all time points, in that order; empty: it has no single
                value for each
    duplicates  number of frames that belong to no time point
    differ      whether duplicates have other pixels than the frames that are used
    """

    whole: tuple[tuple[Frame, ...], ...]
    incomplete: tuple[tuple[Frame, ...], ...] = ()
    attribute: str = ""
    whole_places: tuple[int, ...] = ()
    incomplete_places: tuple[int, ...] = ()
    values: tuple[float, ...] = ()
    duplicates: int = 0
    differ: bool = False


def find_points(
    places: Sequence[Place], normal: NDArray[np.float64], near_mm: float, are_equal: AreEqual
) -> Points:
    """Return the time points.

    places     frames by place, rising along the normal
    are_equal  compares the pixels of two frames; it is called only for frames at one place
    """
    first = tuple(place[0] for place in places)
    extra = sum(map(len, places)) - len(places)
    if not extra:
        return Points((first,))
    pairs = ((place[0], other) for place in places for other in place[1:])
    if all(are_equal(a, b) for a, b in pairs):  # stops at the first pair that differs
        return Points((first,), duplicates=extra)
    numbered = _numbered(places) or _ranked(places)
    numbered = numbered or _by_runs(places, normal, near_mm) or _by_rank(places)
    return numbered or Points((first,), duplicates=extra, differ=True)


def _numbered(places: Sequence[Place]) -> Points | None:
    """Return the time points by the first attribute that gives each place one frame per value."""
    for field, name in _NUMBERED:
        classes: dict[float, list[tuple[int, Frame]]] = defaultdict(list)
        for index, place in enumerate(places):
            for frame in place:
                classes[getattr(frame.kind, field)].append((index, frame))
        if None in classes or len(classes) < 2:
            continue
        values = sorted(classes)
        points = _divided([classes[value] for value in values], len(places), name)
        if points is not None:
            return replace(points, values=tuple(values))
    return None


def _ranked(places: Sequence[Place]) -> Points | None:
    """Return the time points by the first attribute that orders the frames of each place.

    Values at one time point may differ from slice to slice, as trigger times do with the heart
    rate.
    """
    if len({len(place) for place in places}) > 1:
        return None
    for field, name in _NUMBERED:
        orders = [[getattr(frame.kind, field) for frame in place] for place in places]
        if any(None in values or len(set(values)) < len(values) for values in orders):
            continue
        in_order = [sorted(p, key=lambda frame: getattr(frame.kind, field)) for p in places]
        return Points(tuple(zip(*in_order, strict=True)), (), name)
    return None


def _by_runs(places: Sequence[Place], normal: NDArray[np.float64], near_mm: float) -> Points | None:
    """Return the time points by instance numbers that run through the slices repeatedly."""
    index_of = {id(frame): index for index, place in enumerate(places) for frame in place}
    runs = find_runs([frame for place in places for frame in place], normal, near_mm)
    if len(runs) < 2 or min(map(len, runs)) < _LEAST_OF_RUN * len(places):
        return None
    numbered = [[(index_of[id(frame)], frame) for frame in run] for run in runs]
    return _divided(numbered, len(places), BY_NUMBER)


def _by_rank(places: Sequence[Place]) -> Points | None:
    """Return the time points by the order of instance numbers at each place."""
    counts = {len(place) for place in places}
    fewest, most = min(counts), max(counts)
    if fewest < 2:
        return None
    ranks: list[list[tuple[int, Frame]]] = [
        [(index, place[rank]) for index, place in enumerate(places) if len(place) > rank]
        for rank in range(most)
    ]
    return _divided(ranks, len(places), BY_NUMBER)


def _divided(
    points: Sequence[Sequence[tuple[int, Any]]], places: int, attribute: str
) -> Points | None:
    """Return complete and incomplete time points; None: a time point has two frames at a place."""
    if any(len({index for index, _ in point}) < len(point) for point in points):
        return None
    in_order = [tuple(frame for _, frame in sorted(p, key=lambda pair: pair[0])) for p in points]
    whole = tuple(i for i, point in enumerate(in_order) if len(point) == places)
    rest = tuple(i for i, point in enumerate(in_order) if len(point) < places)
    if not whole:
        return None
    chosen, others = (tuple(in_order[i] for i in group) for group in (whole, rest))
    return Points(chosen, others, attribute, whole, rest)
