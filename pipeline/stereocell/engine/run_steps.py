"""Run the steps whose results are missing in OUT."""

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
# Runs a function that reads the inputs and writes results to the places in the second argument.
Guard = Callable[[Callable[[], object], Sequence[Path]], None]


class Reads(Protocol):
    """A task that reads OUT.

    inputs  files and folders of OUT that it reads; they are local files while it runs
    """

    @property
    def inputs(self) -> Sequence[Path]: ...


@dataclass(frozen=True, slots=True)
class Task:
    """Work, and the place of its result.

    name    name for progress and errors, such as `<tile>/<channel>`
    inputs  see `Reads`
    """

    name: str
    step: Work
    place: Path
    inputs: tuple[Path, ...] = ()

    def is_whole(self) -> bool:
        """Return whether the result lies at its place, undamaged."""
        return self.step.is_whole(self.place)


@dataclass(frozen=True, slots=True)
class Kept(Task, Generic[R]):
    """A step whose result is kept as a document or as the folder of a unit."""

    step: Step[R]

    def read(self) -> R:
        """Return the result of a step whose result is a document. Raises OutputError."""
        form: Any = self.step.FORM
        assert isinstance(form, Document)
        result: R = form.read(self.place)
        return result


class Results(Mapping[str, R]):
    """Results of a pass by name. Each access reads the result from its file.

    Results of thousands of tiles would fill the memory: the evidence of one tile takes .1 MB in its
    file and .3 MB unpacked.

    out  folder to which `files` is relative
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
    """Run steps that read no inputs, so that nothing is compared before or after."""
    run()


def run_missing(
    engine: Engine, label: str, wanted: Iterable[Task], guard: Guard = run_plainly
) -> int:
    """Run the tasks whose results are missing or damaged, and return their number.

    label  name of the pass, for progress and errors
    guard  runs the work, and may compare the inputs before and after

    Raises TasksFailedError if tasks fail, after all others have finished.
    """
    missing = {task.place: task for task in wanted if not task.is_whole()}
    tasks = [(task.name, task) for task in missing.values()]
    modules = {type(task.step).__module__: None for task in missing.values()}
    run = partial(engine.run, label, keep, tasks, needs=tuple(modules))
    guard(run, list(missing))
    return len(tasks)


def keep(task: Task) -> None:
    """Compute one result and write it. Runs on a worker."""
    with cached(*task.inputs):
        task.step.keep(task.place)


def with_inputs(function: Callable[[S], R], task: S) -> R:
    """Return a function's result for a task. Runs on a worker."""
    with cached(*task.inputs):
        return function(task)
