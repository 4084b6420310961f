"""Name series of one size by the properties in which they differ, such as kernels or echo times.

Kinds of frames within a series are named when they are separated (split_kinds.py). Separate series
are named here, because equal lines in a list would not show which series is which.
"""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from stereocell.read.anatomical_axes import plane_name
from stereocell.read.formats.dicom.frame_kind import LOCALIZER
from stereocell.read.formats.dicom.split_kinds import NAMED, Property, by_value, value_names
from stereocell.read.formats.dicom.stack import Stack
from stereocell.read.plane_stack import normal_of

_MOST_NAMED = 3  # properties that are added to a name


def name_apart(stacks: Sequence[Stack]) -> list[Stack]:
    """Return the stacks; several series of the same size are named by their differences.

    `Stack.among`, by which series of equal size are sorted, gets the index of each such value.
    """
    families: dict[tuple[Any, ...], list[int]] = defaultdict(list)
    for index, stack in enumerate(stacks):
        if stack.first.segmentation is None and stack.first.kind.role != LOCALIZER:
            families[_family(stack)].append(index)
    found = list(stacks)
    for indices in families.values():
        members = [stacks[index] for index in indices]
        if len({stack.first.series for stack in members}) > 1:
            for index, named in zip(indices, _named(members), strict=True):
                found[index] = named
    return found


def _family(stack: Stack) -> tuple[Any, ...]:
    first = stack.first
    plane = plane_name(normal_of(first.along_row, first.along_column))
    size = (len(stack.times), len(stack.times[0]), first.rows, first.columns)
    return first.modality, first.kind.words, plane, size


def _named(members: Sequence[Stack]) -> list[Stack]:
    found = list(members)
    named = 0
    for one in NAMED:
        places = _places(members, one)
        if places is None or named == _MOST_NAMED:
            continue
        named += 1
        of_place = {place: one.find(s.first) for place, s in zip(places, found, strict=True)}
        names = value_names(one, [of_place[place] for place in sorted(of_place)])
        for index, place in enumerate(places):
            stack, word = found[index], names[place]
            words = stack.words if word in ("", *stack.words) else (*stack.words, word)
            found[index] = replace(stack, words=words, among=(*stack.among, place))
    return found


def _places(members: Sequence[Stack], one: Property) -> list[int] | None:
    """Return the index of each stack's value; None: all are equal, or a stack has several."""
    if any(_has_several(stack, one.find) for stack in members):
        return None
    values = by_value([stack.first for stack in members], one)
    if len(values) < 2:
        return None
    place_of = {id(frame): place for place, frames in enumerate(values) for frame in frames}
    return [place_of[id(stack.first)] for stack in members]


def _has_several(stack: Stack, find: Callable[[Any], Any]) -> bool:
    return len({find(frame) for point in stack.times for frame in point}) > 1
