"""Sort files by channel, time and plane, and find missing planes."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stereocell.model.errors import SourceError
from stereocell.read.formats.planes.place import Place, natural
from stereocell.read.image import MAX_CHANNELS

_SHOWN = 4  # file names that a message lists at most
# ratio of the range of numbers to the number of files; above it, the numbers are no sequence
_SPARSE = 20


@dataclass(frozen=True, slots=True)
class Volume:
    """The files of one group, sorted: `files[time, channel, plane]`; stacks only have plane 0."""

    group: str
    times: tuple[int, ...]
    channels: tuple[str, ...]
    planes: tuple[int, ...]
    files: dict[tuple[int, int, int], Place]


def groups_of(places: Sequence[Place]) -> list[list[Place]]:
    """Return the files by the group that their names state, with groups in natural order."""
    groups: dict[str, list[Place]] = {}
    for place in places:
        groups.setdefault(place.group, []).append(place)
    return [groups[name] for name in sorted(groups, key=natural)]


def volume_of(where: str, places: Sequence[Place]) -> Volume:
    """Return a group's files by time, channel and plane. Raises SourceError for gaps and repeats.

    If the numbers of planes continue from channel to channel, each channel is counted from 0 again.
    """
    channels = sorted({place.channel for place in places}, key=natural)
    times = sorted({place.time for place in places})
    if len(channels) > MAX_CHANNELS:
        raise SourceError(
            f"{where}: found {len(channels)} channels in the names, expected at most {MAX_CHANNELS}"
        )
    by_stack: dict[tuple[int, int], dict[int, Place]] = {}
    for place in places:
        stack = by_stack.setdefault((times.index(place.time), channels.index(place.channel)), {})
        other = stack.setdefault(place.plane or 0, place)
        if other is not place:
            raise SourceError(
                f"{where}: found two files for one plane, {other.path!r:.100} and "
                f"{place.path!r:.100}, expected one (--pattern may tell the names apart)"
            )
    numbers = sorted({number for stack in by_stack.values() for number in stack})
    own = [_every(where, sorted(stack)) for stack in by_stack.values()]
    if len(by_stack) > 1 and len({tuple(planes) for planes in own}) > 1:
        is_apart = all(
            planes == sorted(s) for planes, s in zip(own, by_stack.values(), strict=True)
        )
        if is_apart and len({len(planes) for planes in own}) == 1:
            by_stack = {
                key: {n: stack[number] for n, number in enumerate(sorted(stack))}
                for key, stack in by_stack.items()
            }
            numbers = list(range(len(own[0])))
    planes = _every(where, numbers)
    files = {}
    missing = []
    for key in np.ndindex(len(times), len(channels)):
        stack = by_stack.get((key[0], key[1]), {})
        for n, number in enumerate(planes):
            if number in stack:
                files[key[0], key[1], n] = stack[number]
            else:
                missing.append(_missing(places, times[key[0]], channels[key[1]], number))
    if missing:
        shown = ", ".join(missing[:_SHOWN]) + (", ..." if len(missing) > _SHOWN else "")
        raise SourceError(
            f"{where}: found {len(files)} of {len(files) + len(missing)} planes ("
            f"{len(channels)} channels, {len(planes)} planes, {len(times)} times in the names), "
            f"missing {shown}, expected all of them, or --pattern if the names mean something "
            "else"
        )
    return Volume(places[0].group, tuple(times), tuple(channels), tuple(planes), files)


def _every(where: str, numbers: Sequence[int]) -> list[int]:
    """Return the numbers from the first to the last, in their usual step."""
    if len(numbers) < 2:
        return list(numbers)
    step = Counter(b - a for a, b in pairwise(numbers)).most_common(1)[0][0]
    if any((number - numbers[0]) % step for number in numbers):
        step = 1
    if (numbers[-1] - numbers[0]) // step > _SPARSE * len(numbers):
        raise SourceError(
            f"{where}: found {len(numbers)} planes numbered {numbers[0]} to "
            f"{numbers[-1]!s:.20} in the names, expected consecutive numbers, or --pattern if "
            "they mean something else"
        )
    return list(range(numbers[0], numbers[-1] + 1, step))


def _missing(places: Sequence[Place], time: int, channel: str, plane: int) -> str:
    """Return the words for a missing plane: the path that it would have."""
    for place in places:
        if place.time == time and place.channel == channel and place.plane is not None:
            return repr(place.path_of(plane))
    return f"plane {plane} of channel {channel or '0'!r} at time {time}"
