"""Sort DICOM frames into stacks, each a volume, and say what each holds without its description.

A stack is one series, one frame of reference, one size of pixels and planes, one orientation: a
localizer of three orientations is three stacks. Of frames at one place the first by instance
number is taken; if every place holds the same number of them, and they differ, they are points in
time (or echoes, or b-values) in the order of instance numbers.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from stereocell.read.anatomy import plane_name
from stereocell.read.dicom_frame import Frame
from stereocell.read.stack_layout import (
    SAME_PLACE,
    NoStackError,
    StackLayout,
    lay_out,
    normal_of,
)

PARALLEL = 1e-3  # of the direction cosines: planes further apart in orientation are another stack

AreEqual = Callable[[Frame, Frame], bool]


@dataclass(frozen=True, slots=True)
class Stack:
    """Frames of one orientation.

    times    for each point in time the frames along the normal; all equally many
    layout   where they lie; None: they make no volume, and `problem` says why
    notes    what is left out or changed, a sentence each
    """

    times: tuple[tuple[Frame, ...], ...]
    layout: StackLayout | None
    problem: str
    notes: tuple[str, ...]

    @property
    def first(self) -> Frame:
        return self.times[0][0]

    @property
    def voxels(self) -> int:
        """How many the volume has; what can't be one has as many as its frames."""
        if self.layout is not None:
            return int(np.prod(self.layout.shape, dtype=np.int64))
        return len(self.times[0]) * self.first.rows * self.first.columns

    @property
    def label(self) -> str:
        """Modality, orientation, size and spacing: nothing that the file describes itself by."""
        frame = self.first
        normal = normal_of(frame.along_row, frame.along_column)
        name = f"{frame.modality or 'DICOM'}, {plane_name(normal)}"
        planes = len(self.times[0]) if self.layout is None else self.layout.shape[0]
        size = f"{planes} x {frame.rows} x {frame.columns}"
        if self.layout is None:
            return f"{name}, {size}: no volume ({self.problem})"
        spacing = " x ".join(f"{value:.4g}" for value in self.layout.spacing_mm)
        times = f", {len(self.times)} points in time" if len(self.times) > 1 else ""
        return f"{name}, {size} voxels (slices, rows, columns), {spacing} mm{times}"


def find_stacks(frames: Iterable[Frame], are_equal: AreEqual) -> tuple[Stack, ...]:
    """Return all stacks, volumes first, the largest first.

    `are_equal` compares the pixels of two frames; it is asked only about frames at one place.
    """
    stacks = [_stack(group, are_equal) for group in _groups(frames)]
    return tuple(
        sorted(
            stacks,
            key=lambda s: (s.layout is None, -s.voxels * len(s.times), s.first.file, s.first.index),
        )
    )


def _groups(frames: Iterable[Frame]) -> Iterator[list[Frame]]:
    groups: dict[tuple[object, ...], list[list[Frame]]] = {}
    for frame in frames:
        rows, columns = frame.spacing
        key = (
            frame.series, frame.reference, frame.modality, frame.rows, frame.columns,
            f"{rows:.4g} {columns:.4g}",
        )  # fmt: skip
        alike = groups.setdefault(key, [])
        group = next((g for g in alike if _is_parallel(g[0], frame)), None)
        if group is None:
            alike.append([frame])
        else:
            group.append(frame)
    for alike in groups.values():
        yield from alike


def _is_parallel(a: Frame, b: Frame) -> bool:
    ours, theirs = (np.array([f.along_row, f.along_column]) for f in (a, b))
    return bool(np.abs(ours - theirs).max() < PARALLEL)


def _stack(frames: list[Frame], are_equal: AreEqual) -> Stack:
    places = _places(frames)
    counts = {len(place) for place in places}
    notes: list[str] = []
    extra = len(frames) - len(places)
    times = 1
    if extra:
        pairs = ((place[0], other) for place in places for other in place[1:])
        differ = any(not are_equal(a, b) for a, b in pairs)  # the first that differs ends it
        if counts == {max(counts)} and differ:
            times = max(counts)
        else:
            what = "not all with the same pixels as" if differ else "with the same pixels as"
            notes.append(
                f"{extra} duplicate slices, {what} the one that is taken: the first by instance "
                "number"
            )
    by_time = tuple(tuple(place[time] for place in places) for time in range(times))
    first = by_time[0][0]
    try:
        layout = lay_out(
            [frame.position for frame in by_time[0]],
            first.along_row,
            first.along_column,
            first.spacing,
            (first.rows, first.columns),
        )
    except NoStackError as error:
        return Stack(by_time, None, str(error), tuple(notes))
    return Stack(by_time, layout, "", (*notes, *layout.notes))


def _places(frames: Sequence[Frame]) -> list[list[Frame]]:
    """Return frames by place, along the normal; at each place by instance number."""
    first = frames[0]
    normal = normal_of(first.along_row, first.along_column)
    near = SAME_PLACE * min(first.spacing)
    rising = sorted(frames, key=lambda f: (float(normal @ f.position), f.number, f.file, f.index))
    places: list[list[Frame]] = []
    for frame in rising:
        there = np.array(places[-1][0].position) if places else None
        if there is not None and np.linalg.norm(there - frame.position) <= near:
            places[-1].append(frame)
        else:
            places.append([frame])
    for place in places:
        place.sort(key=lambda f: (f.number, f.file, f.index))
    return places
