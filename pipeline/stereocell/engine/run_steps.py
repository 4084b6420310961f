"""Run the steps whose results are not kept yet."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from stereocell.engine.run import Engine
from stereocell.engine.step import Document, Step, Work
from stereocell.storage.workspace import cached

R = TypeVar("R")
S = TypeVar("S", bound="Reads")
# runs a function that reads the inputs and writes results at these places
Guard = Callable[[Callable[[], object], Sequence[Path]], None]


class Reads(Protocol):
    """A task that reads OUT.

    inputs  files and folders of OUT that it reads, which are files of its machine meanwhile
    """

    @property
    def inputs(self) -> Sequence[Path]: ...


@dataclass(frozen=True, slots=True)
class Task:
    """Work, with the place of its files.

    name    for progress and errors, as `<tile>/<channel>`
    inputs  see `Reads`
    """

    name: str
    step: Work
    place: Path
    inputs: tuple[Path, ...] = ()

    def is_whole(self) -> bool:
        """Return whether the result lies at its place, as it was written."""
        return self.step.is_whole(self.place)


@dataclass(frozen=True, slots=True)
class Kept(Task, Generic[R]):
    """A step that keeps its result as a document or as the folder of a unit."""

    step: Step[R]

    def read(self) -> R:
        """Return the result of a step that keeps a document. Raises OutputError."""
        form: Any = self.step.FORM
        assert isinstance(form, Document)
        result: R = form.read(self.place)
        return result


class Results(Mapping[str, R]):
    """Results of a pass by name, each read from its file whenever it is asked for.

    The evidence of a tile takes .3 MB unpacked and .1 MB in its file. Results of thousands of tiles
    would fill the memory.

    out  the folder that `files` counts from
    """

    def __init__(self, kept: Mapping[str, Kept[R]], out: Path) -> None:
        self._kept, self._out = kept, out

    def __getitem__(self, name: str) -> R:
        return self._kept[name].read()

    def __iter__(self) -> Iterator[str]:
        return iter(self._kept)

    def __len__(self) -> int:
        return len(self._kept)

    def files(self) -> dict[str, str]:
        """Return the file of each result, relative to OUT, with forward slashes."""
        return {
            name: one.place.relative_to(self._out).as_posix() for name, one in self._kept.items()
        }


def run_plainly(run: Callable[[], object], results: Sequence[Path]) -> None:
    """Run steps that read no inputs, whose results are at these places."""
    run()


def run_missing(
    engine: Engine, label: str, wanted: Iterable[Task], guard: Guard = run_plainly
) -> int:
    """Run the tasks whose results are missing or damaged; return their number.

    label  the pass, for progress and errors
    guard  runs the work, so that it can compare the inputs before and after

    Raises TasksFailedError where tasks fail; all others are finished then.
    """
    missing = {task.place: task for task in wanted if not task.is_whole()}
    tasks = [(task.name, task) for task in missing.values()]
    modules = {type(task.step).__module__: None for task in missing.values()}
    run = partial(engine.run, label, keep, tasks, needs=tuple(modules))
    guard(run, list(missing))
    return len(tasks)


def keep(task: Task) -> None:
    """Compute one result and write it, on a worker."""
    with cached(*task.inputs):
        task.step.keep(task.place)


def with_inputs(function: Callable[[S], R], task: S) -> R:
    """Return a function's result for a task, on a worker."""
    with cached(*task.inputs):
        return function(task)
