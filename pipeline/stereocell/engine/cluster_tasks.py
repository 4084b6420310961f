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

_LOOK_S = 15  # s between checks for workers
_LOOKS = 12  # checks without a worker after which the workers count as gone
_POLL_S = 0.05  # s between checks for finished tasks
_AHEAD = 64  # least number of tasks that are submitted ahead
_GONE = "its workers are gone and did not come back: run the same command to go on from here"


def run_on_cluster(
    client: Any, function: Callable[[T], Any], tasks: Sequence[T]
) -> Iterator[Outcome]:
    """Yield the outcome of each task, in the order of completion.

    If a worker is killed, all tasks that waited on it fail. Each of them runs again, alone, so that
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
    """Return whether the task's worker died in each of Dask's four tries."""
    return type(error).__name__ == "KilledWorker"


def _completed(client: Any, submit: Callable[[], Any]) -> Iterator[Any]:
    """Yield the futures that `submit` returns, in the order of completion, until it returns None.

    At most `_AHEAD` tasks wait at a time, or twice as many as threads if that is more, because each
    takes memory of the scheduler. The iterator ends early if the workers are absent for long.
    """
    from distributed import as_completed

    ended = as_completed(loop=client.loop)
    checked, missed, waiting, most = -math.inf, 0, 0, 0
    while missed < _LOOKS:
        if time.monotonic() - checked > _LOOK_S:
            threads = 0
            with suppress(Exception):  # if the scheduler is gone, the futures report it
                threads = sum(client.nthreads().values())
            checked, missed = time.monotonic(), 0 if threads else missed + 1
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

    It is an error, too, if the scheduler is lost or no workers come back.
    """
    from distributed import CancelledError

    missed = 0
    while missed < _LOOKS:
        try:
            failure: BaseException | None = future.exception(timeout=_LOOK_S)
            # This may wait again: a result that was lost with its worker is computed again.
            return (None, failure) if failure else (future.result(timeout=_LOOK_S), None)
        except CancelledError:
            gone = "the cluster's scheduler is gone: run the same command to go on from here"
            return None, ClusterError(gone)
        except TimeoutError:
            missed = 0 if client.scheduler_info()["workers"] else missed + 1
    return None, ClusterError(_GONE)
