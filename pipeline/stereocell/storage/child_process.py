"""Run a library that may end its whole process in a child process.

libarrow aborts on some damaged Parquet files, a network can allocate memory without end, and libCZI
and HDF5's plugins decode in C++ that trusts its input. No `except` catches an abort. So such a
library runs in a child process, and its death becomes an error of one line. Rejected alternatives:

- A child that only tests the file first. It must decode every chunk, which doubles the reading, and
  a byte on a bad disk that fails later still ends the command.
- The engine's workers. They turn a death into a line already, but `plan`, `slices`, `iso` and
  `--workers 0` read in the command's own process.
- multiprocessing. Its children import the caller's script again (`spawn`), so users' scripts would
  need a main guard. Workers of Dask are daemons, which may have no children.
- Readers of all formats in a child. Voxels would pass through a pipe, and each command would start
  0.3 s later, for libraries that have not aborted on a damaged file so far.

A child is an interpreter that runs `main` below. It makes one object by a function that the parent
names, and calls the object's methods on request, with pickles through pipes. It starts in 0.1 s
plus the time of its imports, on Linux, macOS and Windows.

If a call has bounds, the parent watches the child's time and resident memory, and kills a child
that exceeds them. A child whose parent dies ends by itself. Output of its libraries is discarded.
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

_LOOK_S = 0.05  # s between two checks of a child's time and memory
_NUMBER = struct.Struct("<Q")  # format of the number of parts, and of a part's size in bytes
_PROTOCOL = 5  # first protocol of pickle that can keep arrays outside of the pickle


@dataclass(frozen=True, slots=True)
class Bounds:
    """Largest time and resident memory of a call; None: no bound."""

    seconds: float | None = None
    memory_bytes: int | None = None


class ChildError(StereoCellError):
    """A child has ended or exceeded its bounds. The text is the end of a sentence."""


class Child:
    """An object in a process of its own, made by `factory(*arguments)`.

    factory    function or class of an importable module
    arguments  values that can be pickled

    An exception that the factory or a method raises is raised here, too. If it is a bug, its
    traceback is attached as a note. Raises ChildError if the process dies or exceeds `bounds`. One
    call runs at a time.
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
        """Return the result of a method of the object.

        bounds  bounds of this call; None: those of the object
        """
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
            except BaseException:  # after Ctrl+C, half an answer may be in the pipe
                pipes.kill()
                raise
        is_sound, answer = _unpickled(parts)
        if not is_sound:
            raise answer
        return answer


def run_in_child(
    function: Callable[..., Any], *arguments: Any, bounds: Bounds | None = None
) -> Any:
    """Run a function in a process of its own and return its result. Raises as `Child` does."""
    with Child(_Call, function, arguments, bounds=bounds) as child:
        return child.call("result")


class _Call:
    """An object that holds the result of a function, for `run_in_child`."""

    def __init__(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        self._result = function(*arguments)

    def result(self) -> Any:
        return self._result


class _Watch:
    """Kills a process that exceeds its bounds inside the block.

    excess  words on the bound that was exceeded; empty: none was
    """

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
            except psutil.Error:  # the process has ended
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
        with suppress(OSError):  # the dead process has left bytes unread
            if pipe is not None:
                pipe.close()


def _end(code: int) -> str:
    """Return the words for how a process ended."""
    if code >= 0:
        return f"its process ended with exit code {code}"
    name = signal.Signals(-code).name if -code in list(signal.Signals) else f"signal {-code}"
    meaning = " (killed, probably for lack of memory)" if name == "SIGKILL" else ""
    return f"its process ended by {name}{meaning}"


def _send(pipe: IO[bytes], message: Any) -> None:
    """Write a message: the number of its parts, then the size in bytes and content of each part.

    The first part is the pickle. The others are the arrays in it, which are not copied.
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
    """Return the parts of the next message. Raises EOFError if the other side is gone."""
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
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent reacts to Ctrl+C and ends the child
    answers = os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)  # keeps the output of libraries out of the answers
    requests: SimpleQueue[list[bytearray]] = SimpleQueue()
    threading.Thread(target=_await_requests, args=(requests,), daemon=True).start()
    made: list[Any] = []
    while True:
        parts = requests.get()
        try:
            answer = (True, _answer(made, *_unpickled(parts)))
        except Exception as error:
            answer = (False, _picklable(error))
        del parts
        _send(answers, answer)


def _answer(made: list[Any], name: Any, arguments: tuple[Any, ...]) -> Any:
    """Make the object if the list is empty and put it there, or call its method.

    name  module and name of the function that makes the object; later the name of a method
    """
    if made:
        return getattr(made[0], name)(*arguments)
    made.append(_named(*name)(*arguments))
    return None


def _await_requests(requests: "SimpleQueue[list[bytearray]]") -> None:
    """Fill the queue. If the parent is gone, end the process, even inside a library's call."""
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


def _picklable(error: Exception) -> Exception:
    """Return an exception that can be pickled. If it is a bug, its traceback becomes a note."""
    import traceback

    if not isinstance(error, StereoCellError):
        error.add_note("".join(traceback.format_exception(error)))
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
