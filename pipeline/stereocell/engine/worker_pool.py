"""Run tasks on worker processes of this machine, over pipes.

A pipe has two ends and no address. No port is opened, so nobody else on the machine or in the
network can reach a worker or the command. Dask's local cluster listens on ports: without
certificates, every program that connects to one can run code as the user who builds. A pool over
pipes needs no certificates, starts sooner, and knows which task killed its worker.

On Linux, workers are forked from a server process that has imported all modules they need. A
process started without it imports them for 1.7 s of CPU. The server imports once for all workers of
a command, and they share its memory until they write. It has no threads, so that it can fork.
"""

import multiprocessing
import os
import pickle
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import connection
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from stereocell.engine.interrupts import children_ignore_interrupts, interrupts_put_off
from stereocell.engine.worker_process import READY, REST, serve
from stereocell.model.errors import StereoCellError

T = TypeVar("T")

_START_S = 300  # s for workers to start, on a machine that may be busy
_END_S = 30  # s for workers to end
_MOST_PIPES = 60  # Windows waits for at most 63 handles at a time

KILLED = (
    "its worker process was killed each time, most likely for lack of memory: try fewer --workers "
    "or a smaller --tile-size"
)

_server_environment: dict[str, str] = {}  # empty: no server has been started

Outcome = tuple[int, Any, BaseException | None]  # index of a task, its result, its error


class WorkersError(StereoCellError):
    """The worker processes of this machine can't start."""


@dataclass(slots=True)
class _Worker:
    process: BaseProcess
    pipe: "Connection[Any, Any]"
    is_ready: bool = False
    task: int | None = None  # index of the task that it runs; None: it is idle


class WorkerPool:
    """Worker processes. They start with the first tasks and stay until `close`.

    count    number of processes
    modules  names of modules that all workers need; the server imports them once
    """

    def __init__(self, count: int, *modules: str) -> None:
        leave_if_importing_main()
        self._count = min(count, _MOST_PIPES) if sys.platform == "win32" else count
        with children_ignore_interrupts():
            self._context = _choose_context(modules)
        self._workers: list[_Worker] = []

    def run(self, function: Callable[[T], Any], tasks: Sequence[T]) -> Iterator[Outcome]:
        """Yield the outcome of each task, in the order of completion.

        A task whose worker ends without an answer runs again, alone, because the machine most
        likely lacked memory for several tasks at a time. Raises WorkersError if workers can't
        start.
        """
        try:
            while len(self._workers) < self._count:
                self._workers.append(self._start())
            yield from self._outcomes(function, tasks)
            for worker in self._workers:
                self._send_bytes(worker, REST)
        finally:
            # If the caller stopped early, workers are still busy with answers that nobody needs.
            if self._busy():
                self.close()

    def _outcomes(self, function: Callable[[T], Any], tasks: Sequence[T]) -> Iterator[Outcome]:
        waiting, alone = deque(range(len(tasks))), deque[int]()
        retried = set[int]()
        while waiting or alone or self._busy():
            for worker in self._workers:
                if worker.task is None and waiting:
                    self._send(worker, function, tasks, waiting.popleft())
            if not self._busy():
                retried.add(alone[0])
                self._send(self._workers[0], function, tasks, alone.popleft())
            died = []
            for worker in self._heard():
                try:
                    outcome = self._receive(worker)
                except (EOFError, OSError):
                    died.append(worker)
                    continue
                if outcome is not None:
                    yield outcome
            for worker in died:
                task = worker.task
                self._replace(worker)
                if task in retried:
                    yield task, None, StereoCellError(KILLED)
                elif task is not None:
                    alone.append(task)

    def close(self) -> None:
        """End the workers: idle ones by closing their pipes, busy ones at once.

        A Ctrl-C or SIGTERM in the meantime is raised afterwards.
        """
        with interrupts_put_off():
            workers, self._workers = self._workers, []
            for worker in workers:
                if worker.task is not None:
                    worker.process.terminate()
                worker.pipe.close()
            for worker in workers:
                worker.process.join(_END_S)
                if worker.process.is_alive():
                    worker.process.kill()
                    worker.process.join(_END_S)

    def _start(self) -> _Worker:
        ours, theirs = self._context.Pipe()
        # Python ends a daemon by itself if an error keeps the command from calling `close`.
        process = self._context.Process(target=serve, args=(theirs,), daemon=True)
        with children_ignore_interrupts(), _main_from_a_file():
            process.start()
        theirs.close()  # only the worker keeps this end, so the pipe closes when the worker ends
        return _Worker(process, ours)

    def _busy(self) -> list[_Worker]:
        return [worker for worker in self._workers if worker.task is not None]

    def _send(
        self, worker: _Worker, function: Callable[[T], Any], tasks: Sequence[T], task: int
    ) -> None:
        request = pickle.dumps((function, tasks[task]))
        worker.task = task
        self._send_bytes(worker, request)

    def _send_bytes(self, worker: _Worker, request: bytes) -> None:
        # a dead worker is noticed when its answer is received
        with suppress(ConnectionError):
            worker.pipe.send_bytes(request)

    def _heard(self) -> list[_Worker]:
        """Wait for busy workers that have sent something or have died, and return them."""
        by_pipe = {worker.pipe: worker for worker in self._busy()}
        is_starting = not any(worker.is_ready for worker in by_pipe.values())
        heard = connection.wait(list(by_pipe), _START_S if is_starting else None)
        if not heard:
            raise WorkersError(
                f"--workers: the processes did not answer within {_START_S} s: wait until this "
                "machine is less busy, or try fewer --workers; --workers 0 needs no processes"
            )
        return [worker for pipe, worker in by_pipe.items() if pipe in heard]

    def _receive(self, worker: _Worker) -> Outcome | None:
        """Return the outcome of a worker's task; None: the worker only reported that it is ready.

        Raises EOFError or OSError if the worker has died.
        """
        answer = worker.pipe.recv()
        if not worker.is_ready:
            worker.is_ready = answer == READY
            return None
        task, worker.task = worker.task, None
        assert task is not None
        return task, *answer

    def _replace(self, worker: _Worker) -> None:
        """Start another process in place of one that has died."""
        worker.pipe.close()
        worker.process.join(_END_S)
        if not worker.is_ready:
            raise WorkersError(
                "--workers: the worker processes end while they start (exit code "
                f"{worker.process.exitcode}). A script that builds needs the line `if __name__ == "
                "'__main__':` before its first call; --workers 0 needs no processes"
            )
        self._workers[self._workers.index(worker)] = self._start()


