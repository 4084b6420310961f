"""Work of a library that can end its whole process, in a process of its own.

libarrow aborts on some damaged Parquet files, a network can allocate without end, and libCZI and
HDF5's plugins decode in C++ that trusts its input. No `except` catches an abort. So such a library
runs in a child process, and a child that dies is one line. Considered:

- A child that only tries the file first. It must decode every chunk to prove anything, which
  doubles the reading, and the next damaged byte on a bad disk still ends the command.
- The engine's workers. They turn a death into a line already, but `plan`, `slices`, `iso` and
  `--workers 0` read in the command's own process.
- multiprocessing. Its children import the caller's script again (`spawn`), which asks for a main
  guard in the scripts of users, and workers of Dask are daemons, which may have no children.
- The readers of all formats in a child. Voxels would pass a pipe, and each command would start
  0.3 s later, for libraries that have not aborted on a damaged file so far.

So a child is an interpreter that runs `main` below. It makes one object by a function that the
parent names, then calls its methods as the parent asks, with pickles through pipes. It starts in
0.1 s and the time of its imports. It works alike on Linux, macOS and Windows.

The parent watches the child's time and resident memory where a call has bounds, and kills it beyond
them. A child whose parent dies ends by itself. What its libraries print is discarded.
"""

import importlib
import os
import pickle
import signal
import struct
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from queue import SimpleQueue
from typing import IO, Any

from stereocell.model.errors import StereoCellError

_LOOK_S = 0.05  # seconds between two looks at a child's time and memory
_NUMBER = struct.Struct("<Q")  # of parts, and of bytes of a part
_PROTOCOL = 5  # of pickle: the first one with arrays beside the pickle


@dataclass(frozen=True, slots=True)
class Bounds:
    """The most that a call may take; None: no bound."""

    seconds: float | None = None
    memory_bytes: int | None = None


class ChildError(StereoCellError):
    """A child ended, or took more than its bounds; the text says which, without a subject."""


class Child:
    """An object that lives in a process of its own, made by `factory(*arguments)`.

    factory    a function or class of a module, of the package or of a test
    arguments  values that can be pickled

    An exception that the factory or a method raises is raised here as well; a bug's traceback is a
    note of it. Raises ChildError where the process dies or exceeds `bounds`.
    One call runs at a time.
    """

    def __init__(
        self, factory: Callable[..., Any], *arguments: Any, bounds: Bounds | None = None
    ) -> None:
        self._lock = threading.Lock()
        self._bounds = bounds or Bounds()
        code = f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import main; main()"
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", code],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        self._finish = weakref.finalize(self, _finish, self._process)
        try:
            self._ask((factory.__module__, factory.__qualname__), arguments)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> "Child":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def call(self, method: str, *arguments: Any, bounds: Bounds | None = None) -> Any:
        """Return what a method of the object returns; `bounds` of this call replace the usual."""
        return self._ask(method, arguments, bounds)

    def close(self) -> None:
        """End the process."""
        self._finish()

    def _ask(self, what: Any, arguments: tuple[Any, ...], bounds: Bounds | None = None) -> Any:
        pipes = self._process
        assert pipes.stdin is not None
        assert pipes.stdout is not None
        with self._lock, _Watch(pipes, bounds or self._bounds) as watch:
            try:
                _send(pipes.stdin, (what, arguments))
                parts = _receive(pipes.stdout)
            except (OSError, EOFError, ValueError):
                pipes.kill()
                raise ChildError(watch.excess or _end(pipes.wait())) from None
            except BaseException:  # Ctrl+C: half an answer may be in the pipe
                pipes.kill()
                raise
        is_sound, answer = _unpickled(parts)
        if not is_sound:
            raise answer
        return answer


def run_in_child(
    function: Callable[..., Any], *arguments: Any, bounds: Bounds | None = None
) -> Any:
    """Return what a function returns in a process of its own. Raises as `Child` does."""
    with Child(_Call, function, arguments, bounds=bounds) as child:
        return child.call("result")


