"""Run a function over many tasks: inline, on worker processes of this machine, or on a cluster.

The last two share one path, the `distributed` client. A cluster is a scheduler at an address:
`dask scheduler` and `dask worker` by hand, or started by dask-jobqueue or dask-kubernetes. Its
workers must see OUT and the input under the same paths, and run the same StereoCell.
"""

import logging
import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
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

from stereocell.engine.cluster import ClusterError, able, join
from stereocell.engine.interrupts import children_ignore_interrupts, interrupts_put_off
from stereocell.engine.object_store_tasks import carried, forget_scratch
from stereocell.engine.workers import choose_start
from stereocell.kernels.cache_place import are_compiled, compile_in_process
from stereocell.model.duration import in_words
from stereocell.model.errors import StereoCellError
from stereocell.storage.processes import shortage

T = TypeVar("T")
R = TypeVar("R")

_START_S = 300  # s for workers of this machine to start: it may be busy
_END_S = 30  # s for workers to end
_LOOK_S, _LOOKS = 15, 12  # s between looks for workers, and looks until they count as gone
_POLL_S = 0.05  # s between looks at finished tasks
_PACE_S = 10  # s that tasks have run before their pace is told
_AHEAD = 64  # tasks that wait for a worker
_GONE = "its workers are gone and did not come back: the same command goes on from here"

console = Console(stderr=True, highlight=False, soft_wrap=True)


class TasksFailedError(StereoCellError):
    """Some tasks failed; all others are finished. The text has a line for each reason."""


class Engine:
    """Workers for the duration of a build.

    workers    processes on this machine; 0: none, tasks run inline (for debugging)
    scheduler  address (`tcp://...`) or scheduler file of a running cluster, used instead
    shared     a file that the cluster's workers must see: it lies in OUT
    """

    def __init__(self, workers: int, scheduler: str = "", shared: Path | None = None) -> None:
        self.workers = workers
        self._scheduler = scheduler
        self._shared = shared
        self._client: Any = None

    def run(
        self, label: str, function: Callable[[T], R], tasks: Sequence[tuple[str, T]]
    ) -> list[R]:
        """Return a result for each (name, argument), in their order, with a progress bar.

        A task that fails doesn't stop the others. Raises TasksFailedError at the end where some
        failed, ClusterError where the workers can't be started or joined.
        """
        if not tasks:
            return []
        results: dict[int, R] = {}
        failures: dict[int, str] = {}
        try:
            with _progress(label, len(tasks)) as advance:
                for place, result, error in self._outcomes(function, [task for _, task in tasks]):
                    if error is None:
                        results[place] = result
                    else:
                        failures[place] = _in_words(error)
                    advance(tasks[place][0], error is not None)
        except KeyboardInterrupt:
            self.close()  # at once: workers would write into folders that are being removed
            raise
        if failures:
            named: dict[str, list[str]] = {}  # one line for all tasks that failed alike
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
        if not self._scheduler and (self.workers == 0 or len(tasks) < 2):
            for place, task in enumerate(tasks):
                try:
                    result = function(task)
                except Exception as error:  # as on a worker: a unit's failure doesn't end the build
                    yield place, None, error
                else:
                    yield place, result, None
            return
        client = self._start(function)
        work, settle = carried(function)
        if self._scheduler:
            work = able(work, self._shared)
        left, futures = iter(range(len(tasks))), {}

        def submit() -> Any:
            for place in left:
                future = client.submit(work, tasks[place], pure=False)
                futures[future] = place
                return future
            return None

        suspects = []
        for future in _as_they_end(client, submit):
            place = futures.pop(future)
            result, failure = _outcome_of(client, future)
            if _is_killed(failure):
                suspects.append(place)
            else:
                yield place, None if failure else settle(result), failure
            future.release()
        for place in (*futures.values(), *left):
            yield place, None, ClusterError(_GONE)
        # a killed worker fails all tasks that waited on it: each runs once more, alone, and only
        # the task that kills its worker fails again
        for place in sorted(suspects):
            future = client.submit(work, tasks[place], pure=False)
            result, failure = _outcome_of(client, future)
            yield place, None if failure else settle(result), failure
            future.release()

    def _start(self, function: Callable[[T], R]) -> Any:
        if self._client is None and self._scheduler:
            self._client = join(self._scheduler, self._shared)
        elif self._client is None:
            import dask
            from distributed import Client
            from distributed.gc import disable_gc_diagnosis

            # distributed drops a killed worker for good where a busy machine needs over 15 s for it
            dask.config.set({"distributed.deploy.lost-worker-timeout": f"{_START_S}s"})
            if not are_compiled():  # each worker would do it, for half a minute
                console.print("compiling loops, once on this machine", markup=False)
                compile_in_process()
            with children_ignore_interrupts(), _started_in_time():
                choose_start(function)
                # units hold arrays of known size; distributed needs no spilling
                self._client = Client(
                    n_workers=self.workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=":0",
                    memory_limit=0,
                    silence_logs=logging.CRITICAL,
                    timeout=_START_S,
                )
            # its callback stays installed, and Python loses a Ctrl-C that arrives in a callback
            disable_gc_diagnosis()
        return self._client

    def close(self) -> None:
        """Stop the workers of this machine, or leave the cluster, which runs on.

        A Ctrl-C or SIGTERM meanwhile is raised afterwards. A client that is only half closed would
        close itself as Python ends, and wait for ten minutes for a thread that has ended.
        """
        client, self._client = self._client, None
        if client is None:
            return
        cluster = client.cluster  # None for a cluster that was running before: it stays
        try:
            if cluster is None:
                forget_scratch(client)
        finally:
            with interrupts_put_off():
                for one in (client, cluster):
                    if one is not None:
                        # distributed asserts that a worker has started, also of one that takes the
                        # place of a killed one at this very moment
                        with suppress(TimeoutError, AssertionError):
                            one.close(timeout=_END_S)
                client.status = "closed"


