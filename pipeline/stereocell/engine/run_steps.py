"""Run the steps whose results are not kept yet."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

from stereocell.engine.run import Engine
from stereocell.engine.step import Document, Step

R = TypeVar("R")
# runs a function that reads the inputs and writes results at these places
Guard = Callable[[Callable[[], object], Sequence[Path]], None]


@dataclass(frozen=True, slots=True)
class Kept(Generic[R]):
    """A step, and the place of its result.

    name  for progress and errors, as `<tile>/<channel>`
    """

    name: str
    step: Step[R]
    place: Path

    def is_whole(self) -> bool:
        """Return whether the result is there."""
        return self.step.is_kept(self.place)

    def read(self) -> R:
        """Return the result of a step that keeps a document. Raises OutputError."""
        form = self.step.FORM
        assert isinstance(form, Document)
        result: R = form.read(self.place)
        return result


class ReadOnDemand(Mapping[str, R]):
    """Results by name, each read from its file whenever it is asked for.

    The evidence of a tile takes .3 MB unpacked and .1 MB as it lies there. That of thousands of
    tiles would fill the memory.
    """

    def __init__(self, kept: Mapping[str, Kept[R]]) -> None:
        self._kept = kept

    def __getitem__(self, name: str) -> R:
        return self._kept[name].read()

    def __iter__(self) -> Iterator[str]:
        return iter(self._kept)

    def __len__(self) -> int:
        return len(self._kept)


def run_plainly(run: Callable[[], object], results: Sequence[Path]) -> None:
    """Run steps that read no inputs, whose results are at these places."""
    run()


def run_missing(
    engine: Engine, label: str, wanted: Iterable[Kept[Any]], guard: Guard = run_plainly
) -> int:
    """Run the steps whose results are missing or damaged; return their number.

    label  the pass, for progress and errors
    guard  runs the work, so that it can compare the inputs before and after

    Raises TasksFailedError where steps fail; all others are finished then.
    """
    missing = {kept.place: kept for kept in wanted if not kept.is_whole()}
    tasks = [(kept.name, kept) for kept in missing.values()]
    modules = {type(kept.step).__module__: None for kept in missing.values()}
    run = partial(engine.run, label, keep, tasks, needs=tuple(modules))
    guard(run, list(missing))
    return len(tasks)


def keep(kept: Kept[Any]) -> None:
    """Compute one result and write it, on a worker."""
    kept.step.keep(kept.place)
