"""Run tasks in a worker process, at its end of the pipe.

The process starts with the function `serve`. This module imports little, because a spawned worker
imports it before anything else.
"""

import os
import pickle
import signal
import threading
from multiprocessing import connection, parent_process
from multiprocessing.connection import Connection
from typing import Any

from stereocell.storage.processes import keep_freed_memory, release_freed_memory

READY = "ready"  # first answer of a worker, once it has started
REST = b"rest"  # request after the last task of a run; it has no answer


def serve(pipe: "Connection[Any, Any]") -> None:
    """Run the tasks that arrive on a pipe, one after another, until its other end is closed.

    A request is the pickled (function, task). The answer is (result, None) or (None, error).
    After a run, the request REST lets the worker return its memory. The tasks of one run have
    arrays of similar sizes, so memory is kept between them.
    """
    keep_freed_memory()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # only the command itself reacts to Ctrl-C
    threading.Thread(target=end_with_parent, daemon=True).start()
    try:
        pipe.send(READY)
        while True:
            request = pipe.recv_bytes()
            if request == REST:
                release_freed_memory()
            else:
                pipe.send_bytes(_answer(request))
    except (EOFError, OSError):  # the command has closed its end, or has ended
        return


def _answer(request: bytes) -> bytes:
    """Return the pickled answer to a request, which may be the task's error."""
    try:
        function, task = pickle.loads(request)
        return pickle.dumps((function(task), None))
    except Exception as error:  # the command decides how to treat a task's error
        return _pickled_error(error)


def _pickled_error(error: Exception) -> bytes:
    """Return the pickled error. An error that can't be pickled becomes a RuntimeError."""
    try:
        answer = pickle.dumps((None, error))
        pickle.loads(answer)
    except Exception:  # pickling runs code of the error's class, which may raise anything
        text = f"{type(error).__name__}: {error}"
        answer = pickle.dumps((None, RuntimeError(text)))
    return answer


def end_with_parent() -> None:
    """End this process as soon as the command's process has ended, even in the middle of a task.

    A killed command can't stop its workers, whose results would appear after its end.
    """
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)
