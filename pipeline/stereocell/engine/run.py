"""Run a function over many tasks: inline, on worker processes of this machine, or on a cluster.

Processes of this machine take their tasks over pipes (`worker_pool`). A cluster is a Dask scheduler
at an address: `dask scheduler` and `dask worker` by hand, or started by dask-jobqueue or
dask-kubernetes. Its workers must see OUT and the input under the same paths, and run the same
StereoCell.
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
from stereocell.storage.processes import shortage

T = TypeVar("T")
R = TypeVar("R")
# is given the label of running tasks, how many are done and how many there are, and the name of the
# task that has just ended; empty: none has ended yet
Watch = Callable[[str, int, int, str], None]

_END_S = 30  # s for a cluster's client to close
_PACE_S = 10  # s that tasks have run before their pace is told

_OPEN_CLUSTER = (
    "cluster: it has no certificates (TLS), so everybody who reaches its ports can run code as the "
    "user of its workers: see docs/cluster.md"
)

console = Console(stderr=True, highlight=False, soft_wrap=True)


class TasksFailedError(StereoCellError):
    """Some tasks failed; all others are finished. The text has a line for each reason."""


class Engine:
    """Workers for the duration of a build.

    workers    processes on this machine; 0: none, tasks run inline (for debugging)
    scheduler  address (`tcp://...`) or scheduler file of a running cluster, used instead
    shared     a file that the cluster's workers must see: it lies in OUT
    watch      is called as tasks begin and whenever one has ended; None: nobody watches
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
        self._client: Any = None  # of the cluster
        self._pool: WorkerPool | None = None

    def join(self) -> None:
        """Join the cluster, where there is one; `run` does so, too. Raises ClusterError."""
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
        """Return a result for each (name, argument), in their order, with a progress bar.

        needs  names of modules that all workers need, besides the function's own

        A task that fails doesn't stop the others. Raises TasksFailedError at the end where some
        failed, ClusterError where the workers can't be started or joined.
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
        self, function: Callable[[T], R], tasks: Sequence[T], needs: Sequence[str]
    ) -> Iterator[Outcome]:
        if not self._scheduler and (self.workers == 0 or len(tasks) < 2):
            for place, task in enumerate(tasks):
                try:
                    result = function(task)
                except Exception as error:  # a failed unit doesn't end the build, as on a worker
                    yield place, None, error
                else:
                    yield place, result, None
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

        function  the task by itself
        work      the same, wrapped for a worker
        """
        if self._scheduler:
            self.join()
            return run_on_cluster(self._client, able(work, self._shared), tasks)
        if self._pool is None:
            if not are_compiled():  # each worker would do it, for half a minute
                console.print("compiling loops, once on this machine", markup=False)
                compile_in_process()
            plain = function.func if isinstance(function, partial) else function
            self._pool = WorkerPool(self.workers, plain.__module__, *needs)
        return self._pool.run(work, tasks)

    def close(self) -> None:
        """End the workers of this machine, or leave the cluster, which runs on.

        A Ctrl-C or SIGTERM meanwhile is raised afterwards. A client that is only half closed would
        close itself as Python ends, and wait for ten minutes for a thread that has ended.
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
