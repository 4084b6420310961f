"""Run a function over many tasks: inline, or on worker processes by the `distributed` client."""

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from stereocell.errors import StereoCellError
from stereocell.interrupts import children_ignore_interrupts

T = TypeVar("T")
R = TypeVar("R")

console = Console(stderr=True, highlight=False, soft_wrap=True)


class TasksFailedError(StereoCellError):
    """Some tasks failed; all others are finished. A line for each reason."""


class Engine:
    """Worker processes for the length of a build; none with `workers` = 0 (for debugging)."""

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._client: Any = None

    def run(
        self, label: str, function: Callable[[T], R], tasks: Sequence[tuple[str, T]]
    ) -> list[R]:
        """Return a result for each (name, argument), in their order, with a progress bar.

        A task that fails doesn't stop the others. Raises TasksFailedError at the end.
        """
        results: dict[int, R] = {}
        failures: dict[int, str] = {}
        try:
            with _progress(label, len(tasks)) as advance:
                for place, result, error in self._outcomes(function, [task for _, task in tasks]):
                    if error is None:
                        results[place] = result
                    else:
                        failures[place] = _in_words(error)
                    advance(error is not None)
        except KeyboardInterrupt:
            self.close()  # now: workers would go on writing into folders that are being removed
            raise
        if failures:
            named: dict[str, list[str]] = {}  # one line for all that failed alike
            for place in sorted(failures):
                named.setdefault(failures[place], []).append(tasks[place][0])
            lines = [f"{', '.join(names)}: {reason}" for reason, names in named.items()]
            if len(lines) > 1:
                lines.append(f"{label}: {len(failures)} of {len(tasks)} failed")
            raise TasksFailedError("\n".join(lines))
        return [results[place] for place in range(len(tasks))]

    def _outcomes(
        self, function: Callable[[T], R], tasks: Sequence[T]
    ) -> Iterator[tuple[int, Any, BaseException | None]]:
        if self.workers == 0 or len(tasks) < 2:
            for place, task in enumerate(tasks):
                try:
                    result = function(task)
                except Exception as error:  # as on a worker: one unit's failure is not the build's
                    yield place, None, error
                else:
                    yield place, result, None
            return
        from distributed import as_completed

        client = self._start()
        futures = {
            client.submit(function, task, pure=False): place for place, task in enumerate(tasks)
        }
        suspects = []
        for future in as_completed(futures):
            failure = future.exception()
            if _is_killed(failure):
                suspects.append(futures[future])
            else:
                yield futures[future], None if failure else future.result(), failure
            future.release()
        # whoever waited on a worker when another task killed it is blamed too: each once more, by
        # itself, and only the one to blame fails again
        for place in sorted(suspects):
            future = client.submit(function, tasks[place], pure=False)
            failure = future.exception()
            yield place, None if failure else future.result(), failure
            future.release()

    def _start(self) -> Any:
        if self._client is None:
            from distributed import Client
            from distributed.gc import disable_gc_diagnosis

            with children_ignore_interrupts():
                # units hold arrays of known size; distributed's spilling and pausing is in the way
                self._client = Client(
                    n_workers=self.workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=":0",
                    memory_limit=0,
                    silence_logs=logging.CRITICAL,
                )
            # its callback stays for good, and Python drops a Ctrl-C that falls into a callback
            disable_gc_diagnosis()
        return self._client

    def close(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client.cluster.close()
            self._client = None


def _is_killed(error: BaseException | None) -> bool:
    """Return whether a task's worker died under it in each of distributed's four tries."""
    return type(error).__name__ == "KilledWorker"


def _in_words(error: BaseException) -> str:
    words = " ".join(str(error).split())
    if isinstance(error, StereoCellError):
        return words
    if _is_killed(error):
        return (
            "its worker process was killed each time, most likely for want of memory: try fewer "
            "--workers or a smaller --tile-size"
        )
    if isinstance(error, MemoryError):
        return f"out of memory ({words}): try fewer --workers or a smaller --tile-size"
    return f"{type(error).__name__}: {words}"


@contextmanager
def _progress(label: str, total: int) -> Iterator[Callable[[bool], None]]:
    """Yield a function to call once a task is over, with whether it failed."""
    failed = 0
    with Progress(
        TextColumn("{task.description:<9}"),
        BarColumn(bar_width=30),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[failures]}"),
        console=console,
    ) as progress:
        bar = progress.add_task(label, total=total, failures="")

        def advance(failure: bool) -> None:
            nonlocal failed
            failed += failure
            progress.update(bar, advance=1, failures=f"[red]{failed} failed" if failed else "")

        yield advance
