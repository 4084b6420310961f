"""Which image of a file of several is read: the one that `--series` names, else the largest."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from stereocell.model.counted import counted
from stereocell.model.errors import SourceError, UsageError
from stereocell.read.image import Image
from stereocell.read.spacing import Triple
from stereocell.storage.location import Location

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


class OpenFile(Protocol):
    """An open file of one image or more."""

    def candidates(self) -> Sequence[Candidate]:
        """Return its images, in the order in which `--series` counts them."""


F = TypeVar("F", bound=OpenFile)


def read_chosen(
    location: Location,
    series: int,
    open_file: Callable[[Location, ExitStack], F],
    read: Callable[[F, int, tuple[str, ...], ExitStack], Image],
) -> Image:
    """Return the chosen image of a file, which closes where that fails.

    open_file  opens the file, to be closed by the stack
    read       returns the image of an index, with these notes; it keeps the stack open
    """
    stack = ExitStack()
    try:
        file = open_file(location, stack)
        index, notes = choose(location.shown, file.candidates(), series)
        return read(file, index, notes, stack)
    except BaseException:
        stack.close()
        raise


def list_images(
    location: Location, open_file: Callable[[Location, ExitStack], OpenFile]
) -> tuple[str, ...]:
    """Return a line for each image of a file, which is opened for it and closed."""
    with ExitStack() as stack:
        return lines(open_file(location, stack).candidates())


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


class SeveralDatasetsError(SourceError):
    """A source has several datasets, and none of them was named.

    places  sources that name one each
    labels  a line for each of them
    likely  the index of the one that is likely an image
    """

    def __init__(
        self, line: str, places: Sequence[str], labels: Sequence[str], likely: int
    ) -> None:
        super().__init__(line)
        self.places, self.labels, self.likely = tuple(places), tuple(labels), likely

    @classmethod
    def of(
        cls, where: str, source: str, labels: Mapping[str, str], *, most: int
    ) -> "SeveralDatasetsError":
        """Return the error for datasets, by the endings that name them, as `:/raw`.

        where   the file, or the part of it that was named
        source  the file
        labels  a line for each dataset; at most `most` of them are shown
        """
        endings = list(labels)
        likely = likely_image(endings)
        listed = ", ".join(list(labels.values())[:most]) + ", ..." * (len(labels) > most)
        line = f"{where}: several datasets: found {listed}, expected one, as {source}{likely}"
        places = [f"{source}{ending}" for ending in endings]
        return cls(line, places, list(labels.values()), endings.index(likely))

    def __reduce__(self) -> tuple[type["SeveralDatasetsError"], tuple[Any, ...]]:
        """Pickle all arguments: a process of its own may raise it."""
        return type(self), (str(self), self.places, self.labels, self.likely)


def likely_image(paths: Sequence[str]) -> str:
    """Return the first path whose name is not that of a label map."""
    images = (path for path in paths if not any(word in path.lower() for word in _LABELS))
    return next(images, paths[0])


def lines(candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """Return a line for each image, as `--series` counts them."""
    return tuple(
        f"{index:3d}  {candidate.label}{'' if candidate.voxels else '; no volume'}"
        for index, candidate in enumerate(candidates, start=1)
    )