class _Call:
    """A function's result, as an object whose one method returns it."""

    def __init__(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        self._result = function(*arguments)

    def result(self) -> Any:
        return self._result


class _Watch:
    """Kills a process that exceeds its bounds inside the block; `excess` says so, else empty."""

    def __init__(self, process: subprocess.Popen[bytes], bounds: Bounds) -> None:
        self.excess = ""
        self._process, self._bounds = process, bounds
        self._is_over = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> "_Watch":
        if self._bounds != Bounds():
            self._thread = threading.Thread(target=self._look, daemon=True)
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._is_over.set()
        if self._thread is not None:
            self._thread.join()

    def _look(self) -> None:
        import psutil

        start = time.monotonic()
        while not self._is_over.wait(_LOOK_S):
            seconds, memory = self._bounds.seconds, self._bounds.memory_bytes
            try:
                resident = psutil.Process(self._process.pid).memory_info().rss
            except psutil.Error:  # it has ended
                return
            if memory is not None and resident > memory:
                self.excess = f"it took more than {memory / 1e9:g} GB of memory"
            elif seconds is not None and time.monotonic() - start > seconds:
                self.excess = f"it did not end within {seconds:g} s"
            if self.excess:
                self._process.kill()
                return


def _finish(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout):
        with suppress(OSError):  # bytes that the dead process did not take
            if pipe is not None:
                pipe.close()


def _end(code: int) -> str:
    """Return the words for how a process ended."""
    if code >= 0:
        return f"its process ended with exit code {code}"
    name = signal.Signals(-code).name if -code in list(signal.Signals) else f"signal {-code}"
    meaning = " (killed, as for lack of memory)" if name == "SIGKILL" else ""
    return f"its process ended by {name}{meaning}"


def _send(pipe: IO[bytes], message: Any) -> None:
    """Write a message: the number of its parts, then each part behind its size in bytes.

    The first part is the pickle, and the others are the arrays in it, which are not copied.
    """
    arrays: list[pickle.PickleBuffer] = []
    content = pickle.dumps(message, protocol=_PROTOCOL, buffer_callback=arrays.append)
    parts = [memoryview(content), *(array.raw() for array in arrays)]
    pipe.write(_NUMBER.pack(len(parts)))
    for part in parts:
        pipe.write(_NUMBER.pack(part.nbytes))
        pipe.write(part)
    pipe.flush()


def _receive(pipe: IO[bytes]) -> list[bytearray]:
    """Return the parts of the next message. Raises EOFError where the other side is gone."""
    (count,) = _NUMBER.unpack(_exactly(pipe, _NUMBER.size))
    parts = []
    for _ in range(count):
        (size,) = _NUMBER.unpack(_exactly(pipe, _NUMBER.size))
        parts.append(_exactly(pipe, size))
    return parts


def _unpickled(parts: list[bytearray]) -> Any:
    return pickle.loads(parts[0], buffers=parts[1:])


def _exactly(pipe: IO[bytes], size: int) -> bytearray:
    content = bytearray(size)
    view, filled = memoryview(content), 0
    while filled < size:
        read = pipe.readinto(view[filled:])  # type: ignore[attr-defined]
        if not read:
            raise EOFError("the pipe has ended")
        filled += read
    return content


def main() -> None:
    """Make the object, then call its methods, until the parent ends or closes the pipe."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl+C is for the parent, which ends the child
    answers = os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)  # so that a library which prints does not disturb the answers
    requests: SimpleQueue[list[bytearray]] = SimpleQueue()
    threading.Thread(target=_await_requests, args=(requests,), daemon=True).start()
    made: list[Any] = []
    while True:
        parts = requests.get()
        try:
            answer = (True, _obey(made, *_unpickled(parts)))
        except Exception as error:
            answer = (False, _carried(error))
        del parts
        _send(answers, answer)


def _obey(made: list[Any], what: Any, arguments: tuple[Any, ...]) -> Any:
    """Make the object, which is then the only one of the list, or call its method."""
    if made:
        return getattr(made[0], what)(*arguments)
    made.append(_named(*what)(*arguments))
    return None


def _await_requests(requests: "SimpleQueue[list[bytearray]]") -> None:
    """Fill the queue; end the process where the parent is gone, even inside a library's call."""
    try:
        while True:
            requests.put(_receive(sys.stdin.buffer))
    except (EOFError, OSError):
        os._exit(0)


def _named(module: str, name: str) -> Any:
    found: Any = importlib.import_module(module)
    for part in name.split("."):
        found = getattr(found, part)
    return found


def _carried(error: Exception) -> Exception:
    """Return an exception as it can be pickled, with its traceback as a note if it is a bug."""
    import traceback

    if not isinstance(error, StereoCellError):
        error.add_note("".join(traceback.format_exception(error)))
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