@contextmanager
def _started_in_time() -> Iterator[None]:
    """Raise ClusterError in place of distributed's TimeoutError, which has no text."""
    try:
        yield
    except TimeoutError:
        raise ClusterError(
            f"--workers: the processes did not answer within {_START_S} s: wait until this machine "
            "is less busy, or try fewer --workers; 0 needs none"
        ) from None


def _as_they_end(client: Any, submit: Callable[[], Any]) -> Iterator[Any]:
    """Yield the futures that `submit` returns, in the order of completion, until it returns None.

    Few more tasks than workers wait at a time: each takes memory of the scheduler. The iterator
    ends early once the workers have been absent for long.
    """
    from distributed import as_completed

    ended = as_completed()
    looked, missed, waiting, most = -math.inf, 0, 0, 0
    while missed < _LOOKS:
        if time.monotonic() - looked > _LOOK_S:
            threads = 0
            with suppress(Exception):  # the scheduler is gone: its futures report it
                threads = sum(client.nthreads().values())
            looked, missed = time.monotonic(), 0 if threads else missed + 1
            most = max(_AHEAD, 2 * threads)
        while waiting < most and (future := submit()) is not None:
            ended.add(future)
            waiting += 1
        if waiting == 0:
            return
        if ended.has_ready():
            waiting -= 1
            yield next(ended)
        else:
            time.sleep(_POLL_S)


def _outcome_of(client: Any, future: Any) -> tuple[Any, BaseException | None]:
    """Wait for a task; return its result and None, or None and the error.

    A lost scheduler is such an error, and so are workers that stay away.
    """
    from distributed import CancelledError

    missed = 0
    while missed < _LOOKS:
        try:
            failure: BaseException | None = future.exception(timeout=_LOOK_S)
            # may wait again: a result that was lost with its worker is computed anew
            return (None, failure) if failure else (future.result(timeout=_LOOK_S), None)
        except CancelledError:
            gone = "the cluster's scheduler is gone: the same command goes on from here"
            return None, ClusterError(gone)
        except TimeoutError:
            missed = 0 if client.scheduler_info()["workers"] else missed + 1
    return None, ClusterError(_GONE)


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
    return shortage(error) or f"{type(error).__name__}: {words}"


@contextmanager
def _progress(label: str, total: int) -> Iterator[Callable[[str, bool], None]]:
    """Yield a function to call at the end of each task, with its name and whether it failed.

    On a terminal it draws a bar; elsewhere, as in a log, it prints a line for each task. Both say
    how long the others will take, at the pace so far.
    """
    if not console.is_terminal:
        done, start = 0, time.monotonic()

        def print_done(name: str, failure: bool) -> None:
            nonlocal done
            done += 1
            end = ": failed" if failure else ""
            spent = time.monotonic() - start
            if done < total and spent > _PACE_S:
                end += f"; {in_words(spent / done * (total - done))} left"
            console.print(f"{label}: {done}/{total} {name}{end}", markup=False)

        yield print_done
        return
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

        def advance(_: str, failure: bool) -> None:
            nonlocal failed
            failed += failure
            progress.update(bar, advance=1, failures=f"[red]{failed} failed" if failed else "")

        yield advance
