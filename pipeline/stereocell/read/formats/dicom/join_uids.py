"""Join stacks whose UIDs change along one volume, as after de-identification.

De-identification may replace SeriesInstanceUID or FrameOfReferenceUID with a new UID in each file,
or in each batch of files. Stacks are joined if everything else is equal and the positions of all
images form one regular stack. Two series that were acquired as two must stay separate: they share a
place, differ in number, description or kind, or each count their images from 1.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np

from stereocell.read.formats.dicom.frame import Frame, Vector
from stereocell.read.formats.dicom.frame_group import Group, axes_of, group_of, key_of
from stereocell.read.plane_stack import SAME_PLACE, NoStackError, lay_out

_SERIES, _REFERENCE = "SeriesInstanceUID", "FrameOfReferenceUID"
_LEAST_REFERENCES = 3  # fewest frames of reference that show a regular stack by themselves
_TOUCH = 1.25  # slices of one volume are at most this many slice distances thick
_EQUAL = {
    _REFERENCE: "series, orientation and spacings",
    _SERIES: "study, description, orientation and spacings",
}


@dataclass(frozen=True, slots=True)
class _Family:
    """Groups that differ only in UIDs, and the group of all their frames.

    places  positions of all frames, rising along the normal, without repeats
    held    for each group the rising indices of the places where it has frames
    """

    groups: tuple[Group, ...]
    joined: Group
    places: tuple[Vector, ...]
    held: tuple[tuple[int, ...], ...]

    @property
    def are_single(self) -> bool:
        """Whether each group has one slice."""
        return all(len(indices) == 1 for indices in self.held)

    @property
    def runs(self) -> list[tuple[int, int]]:
        """The first and the last place of each group, in rising order."""
        return sorted((indices[0], indices[-1]) for indices in self.held)

    def count(self, find: Callable[[Frame], bytes]) -> int:
        """Return the number of different values among the groups."""
        return len({find(group.frames[0]) for group in self.groups})


def join_uids(groups: Sequence[Group]) -> list[Group]:
    """Return the groups. Some are joined, with a note."""
    by_reference = _join(groups, _reference_key, _LEAST_REFERENCES, _are_references_of_one)
    if len({group.frames[0].series for group in by_reference}) < 2:
        return by_reference
    return _join(by_reference, _series_key, 2, _are_series_of_one)


def _join(
    groups: Sequence[Group],
    key: Callable[[Group], object],
    least: int,
    are_one: Callable[[_Family], bool],
) -> list[Group]:
    alike: dict[object, list[list[Group]]] = {}
    for group in groups:
        families = alike.setdefault(key(group), [])
        first = replace(group.frames[0], series=b"", reference=b"")
        family = next((f for f in families if f[0].takes(first)), None)
        if family is None:
            families.append([group])
        else:
            family.append(group)
    found: list[Group] = []
    for family in (family for families in alike.values() for family in families):
        found += family if len(family) < least else _joined(_family_of(family), are_one)
    return found


def _reference_key(group: Group) -> object:
    return key_of(replace(group.frames[0], reference=b""))


def _series_key(group: Group) -> object:
    """Return everything that must be equal in the images of one series."""
    first = group.frames[0]
    if first.segmentation is not None:
        return id(group)
    # The fields that are set to None count images and times, and may change along a volume.
    kinds = frozenset(
        replace(frame.kind, acquisition=None, trigger_time=None, reference_time=None,
                time_slice=None)
        for frame in group.frames
    )  # fmt: skip
    thickness, units = first.stated.thickness_mm, first.scale.units
    plain = replace(first, series=b"", reference=b"")
    return key_of(plain), first.origin, kinds, thickness, units


def _family_of(groups: Sequence[Group]) -> _Family:
    joined = group_of([frame for group in groups for frame in group.frames])
    normal = axes_of(joined)[0]
    near = SAME_PLACE * min(joined.spacing)
    numbered = [(frame, number) for number, group in enumerate(groups) for frame in group.frames]
    places: list[Vector] = []
    held: list[list[int]] = [[] for _ in groups]
    for frame, number in sorted(numbered, key=lambda one: float(normal @ one[0].position)):
        if not places or np.linalg.norm(np.subtract(frame.position, places[-1])) > near:
            places.append(frame.position)
        if held[number][-1:] != [len(places) - 1]:
            held[number].append(len(places) - 1)
    return _Family(tuple(groups), joined, tuple(places), tuple(map(tuple, held)))


def _joined(family: _Family, are_one: Callable[[_Family], bool]) -> list[Group]:
    reason = _irregularity(family)
    if reason or not are_one(family):
        for group in family.groups:
            group.unjoined = group.unjoined or reason
        return list(family.groups)
    joined, first = family.joined, family.joined.frames[0]
    joined.notes = tuple(note for group in family.groups for note in group.notes)
    joined.notes += (_note(family),)
    joined.frames = [
        replace(frame, series=first.series, reference=first.reference) for frame in joined.frames
    ]
    return [joined]


def _note(family: _Family) -> str:
    counts = {
        _SERIES: family.count(lambda frame: frame.series),
        _REFERENCE: family.count(lambda frame: frame.reference),
    }
    names = [name for name, count in counts.items() if count > 1]
    number = max(counts.values())
    found = f"{len(family.places)} slices have {number} {' and '.join(f'{n}s' for n in names)}"
    if family.are_single:
        found = f"each of {number} slices has a {' and a '.join(names)} of its own"
    elif all(after[0] > before[1] for before, after in pairwise(family.runs)):
        found += ", one after the other"
    return (
        f"{found}, as after de-identification: joined, since {_EQUAL[names[0]]} are the same and "
        "the positions are regular"
    )


def _are_references_of_one(family: _Family) -> bool:
    """Return whether no run of slices with one frame of reference reaches into another run."""
    # Time points may share a single place; runs that share several places are separate volumes.
    return not any(
        after[0] <= before[1] and not (before == after and before[0] == before[1])
        for before, after in pairwise(family.runs)
    )


def _are_series_of_one(family: _Family) -> bool:
    """Return whether the series share no place, and their images are counted as one series."""
    is_shared = sum(map(len, family.held)) > len(family.places)
    if is_shared or family.count(lambda frame: frame.series) < len(family.groups):
        return False
    first = family.joined.frames[0]
    numbers = [frame.number for frame in family.joined.frames]
    is_counted = first.origin.is_counted
    is_numbered_once = len(set(numbers)) == len(numbers) and _share_acquisitions(family)
    references = family.count(lambda frame: frame.reference)
    return _have_room(family) and (
        is_counted or (is_numbered_once and (references == 1 or references >= _LEAST_REFERENCES))
    )


def _have_room(family: _Family) -> bool:
    """Return whether the series follow each other, or their slices fill each other's gaps.

    Thicker slices between each other's would be two scans that cover the same body.
    """
    if family.are_single or all(b[0] > a[1] for a, b in pairwise(family.runs)):
        return True
    thickness = family.joined.frames[0].stated.thickness_mm
    normal = axes_of(family.joined)[0]
    gap_mm = float(np.median(np.diff(np.array(family.places) @ normal)))
    return thickness is not None and thickness <= _TOUCH * gap_mm


def _share_acquisitions(family: _Family) -> bool:
    """Return whether acquisition numbers don't separate the series."""
    found = [{frame.kind.acquisition for frame in group.frames} for group in family.groups]
    return family.are_single or all(a & b for a, b in combinations(found, 2))


def _irregularity(family: _Family) -> str:
    """Return why the places don't form a regular stack; empty: they do."""
    joined, first = family.joined, family.joined.frames[0]
    try:
        layout = lay_out(
            family.places,
            joined.along_row,
            along_column=joined.along_column,
            pixel_spacing_mm=joined.spacing,
            plane_shape=(first.rows, first.columns),
        )
    except NoStackError as error:
        return str(error)
    if layout.jump_mm:
        return f"a sideways jump of {layout.jump_mm:.3g} mm between neighbouring positions"
    # If each slice has a UID of its own, further slices may be missing between them.
    if not layout.is_even or (layout.missing and not family.are_single):
        gaps = layout.gaps_mm
        return f"irregular positions (gaps of {gaps.min():.3g} to {gaps.max():.3g} mm)"
    return ""
