"""Group DICOM frames into stacks: equal in all stated attributes, and parallel."""

from collections.abc import Iterable, Sequence

from stereocell.model.counted import agreeing, counted
from stereocell.read.formats.dicom.bed_positions import join_beds
from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.formats.dicom.frame_group import Group, axes_of, group_of, key_of
from stereocell.read.formats.dicom.join_uids import join_uids
from stereocell.read.formats.dicom.rounded_positions import restore_positions
from stereocell.read.formats.dicom.split_kinds import split_kinds
from stereocell.read.plane_stack import SAME_PLACE


def find_groups(frames: Iterable[Frame]) -> list[Group]:
    """Return a group of frames for each stack."""
    groups: dict[tuple[object, ...], list[Group]] = {}
    for frame in frames:
        alike = groups.setdefault(key_of(frame), [])
        group = next((group for group in alike if group.takes(frame)), None)
        if group is None:
            alike.append(Group(frame))
        else:
            group.add(frame)
    whole = join_uids([group for alike in groups.values() for group in alike])
    found = [part for group in whole for part in _parts(group)]
    for group in found:
        group.frames, notes = restore_positions(group.frames, axes_of(group)[0])
        group.notes += notes
        group.straighten()
    return found


def _parts(group: Group) -> list[Group]:
    """Return the group, or one group for each kind of frame in it."""
    normal, near = axes_of(group)[0], SAME_PLACE * min(group.spacing)
    parts = split_kinds(group.frames, normal, near)
    found = []
    for part in parts:
        frames, notes = join_beds(part.frames, normal, near)
        if len(parts) == 1 and not notes:
            return [group]
        small = group_of(frames)
        small.words, small.order, small.notes = part.words, part.order, (*group.notes, *notes)
        found.append(small)
    return found


def describe_neighbours(group: Group, groups: Sequence[Group]) -> tuple[str, ...]:
    """Return a sentence if other stacks of the series lie between a group's planes."""
    among = [other for other in _others(group, groups) if group.interleaves(other)]
    return _describe(group, among, "among")


def describe_elsewhere(group: Group, groups: Sequence[Group]) -> tuple[str, ...]:
    """Return a sentence if other stacks of the series lie beside a group's planes."""
    beside = [
        other
        for other in _others(group, groups)
        if other.frames[0].kind.words == group.frames[0].kind.words and not group.interleaves(other)
    ]
    return _describe(group, beside, "beside")


def _others(group: Group, groups: Sequence[Group]) -> list[Group]:
    """Return the stacks of the series that differ in an attribute, not only in their kind."""
    first = group.frames[0]
    if len(group.frames) < 2 or first.segmentation is not None:
        return []
    return [
        other
        for other in groups
        if other is not group
        and other.frames[0].series == first.series
        and group.differences(other)
    ]


def _describe(group: Group, others: Sequence[Group], where: str) -> tuple[str, ...]:
    if not others:
        return ()
    images = sum(len(other.frames) for other in others)
    apart = sorted({word for other in others for word in group.differences(other)})
    return (
        counted(images, "more image of the same series lies", "more images of the same series lie")
        + f" {where} these and {agreeing(images, 'is', 'are')} not built, because "
        f"{agreeing(images, 'it differs', 'they differ')} in {', '.join(apart)} "
        f"(`--series list` shows {agreeing(images, 'it', 'them')})",
    )
