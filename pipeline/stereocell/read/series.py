"""Which image of a file of several is read: the one that `--series` names, else the largest."""

from collections.abc import Sequence
from dataclasses import dataclass

from stereocell.model.errors import UsageError

_LABELS = ("label", "mask", "seg", "pred")  # in the names of arrays that number objects


@dataclass(frozen=True, slots=True)
class Candidate:
    """One image of a file.

    label   its kind, size and spacing, without a text from the file
    voxels  number of voxels at one time; 0: it is no volume
    """

    label: str
    voxels: int


def choose(where: str, candidates: Sequence[Candidate], series: int) -> tuple[int, tuple[str, ...]]:
    """Return the index of an image, and notes. `series` counts from 1; 0: the largest volume.

    Raises UsageError where there is no such image.
    """
    count = len(candidates)
    if series > count:
        raise UsageError(
            f"{where}: --series: found {series}, expected 1 to {count} (`--series list` shows them)"
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
