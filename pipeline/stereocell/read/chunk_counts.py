"""Find the chunks that a part of an array touches, and count those that are not stored."""

import math
from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass
from itertools import product
from typing import Any

MOST_COUNTED = 2_000_000  # chunks to look for; a part that touches more is not counted
Spans = Sequence[Sequence[range]]  # ranges of indices to read, for each axis


@dataclass(frozen=True, slots=True)
class Absent:
    """The number of chunks that a part of a level touches and that are not stored.

    count  absent chunks
    total  all chunks that the part touches
    noun   `chunk`, `shard` or `block`
    fill   value that is read for absent chunks
    """

    count: int
    total: int
    noun: str
    fill: Any


def touched_along(size: int, ranges: Sequence[range]) -> list[int]:
    """Return the indices of the chunks, `size` voxels along the axis, that the ranges touch."""
    return sorted({n for one in ranges for n in range(one.start // size, -(-one.stop // size))})


def number_of(sizes: Sequence[int], spans: Spans) -> int:
    """Return how many chunks a part touches. `sizes` holds a chunk's length along each axis."""
    return math.prod(_count(n, ranges) for n, ranges in zip(sizes, spans, strict=True))


def _count(size: int, ranges: Sequence[range]) -> int:
    """Return the number of chunks along one axis, without listing them: there may be many."""
    count, reached = 0, 0
    for one in sorted(ranges, key=lambda one: one.start):
        first, stop = max(one.start // size, reached), -(-one.stop // size)
        if stop > first:
            count, reached = count + stop - first, stop
    return count


def places_of(sizes: Sequence[int], spans: Spans) -> Iterator[tuple[int, ...]]:
    """Return the indices of the chunks that a part touches."""
    return product(*(touched_along(n, ranges) for n, ranges in zip(sizes, spans, strict=True)))


def count_keys(keys: Iterator[str], names: Set[str], noun: str, fill: Any) -> Absent:
    """Count the keys of chunks that are not among the names of a source's files."""
    total = count = 0
    for key in keys:
        total += 1
        count += key not in names
    return Absent(count, total, noun, fill)
