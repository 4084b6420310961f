"""Run a function over many tasks: inline, on worker processes of this machine, or on a cluster.

Processes of this machine receive their tasks over pipes (`worker_pool`). A cluster is a Dask
scheduler with an address. It is started by hand (`dask scheduler`, `dask worker`), by dask-jobqueue
or by dask-kubernetes. Its workers must see OUT and the input under the same paths, and have the
same version of StereoCell.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
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

from stereocell.engine.cluster import able, is_open_to_all, join
from stereocell.engine.cluster_tasks import run_on_cluster
from stereocell.engine.interrupts import interrupts_put_off
from stereocell.engine.object_store_tasks import carried, forget_scratch
from stereocell.engine.worker_pool import Outcome, WorkerPool
from stereocell.kernels.cache_place import are_compiled, compile_in_process
from stereocell.model.duration import in_words
from stereocell.model.errors import StereoCellError
from stereocell.storage.processes import release_freed_memory, shortage

T = TypeVar("T")
R = TypeVar("R")
# Called with the label of the running tasks, the number of finished tasks and of all tasks, and the
# name of the task that has just ended. The name is empty before the first one ends.
Watch = Callable[[str, int, int, str], None]

_END_S = 30  # s for a cluster's client to close
_PACE_S = 10  # s that tasks run before the remaining time is printed

_OPEN_CLUSTER = (
    "cluster: found no certificates (TLS), so everybody who reaches its ports can run code as the "
    "user of its workers: see docs/cluster.md"
)

console = Console(stderr=True, highlight=False, soft_wrap=True)


class TasksFailedError(StereoCellError):
    """Some tasks failed, and all others have finished. The text has a line for each reason."""


class Engine:
    """Workers for the duration of a build.

    workers    processes on this machine; 0: tasks run inline (for debugging)
    scheduler  address (`tcp://...`) or scheduler file of a running cluster to use instead
    shared     a file in OUT that the cluster's workers must see
    watch      called when tasks begin, and when a task has ended; None: no progress is reported
    """

    def __init__(
        self,
        workers: int,
        scheduler: str = "",
        shared: Path | None = None,
        watch: Watch | None = None,
    ) -> None:
        self.workers = workers
        self.watch: Watch = watch or (lambda *_: None)
        self._scheduler = scheduler
        self._shared = shared
        self._client: Any = None  # client of the cluster; None: no cluster has been joined
        self._pool: WorkerPool | None = None

    def join(self) -> None:
        """Join the cluster, if there is one. `run` does so, too. Raises ClusterError."""
        if self._scheduler and self._client is None:
            self._client = join(self._scheduler, self._shared)
            if is_open_to_all(self._client):
                console.print(_OPEN_CLUSTER, markup=False)

    def run(
        self,
        label: str,
        function: Callable[[T], R],
        tasks: Sequence[tuple[str, T]],
        *,
        needs: Sequence[str] = (),
    ) -> list[R]:
        """Return the results of all tasks in their order, and show a progress bar.

        tasks  name and argument of each
        needs  names of modules that all workers need, besides the function's own

        A task that fails doesn't stop the others. Raises TasksFailedError at the end if some
        failed, ClusterError if the cluster can't be joined, WorkersError if workers can't start.
        """
        if not tasks:
            return []
        results: dict[int, R] = {}
        failures: dict[int, str] = {}
        try:
            self.watch(label, 0, len(tasks), "")
            with _progress(label, len(tasks)) as advance:
                for place, result, error in self._outcomes(
                    function, [task for _, task in tasks], needs
                ):
                    if error is None:
                        results[place] = result
                    else:
                        failures[place] = _in_words(error)
                    advance(tasks[place][0], error is not None)
                    self.watch(label, len(results) + len(failures), len(tasks), tasks[place][0])
        except KeyboardInterrupt:
            # Workers end at once. Otherwise they would write into folders that are being removed.
            self.close()
            raise
        if failures:
            named: dict[str, list[str]] = {}  # tasks that failed for the same reason share a line
            for place in sorted(failures):
                named.setdefault(failures[place], []).append(tasks[place][0])
            lines = [f"{', '.join(names)}: {reason}" for reason, names in named.items()]
            if len(lines) > 1:
                lines.append(f"{label}: {len(failures)} of {len(tasks)} failed")
            raise TasksFailedError("\n".join(lines))
        return [results[place] for place in range(len(tasks))]

    def _outcomes(
        self, function: Callable[[T], R], tasks: Sequence[T], needs: Sequence[str]
    ) -> Iterator[Outcome]:
        if not self._scheduler and (self.workers == 0 or len(tasks) < 2):
            for place, task in enumerate(tasks):
                try:
                    result = function(task)
                except Exception as error:  # a failed task doesn't stop the others, as on workers
                    yield place, None, error
                else:
                    yield place, result, None
            release_freed_memory()
            return
        work, settle = carried(function)
        for place, answer, failure in self._outcomes_of_workers(function, work, tasks, needs):
            yield place, None if failure else settle(answer), failure

    def _outcomes_of_workers(
        self,
        function: Callable[[T], R],
        work: Callable[[T], Any],
        tasks: Sequence[T],
        needs: Sequence[str],
    ) -> Iterator[Outcome]:
        """Run the tasks on the cluster, or on processes of this machine.

        function  the function of a task
        work      the same function, wrapped for a worker
        """
        if self._scheduler:
            self.join()
            return run_on_cluster(self._client, able(work, self._shared), tasks)
        if self._pool is None:
            if not are_compiled():  # otherwise each worker would spend a minute on it
                console.print("compiling loops, once on this machine", markup=False)
                compile_in_process()
            plain = function.func if isinstance(function, partial) else function
            self._pool = WorkerPool(self.workers, plain.__module__, *needs)
        return self._pool.run(work, tasks)

    def close(self) -> None:
        """End the workers of this machine, or leave the cluster, which runs on.

        A Ctrl-C or SIGTERM in the meantime is raised afterwards. Otherwise a client that is only
        half closed would close itself when Python ends, and wait ten minutes for a dead thread.
        """
        pool, self._pool = self._pool, None
        client, self._client = self._client, None
        if pool is not None:
            pool.close()
        if client is None:
            return
        try:
            forget_scratch(client)
        finally:
            with interrupts_put_off():
                with suppress(TimeoutError):
                    client.close(timeout=_END_S)
                client.status = "closed"


def _in_words(error: BaseException) -> str:
    words = " ".join(str(error).split())
    if isinstance(error, StereoCellError):
        return words
    return shortage(error) or f"{type(error).__name__}: {words}"


@contextmanager
def _progress(label: str, total: int) -> Iterator[Callable[[str, bool], None]]:
    """Yield a function to call at the end of each task, with its name and whether it failed.

    On a terminal it draws a bar; elsewhere, such as in a log, it prints a line for each task. Both
    show how long the remaining tasks will take at the pace so far.
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
