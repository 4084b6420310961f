"""Split the parallel frames of a series if it holds several images of the same slices.

Some properties may change within one volume; for example, each slice of a CT may be a separate
acquisition. So a property separates frames only if its values compete for the same slices. They
compete if two values have frames at the same places, or if the slices of one lie regularly between
those of the other. Frames of values that don't compete stay together.

Acquisitions, and runs of instance numbers, are time points if they have the same places
(time_points.py). If their slices alternate, they are two volumes, unless the slices are so thin
that they fill each other's gaps, as in interleaved acquisitions.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.formats.dicom.kernel_names import kernel_of, kernel_words
from stereocell.read.formats.dicom.pet_kind import NOT_CORRECTED
from stereocell.read.formats.dicom.type_names import type_of, type_words

_SHARED = 0.5  # share of the smaller set's slices that must compete or alternate, at least
_MIN_WOVEN = 3  # fewest slices of a volume between the slices of another one
_GAPS = 1.5  # an interleaved acquisition's own slices are at least this many slice distances apart
_FILLS = 1.25  # slices of an interleaved acquisition are at most this many slice distances thick
_MAX_VALUES = 256  # values of a property; with more, it doesn't separate volumes
_MAX_RUNS = 8  # runs of instance numbers; with more, the numbers have no order
_NUMBER_MOST = 9999  # larger acquisition numbers are not shown, because they may be dates


@dataclass(frozen=True, slots=True)
class Property:
    """One property of frames that may separate volumes.

    find       returns a frame's value: a number, a text, a tuple of texts, or None
    words      returns a value in words for the user, given its index among the values
    tolerance  relative difference up to which two numbers count as one, since makers state measured
               values
    is_time    whether values with the same places are time points
    """

    find: Callable[[Frame], Any]
    words: Callable[[Any, int], str]
    tolerance: float = 0.0
    is_time: bool = False


def _kind(field: str) -> Callable[[Frame], Any]:
    return lambda frame: getattr(frame.kind, field)


def _measured(form: str) -> Callable[[Any, int], str]:
    return lambda value, _: "" if value is None else form.format(value)


def _correction_of(frame: Frame) -> int | None:
    is_corrected = frame.kind.is_attenuation_corrected
    return None if is_corrected is None else int(not is_corrected)


def _correction_words(value: Any, _: int) -> str:
    return {0: "attenuation corrected", 1: NOT_CORRECTED}.get(value, "")


def _units_of(frame: Frame) -> str:
    return frame.scale.units if frame.modality == "PT" else ""


def _acquisition_words(value: Any, place: int) -> str:
    is_shown = value is not None and 0 <= value <= _NUMBER_MOST
    return f"acquisition {value:g}" if is_shown else f"acquisition no. {place + 1}"


_ACQUISITION = Property(_kind("acquisition"), _acquisition_words, is_time=True)
PROPERTIES = (
    Property(kernel_of, kernel_words),
    Property(_correction_of, _correction_words),
    Property(_kind("energy_kev"), _measured("{:g} keV"), 0.01),
    Property(_kind("kvp"), _measured("{:g} kV"), 0.01),
    Property(
        _kind("has_agent"), lambda value, _: "with contrast agent" if value else "no contrast agent"
    ),
    Property(_kind("b_value"), _measured("b {:g} s/mm2"), 0.05),
    Property(_kind("echo_time"), _measured("echo time {:g} ms"), 0.01),
    Property(_kind("echo_number"), _measured("echo {:g}")),
    Property(_kind("inversion_time"), _measured("inversion time {:g} ms"), 0.01),
    Property(_kind("flip_angle"), _measured("flip angle {:g} degrees"), 0.01),
    Property(_units_of, lambda value, _: f"Units {value}" if value else "no Units"),
    Property(type_of, type_words),
    Property(lambda frame: frame.stated.thickness_mm, _measured("slices {:g} mm thick"), 0.05),
    _ACQUISITION,
)
# Properties that name series. Types and acquisitions have no words that a user knows.
NAMED = tuple(one for one in PROPERTIES if one.find is not type_of and one is not _ACQUISITION)


@dataclass(frozen=True, slots=True)
class Part:
    """Frames that form one volume, or several time points of it.

    words  words for the properties that separate them from others, for the user
    order  indices of these properties' values, for sorting
    """

    frames: tuple[Frame, ...]
    words: tuple[str, ...] = ()
    order: tuple[int, ...] = ()


def split_kinds(
    frames: Sequence[Frame], normal: NDArray[np.float64], near_mm: float
) -> tuple[Part, ...]:
    """Return the frames of parallel planes, separated by the properties that compete.

    normal   (3,), normal of all planes
    near_mm  planes that are closer together count as one place
    """
    parts = [Part(tuple(frames))]
    for one in PROPERTIES:
        parts = [small for part in parts for small in _split(part, one, normal, near_mm)]
    return tuple(small for part in parts for small in _split_runs(part, normal, near_mm))


def find_runs(
    frames: Sequence[Frame], normal: NDArray[np.float64], near_mm: float
) -> list[tuple[Frame, ...]]:
    """Return the runs of frames that move in one direction, in the order of instance numbers."""
    runs: list[list[Frame]] = []
    way, height = 0, 0.0
    for frame in sorted(frames, key=lambda f: (f.number, f.file, f.index)):
        step = float(normal @ frame.position) - height
        height += step
        sign = 0 if abs(step) <= near_mm else 1 if step > 0 else -1
        if runs and sign and (sign == way or len(runs[-1]) == 1):
            runs[-1].append(frame)
        else:
            runs.append([frame])
        way = sign
    return [tuple(run) for run in runs]


def _split(part: Part, one: Property, normal: NDArray[np.float64], near_mm: float) -> list[Part]:
    values = by_value(part.frames, one)
    if not 2 <= len(values) <= _MAX_VALUES:
        return [part]
    return _separate(part, values, one, (normal, near_mm))


def _split_runs(part: Part, normal: NDArray[np.float64], near_mm: float) -> list[Part]:
    """Separate the runs of instance numbers if each is a volume of its own."""
    runs = find_runs(part.frames, normal, near_mm)
    if not 2 <= len(runs) <= _MAX_RUNS or min(map(len, runs)) < _MIN_WOVEN:
        return [part]
    if any(frame.stated.thickness_mm is None for frame in part.frames):
        return [part]  # the slices may fill each other's gaps
    one = Property(lambda frame: frame.number, lambda _, i: f"run of numbers {i + 1}", is_time=True)
    return _separate(part, runs, one, (normal, near_mm))


def _separate(
    part: Part,
    values: Sequence[Sequence[Frame]],
    one: Property,
    measure: tuple[NDArray[np.float64], float],
) -> list[Part]:
    """Add the frames of each value to the first ones with which they don't compete."""
    merged: list[_Slices] = []
    for frames in values:
        new = _Slices(frames, *measure)
        place = next((i for i, there in enumerate(merged) if not _compete(there, new, one)), None)
        if place is None:
            merged.append(new)
        else:
            merged[place] = _Slices((*merged[place].frames, *frames), *measure)
    if len(merged) == 1:
        return [part]
    names = value_names(one, [one.find(slices.frames[0]) for slices in merged])
    return [
        Part(slices.frames, (*part.words, *filter(None, [name])), (*part.order, place))
        for place, (slices, name) in enumerate(zip(merged, names, strict=True))
    ]


