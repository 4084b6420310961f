"""Choose the image to read from a file that holds several: `--series`, else the largest one."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from stereocell.model.counted import counted
from stereocell.model.errors import SourceError, UsageError
from stereocell.read.image import Image
from stereocell.read.spacing import Triple
from stereocell.storage.location import Location

# parts of the names of arrays that are likely label maps
_LABELS = ("label", "mask", "seg", "pred")


@dataclass(frozen=True, slots=True)
class Candidate:
    """One image of a file, as a list of series shows it.

    label   kind, size and spacing, without any text from the file
    voxels  number of voxels at one time point; 0: the image is not a volume
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
    """Return an image's entry in the list of series.

    shape       voxels (z, y, x)
    spacing_um  (z, y, x), um; None: not stated
    others      further axes, each with its length; an image with further axes is not a volume
    """
    z, y, x = shape
    parts = [f"{z} x {y} x {x} voxels", counted(channels, "channel"), *others]
    if times > 1:
        parts.append(f"{times} time points")
    if spacing_um:
        parts.append(f"spacing {','.join(f'{length:.4g}' for length in spacing_um)} um (z,y,x)")
    return Candidate(", ".join(parts), z * y * x if min(shape) > 1 and not others else 0)


class OpenFile(Protocol):
    """An open file that holds one or more images."""

    def candidates(self) -> Sequence[Candidate]:
        """Return the file's images, in the order in which `--series` counts them."""


F = TypeVar("F", bound=OpenFile)


def read_chosen(
    location: Location,
    series: int,
    open_file: Callable[[Location, ExitStack], F],
    read: Callable[[F, int, tuple[str, ...], ExitStack], Image],
) -> Image:
    """Return the chosen image of a file. The file is closed if reading fails.

    open_file  opens the file and registers closing it on the stack
    read       returns the image at an index, with the notes given; it keeps the stack open
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
    """Return a line for each image of a file, which is opened and closed again."""
    with ExitStack() as stack:
        return lines(open_file(location, stack).candidates())


def numbers_of(count: int) -> str:
    """Return the values that `--series` accepts for a source of `count` images, for messages."""
    return "1, the only one" if count == 1 else f"1 to {count}"


def choose(where: str, candidates: Sequence[Candidate], series: int) -> tuple[int, tuple[str, ...]]:
    """Return the index of the image to read, and notes.

    `series` counts from 1; 0 chooses the largest volume. Raises UsageError where there is no such
    image.
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
    """A source has several datasets, and the user named none of them.

    places  how to name each dataset as a source
    labels  a line on each dataset
    likely  index of the dataset that is most likely an image
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
        """Return the error from labels by the ending that names a dataset, such as `:/raw`.

        where   the file, or the part of it that the user named
        source  the file
        labels  a line on each dataset; the message shows at most `most` of them
        """
        endings = list(labels)
        likely = likely_image(endings)
        listed = ", ".join(list(labels.values())[:most]) + ", ..." * (len(labels) > most)
        line = f"{where}: several datasets: found {listed}, expected one, such as {source}{likely}"
        places = [f"{source}{ending}" for ending in endings]
        return cls(line, places, list(labels.values()), endings.index(likely))

    def __reduce__(self) -> tuple[type["SeveralDatasetsError"], tuple[Any, ...]]:
        """Pickle all arguments, because a worker process may raise this error."""
        return type(self), (str(self), self.places, self.labels, self.likely)


def likely_image(paths: Sequence[str]) -> str:
    """Return the first path that isn't named like a label map, or else the first path."""
    images = (path for path in paths if not any(word in path.lower() for word in _LABELS))
    return next(images, paths[0])


def lines(candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """Return a line for each image, numbered as for `--series`."""
    return tuple(
        f"{index:3d}  {candidate.label}{'' if candidate.voxels else '; no volume'}"
        for index, candidate in enumerate(candidates, start=1)
    )
