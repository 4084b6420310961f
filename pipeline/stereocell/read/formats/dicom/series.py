"""Sort DICOM frames into stacks, each a volume, and label each without its description.

A stack has one series, one frame of reference, one StackID, one size of pixels and planes, one
orientation (group_frames.py) and one kind of frame (split_kinds.py). A localizer with three
orientations makes three stacks; magnitude and phase make two. Several frames at each place are time
points (time_points.py); a time point that lacks slices is a separate stack. If several frames at
one place are not time points, the first by instance number is used.

Series are sorted by their best stacks, images before phases, projections and localizers, and so are
the stacks of a series. Larger series come first. Among equally large ones, images as acquired come
first, and contrasts that look like a conventional image: in phase, water, opposed phase, fat.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from stereocell.read.formats.dicom.contradictions import geometry_notes
from stereocell.read.formats.dicom.echo_phase import with_echo_phases
from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.formats.dicom.frame_group import Group
from stereocell.read.formats.dicom.frame_kind import LOCALIZER
from stereocell.read.formats.dicom.group_frames import (
    describe_elsewhere,
    describe_neighbours,
    find_groups,
)
from stereocell.read.formats.dicom.name_series import name_apart
from stereocell.read.formats.dicom.stack import Stack
from stereocell.read.formats.dicom.time_notes import point_name, time_notes
from stereocell.read.formats.dicom.time_points import AreEqual, find_points
from stereocell.read.plane_stack import (
    SAME_PLACE,
    NoStackError,
    lay_out,
    normal_of,
)

_LAST = 6  # rank of a stack that lacks slices of a time point
# Rank from which a series holds no images of anatomy. It follows all images, however large it is.
_SIDE = 2


def find_stacks(frames: Iterable[Frame], are_equal: AreEqual) -> tuple[Stack, ...]:
    """Return all stacks: volumes before others, images before segments, the largest series first.

    are_equal  compares the pixels of two frames; it is called only for frames at one place
    """
    groups = find_groups(with_echo_phases(frames))
    stacks = [
        replace(stack, elsewhere=describe_elsewhere(group, groups))
        for group in groups
        for stack in _stacks(group, are_equal, describe_neighbours(group, groups))
    ]
    return _sorted(_explain_single(name_apart(stacks), groups))


def is_other_kind(other: Stack, stack: Stack) -> bool:
    """Return whether a stack has complete images of another kind from the same series."""
    is_same_series = other.first.series == stack.first.series and other is not stack
    return is_same_series and other.words != stack.words and _LAST not in (other.rank, stack.rank)


def _sorted(stacks: Sequence[Stack]) -> tuple[Stack, ...]:
    def own(stack: Stack) -> tuple[object, ...]:
        kind = (*stack.order[:2], stack.among)
        return (kind, -stack.voxels, stack.order, stack.first.file, stack.first.index)

    best: dict[bytes, Stack] = {}
    for stack in sorted(stacks, key=lambda s: (s.layout is None, own(s))):
        best.setdefault(stack.first.series, stack)

    def key(stack: Stack) -> tuple[object, ...]:
        leader = best[stack.first.series]
        side = leader.rank if leader.rank >= _SIDE else 0
        total = -leader.voxels * len(leader.times)
        among = (leader.order[:2], leader.among)
        place = (side, total, among, leader.first.file, leader.first.index)
        return (stack.layout is None, stack.first.segmentation is not None, place, own(stack))

    return tuple(sorted(stacks, key=key))


def _explain_single(stacks: list[Stack], groups: list[Group]) -> list[Stack]:
    """If each of several stacks is one slice, name the attributes that separate them."""
    slices = [stack for stack in stacks if stack.first.kind.role != LOCALIZER]
    if len(slices) < 2 or any(len(stack.times[0]) > 1 for stack in slices):
        return stacks
    apart = sorted({word for group in groups[1:] for word in group.differences(groups[0])})
    problem = f"found {len(slices)} stacks of one slice each, which differ in {', '.join(apart)}"
    if reasons := sorted({group.unjoined for group in groups if group.unjoined}):
        problem += f" (not joined: {', '.join(reasons)})"
    return [replace(stack, problem=problem) if stack in slices else stack for stack in stacks]


def _stacks(group: Group, are_equal: AreEqual, neighbours: tuple[str, ...]) -> list[Stack]:
    """Return the stack of a group, and one for each time point that lacks slices."""
    normal = normal_of(group.along_row, group.along_column)
    near = SAME_PLACE * min(group.spacing)
    points = find_points(_places(group), normal, near, are_equal)
    kind = group.frames[0].kind
    words = (*kind.words, *_contrasts(group), *group.words)
    notes = [*group.notes, *neighbours]
    slices = 1 + max(frame.tile for frame in group.frames)
    if slices > 1:
        notes.append(f"mosaics of {slices} slices in one image: separated into slices")
    notes += time_notes(points)
    stacks = [
        _stack(points.whole, group, notes, words, (kind.rank, kind.contrast_rank, *group.order))
    ]
    for place, point in enumerate(points.incomplete):
        rest = f"incomplete {point_name(points, points.incomplete_places[place])}"
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
        problem = "localizers (scouts) of a CT are projections through the body, not slices"
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
    """Return the contrasts that all frames share and that `group.words` doesn't already name."""
    shared = {frame.kind.contrasts for frame in group.frames}
    named = ", ".join(group.words)
    return tuple(w for w in next(iter(shared)) if w not in named) if len(shared) == 1 else ()


def _places(group: Group) -> list[list[Frame]]:
    """Return frames by place, along the normal, and at each place by instance number."""
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
