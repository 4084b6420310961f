"""Sort DICOM frames into stacks, each a volume, and label each without its description.

A stack has one series, one frame of reference, one StackID, one size of pixels and planes, one
orientation (read/dicom/group_frames.py) and one kind of frame (read/dicom/split_kinds.py): a
localizer of three orientations makes three stacks, magnitude and phase make two. Several frames at
each place are points in time (read/dicom/points_in_time.py); a point that lacks slices is a stack
of its own. Of other frames at one place the first by instance number is taken.

Series are in the order of their best stacks, images before phases, projections and localizers, and
so are the stacks of a series. Larger series come first; of equal ones, images as acquired, and the
contrast that looks like a conventional image: in phase, water, opposed phase, fat.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stereocell.model.counted import agreeing, counted
from stereocell.read.anatomical_axes import plane_name
from stereocell.read.dicom.contradictions import geometry_notes
from stereocell.read.dicom.frame import Frame
from stereocell.read.dicom.frame_kind import LOCALIZER
from stereocell.read.dicom.group_frames import (
    Group,
    describe_elsewhere,
    describe_neighbours,
    find_groups,
)
from stereocell.read.dicom.points_in_time import BY_NUMBER, AreEqual, Points, find_points
from stereocell.read.plane_stack import (
    SAME_PLACE,
    NoStackError,
    StackLayout,
    lay_out,
    normal_of,
)
from stereocell.read.statements import omission

_LAST = 6  # rank of a stack that lacks slices of a point in time
_SIDE = 2  # from this rank on a series is no image, and follows the others however large it is


@dataclass(frozen=True, slots=True)
class Stack:
    """Frames of one orientation and kind.

    times    for each time point the frames along the normal; each point has the same number
    layout   the planes' grid; None: they make no volume, and `problem` gives the reason
    notes    changes and omissions, a sentence each
    words    what separates it from other stacks of the series, such as `magnitude`
    order    sorts it among those: rank of its kind, rank of its contrast, places of other values
    elsewhere  a sentence on other images of the series that lie beside these; empty: there are none
    """

    times: tuple[tuple[Frame, ...], ...]
    layout: StackLayout | None
    problem: str
    notes: tuple[str, ...]
    words: tuple[str, ...] = ()
    order: tuple[int, ...] = ()
    elsewhere: tuple[str, ...] = ()

    @property
    def first(self) -> Frame:
        """The first frame of the first time point."""
        return self.times[0][0]

    @property
    def frames(self) -> int:
        """The number of frames."""
        return sum(map(len, self.times))

    @property
    def rank(self) -> int:
        """Lower ranks are shown first."""
        return self.order[0] if self.order else 0

    @property
    def voxels(self) -> int:
        """The number of voxels of the volume; without a volume, that of the frames' pixels."""
        if self.layout is not None:
            return int(np.prod(self.layout.shape, dtype=np.int64))
        return len(self.times[0]) * self.first.rows * self.first.columns

    @property
    def label(self) -> str:
        """Modality, kind, orientation, size and spacing, without any description from the file."""
        frame = self.first
        normal = normal_of(frame.along_row, frame.along_column)
        segment = f", segment {frame.segment}" if frame.segment else ""
        kind = "".join(f", {word}" for word in self.words)
        name = f"{frame.modality or 'DICOM'}{segment}{kind}, {plane_name(normal)}"
        planes = len(self.times[0]) if self.layout is None else self.layout.shape[0]
        size = f"{planes} x {frame.rows} x {frame.columns}"
        if self.layout is None:
            return f"{name}, {size}: no volume ({self.problem})"
        spacing = " x ".join(f"{value:.4g}" for value in self.layout.spacing_mm)
        times = f", {len(self.times)} points in time" if len(self.times) > 1 else ""
        return f"{name}, {size} voxels (slices, rows, columns), {spacing} mm{times}"


def find_stacks(frames: Iterable[Frame], are_equal: AreEqual) -> tuple[Stack, ...]:
    """Return all stacks: volumes before others, images before segments, the largest series first.

    are_equal  compares the pixels of two frames; it is called only for frames at one place
    """
    groups = find_groups(frames)
    stacks = [
        replace(stack, elsewhere=describe_elsewhere(group, groups))
        for group in groups
        for stack in _stacks(group, are_equal, describe_neighbours(group, groups))
    ]
    return _sorted(_explain_single(stacks, groups))


def is_other_kind(other: Stack, stack: Stack) -> bool:
    """Return whether a stack has whole images of another kind from the same series."""
    is_same_series = other.first.series == stack.first.series and other is not stack
    return is_same_series and other.words != stack.words and _LAST not in (other.rank, stack.rank)