def leave_if_importing_main() -> None:
    """End this process silently if it is a worker that imports the command's script.

    A worker imports the script that started it. A script without the line
    `if __name__ == "__main__":` then starts its build again, and the command reports that.
    """
    # multiprocessing itself tests this attribute while a worker imports the command's script
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        os._exit(1)  # an exception would print a traceback


@contextmanager
def _main_from_a_file() -> Iterator[None]:
    """Inside the block, hide the name of a main module that does not come from a file.

    A worker would try to import it by that name, for example `<stdin>` for `python - < script.py`.
    """
    main = vars(sys.modules["__main__"])
    name = main.get("__file__")
    if name is None or os.path.isfile(name):
        yield
        return
    del main["__file__"]
    try:
        yield
    finally:
        main["__file__"] = name


def _choose_context(modules: Sequence[str]) -> Any:
    """Return multiprocessing's context that forks workers from a server, or that spawns them.

    Workers are spawned as fresh processes in these cases:

    - The system has no fork server (Windows), or its libraries fail after a fork (macOS).
    - The server can't open its socket, because the folder of temporary files has a long name or is
      full.
    - The environment has changed since the server started.
    - Python is older than 3.11.1, where the server's socket was open to all users of the machine
      (CVE-2022-42919).
    """
    is_safe = sys.platform == "linux" and sys.version_info >= (3, 11, 1)
    method = "forkserver" if is_safe and _has_server(modules) else "spawn"
    return multiprocessing.get_context(method)


def _has_server(modules: Sequence[str]) -> bool:
    """Return whether workers can be forked from a server. Start the server if there is none."""
    from multiprocessing import forkserver  # Windows lacks it

    if _server_environment:
        return _server_environment == dict(os.environ)
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([serve.__module__, *modules])
    try:
        forkserver.ensure_running()
    except OSError:
        return False
    _server_environment.update(os.environ)
    return True
