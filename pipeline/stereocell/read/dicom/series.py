"""Sort DICOM frames into stacks, each a volume, and label each without its description.

A stack has one series, one frame of reference, one StackID, one size of pixels and planes and one
orientation (read/dicom/group_frames.py): a localizer of three orientations makes three stacks. Of
frames at one place the first by instance number is taken. Where every place holds the same number
of frames, and they differ, they are time points (or echoes, or b-values) in the order of instance
numbers.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from stereocell.read.anatomical_axes import plane_name
from stereocell.read.dicom.frame import Frame
from stereocell.read.dicom.group_frames import Group, describe_neighbours, find_groups
from stereocell.read.plane_stack import (
    SAME_PLACE,
    NoStackError,
    StackLayout,
    lay_out,
    normal_of,
)

AreEqual = Callable[[Frame, Frame], bool]


@dataclass(frozen=True, slots=True)
class Stack:
    """Frames of one orientation.

    times    for each time point the frames along the normal; each point has the same number
    layout   the planes' grid; None: they make no volume, and `problem` gives the reason
    notes    changes and omissions, a sentence each
    """

    times: tuple[tuple[Frame, ...], ...]
    layout: StackLayout | None
    problem: str
    notes: tuple[str, ...]

    @property
    def first(self) -> Frame:
        """The first frame of the first time point."""
        return self.times[0][0]

    @property
    def voxels(self) -> int:
        """The number of voxels of the volume; without a volume, that of the frames' pixels."""
        if self.layout is not None:
            return int(np.prod(self.layout.shape, dtype=np.int64))
        return len(self.times[0]) * self.first.rows * self.first.columns

    @property
    def label(self) -> str:
        """Modality, orientation, size and spacing, without any description from the file."""
        frame = self.first
        normal = normal_of(frame.along_row, frame.along_column)
        segment = f", segment {frame.segment}" if frame.segment else ""
        name = f"{frame.modality or 'DICOM'}{segment}, {plane_name(normal)}"
        planes = len(self.times[0]) if self.layout is None else self.layout.shape[0]
        size = f"{planes} x {frame.rows} x {frame.columns}"
        if self.layout is None:
            return f"{name}, {size}: no volume ({self.problem})"
        spacing = " x ".join(f"{value:.4g}" for value in self.layout.spacing_mm)
        times = f", {len(self.times)} points in time" if len(self.times) > 1 else ""
        return f"{name}, {size} voxels (slices, rows, columns), {spacing} mm{times}"


def find_stacks(frames: Iterable[Frame], are_equal: AreEqual) -> tuple[Stack, ...]:
    """Return all stacks: volumes before others, images before segments, the largest first.

    are_equal  compares the pixels of two frames; it is called only for frames at one place
    """
    groups = find_groups(frames)
    stacks = [_stack(group, are_equal, describe_neighbours(group, groups)) for group in groups]
    stacks = _explain_single(stacks, groups)
    return tuple(
        sorted(
            stacks,
            key=lambda s: (
                s.layout is None,
                s.first.segmentation is not None,
                -s.voxels * len(s.times),
                s.first.file,
                s.first.index,
            ),
        )
    )


def _explain_single(stacks: list[Stack], groups: list[Group]) -> list[Stack]:
    """Where each of several stacks is one slice, name the attributes that separate them."""
    if len(stacks) < 2 or any(len(stack.times[0]) > 1 for stack in stacks):
        return stacks
    apart = sorted({word for group in groups[1:] for word in group.differences(groups[0])})
    problem = f"found {len(stacks)} stacks of one slice each, told apart by {', '.join(apart)}"
    return [replace(stack, problem=problem) for stack in stacks]


def _stack(group: Group, are_equal: AreEqual, neighbours: tuple[str, ...]) -> Stack:
    places = _places(group)
    counts = {len(place) for place in places}
    notes = list(neighbours)
    slices = 1 + max(frame.tile for frame in group.frames)
    if slices > 1:
        notes.append(f"mosaics of {slices} slices in one image: taken apart")
    extra = len(group.frames) - len(places)
    times = 1
    if extra:
        pairs = ((place[0], other) for place in places for other in place[1:])
        differ = any(not are_equal(a, b) for a, b in pairs)  # stops at the first pair that differs
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
            group.along_row,
            along_column=group.along_column,
            pixel_spacing_mm=group.spacing,
            plane_shape=(first.rows, first.columns),
        )
    except NoStackError as error:
        return Stack(by_time, None, str(error), tuple(notes))
    return Stack(by_time, layout, "", (*notes, *layout.notes))


def _places(group: Group) -> list[list[Frame]]:
    """Return frames by place, along the normal; at each place by instance number."""
    normal = normal_of(group.along_row, group.along_column)
    near = SAME_PLACE * min(group.spacing)
    rising = sorted(
        group.frames, key=lambda f: (float(normal @ f.position), f.number, f.file, f.index)
    )
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