def _sorted(stacks: Sequence[Stack]) -> tuple[Stack, ...]:
    def own(stack: Stack) -> tuple[object, ...]:
        kind = stack.order[:2]
        return (kind, -stack.voxels, stack.order, stack.first.file, stack.first.index)

    best: dict[bytes, Stack] = {}
    for stack in sorted(stacks, key=lambda s: (s.layout is None, own(s))):
        best.setdefault(stack.first.series, stack)

    def key(stack: Stack) -> tuple[object, ...]:
        leader = best[stack.first.series]
        side = leader.rank if leader.rank >= _SIDE else 0
        total = -leader.voxels * len(leader.times)
        place = (side, total, leader.order[:2], leader.first.file, leader.first.index)
        return (stack.layout is None, stack.first.segmentation is not None, place, own(stack))

    return tuple(sorted(stacks, key=key))


def _explain_single(stacks: list[Stack], groups: list[Group]) -> list[Stack]:
    """Where each of several stacks is one slice, name the attributes that separate them."""
    slices = [stack for stack in stacks if stack.first.kind.role != LOCALIZER]
    if len(slices) < 2 or any(len(stack.times[0]) > 1 for stack in slices):
        return stacks
    apart = sorted({word for group in groups[1:] for word in group.differences(groups[0])})
    problem = f"found {len(slices)} stacks of one slice each, told apart by {', '.join(apart)}"
    if reasons := sorted({group.unjoined for group in groups if group.unjoined}):
        problem += f" (not joined: {', '.join(reasons)})"
    return [replace(stack, problem=problem) if stack in slices else stack for stack in stacks]


def _stacks(group: Group, are_equal: AreEqual, neighbours: tuple[str, ...]) -> list[Stack]:
    """Return the stack of a group, and one for each point in time that lacks slices."""
    normal = normal_of(group.along_row, group.along_column)
    near = SAME_PLACE * min(group.spacing)
    points = find_points(_places(group), normal, near, are_equal)
    kind = group.frames[0].kind
    words = (*kind.words, *_contrasts(group), *group.words)
    notes = [*group.notes, *neighbours]
    slices = 1 + max(frame.tile for frame in group.frames)
    if slices > 1:
        notes.append(f"mosaics of {slices} slices in one image: taken apart")
    notes += _time_notes(points)
    stacks = [
        _stack(points.whole, group, notes, words, (kind.rank, kind.contrast_rank, *group.order))
    ]
    for place, point in enumerate(points.incomplete):
        rest = f"incomplete point in time {len(points.whole) + place + 1}"
        order = (_LAST, kind.contrast_rank, *group.order, place)
        stacks.append(_stack((point,), group, [], (*words, rest), order))
    return stacks


def _stack(
    times: tuple[tuple[Frame, ...], ...],
    group: Group,
    notes: Sequence[str],
    words: tuple[str, ...],
    order: tuple[int, ...],
) -> Stack:
    first = times[0][0]
    if first.modality == "CT" and first.kind.role == LOCALIZER:
        problem = "localizers (scouts) of a CT are projections through the body, and no slices"
        return Stack(times, None, problem, tuple(notes), words, order)
    try:
        layout = lay_out(
            [frame.position for frame in times[0]],
            group.along_row,
            along_column=group.along_column,
            pixel_spacing_mm=group.spacing,
            plane_shape=(first.rows, first.columns),
        )
    except NoStackError as error:
        return Stack(times, None, str(error), tuple(notes), words, order)
    stated = geometry_notes(times[0], layout)
    found = (*notes, *layout.notes, *stated)
    return Stack(times, layout, "", found, words, order)


def _contrasts(group: Group) -> tuple[str, ...]:
    """Return the contrasts that all frames share and that `group.words` doesn't name already."""
    shared = {frame.kind.contrasts for frame in group.frames}
    named = ", ".join(group.words)
    return tuple(w for w in next(iter(shared)) if w not in named) if len(shared) == 1 else ()


def _time_notes(points: Points) -> list[str]:
    """Return what is said of frames that are in no whole point in time."""
    if points.duplicates:
        what = "the same pixels as"
        if points.differ:
            what = agreeing(points.duplicates, "other pixels than", "not all the same pixels as")
        return [
            f"{counted(points.duplicates, 'duplicate slice')} with {what} the one that is taken: "
            "the first by instance number"
        ]
    notes = []
    if points.attribute == BY_NUMBER:
        is_diffusion = points.whole[0][0].kind.is_diffusion
        what = "directions or b-values of diffusion" if is_diffusion else "points in time"
        images = len(points.whole) + len(points.incomplete)
        notes.append(
            f"{images} images at a place: {BY_NUMBER} alone tells them apart, {what} are assumed; "
            "--time picks one"
        )
    if not points.incomplete:
        return notes
    total, places = len(points.whole) + len(points.incomplete), len(points.whole[0])
    counts = ", ".join(str(len(point)) for point in points.incomplete[:4])
    more = ", ..." if len(points.incomplete) > 4 else ""
    lacking = len(points.incomplete)
    found = f"{lacking} of {total} points in time ({points.attribute})"
    reason = f"slices are missing ({counts}{more} of {places} are there)"
    return [
        *notes,
        omission(
            found, reason, f"{agreeing(lacking, 'it', 'each')} is a series of `--series list`"
        ),
    ]


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
