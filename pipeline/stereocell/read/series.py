"""Which image of a file of several is read: the one that `--series` names, else the largest."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import TypeVar

from stereocell.model.errors import UsageError
from stereocell.read.image import Image
from stereocell.read.spacing import Triple

T = TypeVar("T")

_LABELS = ("label", "mask", "seg", "pred")  # in the names of arrays that number objects


@dataclass(frozen=True, slots=True)
class Candidate:
    """One image of a file.

    label   its kind, size and spacing, without a text from the file
    voxels  number of voxels at one time; 0: it is no volume
    """

    label: str
    voxels: int


def candidate(
    shape: tuple[int, int, int],
    *,
    channels: int,
    times: int,
    spacing_um: Triple | None,
    others: Sequence[str] = (),
) -> Candidate:
    """Return an image as a list names it.

    shape       voxels (z, y, x)
    spacing_um  (z, y, x), um; None: not stated
    others      further axes, each with its length: an image that has some is no volume
    """
    z, y, x = shape
    parts = [f"{z} x {y} x {x} voxels", counted(channels, "channel"), *others]
    if times > 1:
        parts.append(f"{times} points in time")
    if spacing_um:
        parts.append(f"spacing {','.join(f'{length:.4g}' for length in spacing_um)} um (z,y,x)")
    return Candidate(", ".join(parts), z * y * x if min(shape) > 1 and not others else 0)


def read_chosen(
    where: str,
    series: int,
    opened: Callable[[ExitStack], tuple[T, Sequence[Candidate]]],
    read: Callable[[T, int, tuple[str, ...], ExitStack], Image],
) -> Image:
    """Return the chosen image of a file, which closes where that fails.

    opened  opens the file, to be closed by the stack, and returns it with its images
    read    returns the image of an index, with these notes; it keeps the stack open
    """
    stack = ExitStack()
    try:
        source, candidates = opened(stack)
        index, notes = choose(where, candidates, series)
        return read(source, index, notes, stack)
    except BaseException:
        stack.close()
        raise


def numbers_of(count: int) -> str:
    """Return the values that `--series` takes for a source of `count` images, for messages."""
    return "1, the only one" if count == 1 else f"1 to {count}"


def choose(where: str, candidates: Sequence[Candidate], series: int) -> tuple[int, tuple[str, ...]]:
    """Return the index of an image, and notes. `series` counts from 1; 0: the largest volume.

    Raises UsageError where there is no such image.
    """
    count = len(candidates)
    if series > count:
        raise UsageError(
            f"{where}: --series: found {series}, expected {numbers_of(count)} "
            "(`--series list` shows them)"
        )
    if series:
        return series - 1, ()
    largest = max(range(count), key=lambda index: (candidates[index].voxels, -index))
    label = candidates[largest].label
    note = f"{count} images; building --series {largest + 1}, the largest: {label}"
    return largest, (note,) if count > 1 else ()


def likely_image(paths: Sequence[str]) -> str:
    """Return the first path whose name is not that of a label map, as an example for messages."""
    images = (path for path in paths if not any(word in path.lower() for word in _LABELS))
    return next(images, paths[0])


def counted(count: int, word: str) -> str:
    """Return a number and its word: `1 channel`, `2 channels`."""
    return f"{count} {word}{'s' * (count != 1)}"


def lines(candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """Return a line for each image, as `--series` counts them."""
    return tuple(
        f"{index:3d}  {candidate.label}{'' if candidate.voxels else '; no volume'}"
        for index, candidate in enumerate(candidates, start=1)
    )
