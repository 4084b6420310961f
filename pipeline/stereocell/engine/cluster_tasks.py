"""Run tasks on the workers of a Dask cluster."""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import Any, TypeVar

from stereocell.engine.cluster import ClusterError
from stereocell.engine.worker_pool import KILLED, Outcome
from stereocell.model.errors import StereoCellError

T = TypeVar("T")

_LOOK_S = 15  # s between looks for workers
_LOOKS = 12  # looks without a worker until the workers count as gone
_POLL_S = 0.05  # s between looks at finished tasks
_AHEAD = 64  # least number of tasks that wait for a worker
_GONE = "its workers are gone and did not come back: the same command goes on from here"


def run_on_cluster(
    client: Any, function: Callable[[T], Any], tasks: Sequence[T]
) -> Iterator[Outcome]:
    """Yield the outcome of each task, in the order of completion.

    A killed worker fails all tasks that waited on it. Each of them runs once more, alone, so that
    only the task that kills its worker fails again.
    """
    waiting, futures = iter(range(len(tasks))), {}

    def submit() -> Any:
        for task in waiting:
            future = client.submit(function, tasks[task], pure=False)
            futures[future] = task
            return future
        return None

    suspects = []
    for future in _completed(client, submit):
        task = futures.pop(future)
        result, error = _outcome_of(client, future)
        if _is_killed(error):
            suspects.append(task)
        else:
            yield task, result, error
        future.release()
    for task in (*futures.values(), *waiting):
        yield task, None, ClusterError(_GONE)
    for task in sorted(suspects):
        future = client.submit(function, tasks[task], pure=False)
        result, error = _outcome_of(client, future)
        yield task, result, StereoCellError(KILLED) if _is_killed(error) else error
        future.release()


def _is_killed(error: BaseException | None) -> bool:
    """Return whether a task's worker died under it in each of Dask's four tries."""
    return type(error).__name__ == "KilledWorker"


def _completed(client: Any, submit: Callable[[], Any]) -> Iterator[Any]:
    """Yield the futures that `submit` returns, in the order of completion, until it returns None.

    At most `_AHEAD` tasks, or twice as many as workers if that is more, wait at a time: each takes
    memory of the scheduler. The iterator ends early once the workers have been absent for long.
    """
    from distributed import as_completed

    ended = as_completed(loop=client.loop)
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
    """Wait for a task. Return its result and None, or None and its error.

    A lost scheduler is such an error, and so are workers that stay away.
    """
    from distributed import CancelledError

    missed = 0
    while missed < _LOOKS:
        try:
            failure: BaseException | None = future.exception(timeout=_LOOK_S)
            # This may wait again: a result that was lost with its worker is computed again.
            return (None, failure) if failure else (future.result(timeout=_LOOK_S), None)
        except CancelledError:
            gone = "the cluster's scheduler is gone: the same command goes on from here"
            return None, ClusterError(gone)
        except TimeoutError:
            missed = 0 if client.scheduler_info()["workers"] else missed + 1
    return None, ClusterError(_GONE)
