"""A server of a bundle that runs in a thread of the test's process."""

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from threading import Thread
from typing import TypeVar

from stereocell.serve.server import BundleServer, Server

S = TypeVar("S", bound=Server)


def serving(out: Path, *, lan: bool = False) -> AbstractContextManager[BundleServer]:
    """Serve a bundle on a free port until the block ends."""
    return running(BundleServer(out, 0, lan))


@contextmanager
def running(server: S) -> Iterator[S]:
    """Run a server until the block ends."""
    thread = Thread(target=server.run)
    thread.start()
    try:
        while not server.has_started:
            time.sleep(0.01)
        yield server
    finally:
        server.stop()
        thread.join()