def value_names(one: Property, values: Sequence[Any]) -> list[str]:
    """Return the values in words for the user; equal words of different values are numbered."""
    words = [one.words(value, place) for place, value in enumerate(values)]
    return [
        f"{word} no. {place + 1}" if word and words.count(word) > 1 else word
        for place, word in enumerate(words)
    ]


def by_value(frames: Sequence[Frame], one: Property) -> list[tuple[Frame, ...]]:
    """Return the frames by their value, in rising order; frames without a value come first."""
    pairs = [(one.find(frame), frame) for frame in frames]
    absent = tuple(frame for value, frame in pairs if value is None)
    stated = sorted((pair for pair in pairs if pair[0] is not None), key=lambda pair: pair[0])
    found: list[list[Frame]] = []
    last: Any = None
    for value, same in groupby(stated, key=lambda pair: pair[0]):
        is_near = one.tolerance > 0 and last is not None and value - last <= one.tolerance * value
        if not is_near:
            found.append([])
        found[-1] += [frame for _, frame in same]
        last = value
    return [*([absent] if absent else []), *map(tuple, found)]


class _Slices:
    """Frames, and the positions of their planes along the normal."""

    def __init__(
        self, frames: Sequence[Frame], normal: NDArray[np.float64], near_mm: float
    ) -> None:
        self.frames = tuple(frames)
        self.near_mm = near_mm
        self.heights = _distinct(np.array([normal @ f.position for f in frames]), near_mm)
        thick = [f.stated.thickness_mm for f in frames if f.stated.thickness_mm is not None]
        self.thickness_mm = float(np.median(thick)) if thick else None

    @property
    def gap_mm(self) -> float:
        """The median distance of neighbours; 0: there are none."""
        return float(np.median(np.diff(self.heights))) if len(self.heights) > 1 else 0.0


def _distinct(heights: NDArray[np.float64], near_mm: float) -> NDArray[np.float64]:
    rising = np.sort(heights)
    return rising[np.concatenate([[True], np.diff(rising) > near_mm])]


def _compete(a: _Slices, b: _Slices, one: Property) -> bool:
    fewer = min(len(a.heights), len(b.heights))
    nearest = np.abs(a.heights[:, None] - b.heights[None]).min(axis=1)
    shared = int((nearest <= a.near_mm).sum())
    if shared >= max(1.0, _SHARED * fewer):
        return not one.is_time
    return _are_woven(a, b) and not (one.is_time and _fill_gaps(a, b))


def _are_woven(a: _Slices, b: _Slices) -> bool:
    """Return whether the slices of two sets alternate over much of their common range."""
    fewer = min(len(a.heights), len(b.heights))
    if fewer < _MIN_WOVEN:
        return False
    common = min(a.heights[-1], b.heights[-1]) - max(a.heights[0], b.heights[0])
    shorter = min(np.ptp(a.heights), np.ptp(b.heights))
    owners = np.repeat([0, 1], [len(a.heights), len(b.heights)])
    owners = owners[np.argsort(np.concatenate([a.heights, b.heights]), kind="stable")]
    changes = int(np.count_nonzero(np.diff(owners)))
    return bool(common >= _SHARED * shorter and changes >= _SHARED * fewer)


def _fill_gaps(a: _Slices, b: _Slices) -> bool:
    """Return whether both together are one volume of touching slices, as if interleaved."""
    both = _distinct(np.concatenate([a.heights, b.heights]), a.near_mm)
    gap = float(np.median(np.diff(both)))
    thick = [one.thickness_mm for one in (a, b) if one.thickness_mm is not None]
    is_thin = bool(thick) and max(thick) <= _FILLS * gap
    return is_thin and min(a.gap_mm, b.gap_mm) >= _GAPS * gap
