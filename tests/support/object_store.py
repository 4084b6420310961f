"""An object store on localhost for tests: versitygw if it is installed, otherwise moto's server."""

import asyncio
import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
import s3fs
from zarr.core.sync import _get_loop as zarr_loop

KEY, SECRET = "tester", "not-a-secret"
# Found on the PATH, or beside Python, where `make object-store` installs it.
VERSITYGW = shutil.which("versitygw", path=f"{Path(sys.executable).parent}:{os.environ['PATH']}")


@dataclass(frozen=True)
class ObjectStore:
    """A running store; `kind` is the name of its server."""

    kind: str
    endpoint: str

    @property
    def environment(self) -> dict[str, str]:
        return {
            "AWS_ACCESS_KEY_ID": KEY,
            "AWS_SECRET_ACCESS_KEY": SECRET,
            "AWS_ENDPOINT_URL": self.endpoint,
            "AWS_DEFAULT_REGION": "us-east-1",
        }

    def files(self) -> s3fs.S3FileSystem:
        return s3fs.S3FileSystem(
            key=KEY, secret=SECRET, endpoint_url=self.endpoint, use_listings_cache=False
        )


@contextmanager
def serving(folder: Path) -> Iterator[ObjectStore]:
    """Start a store that keeps its objects in `folder` (versitygw) or in memory (moto)."""
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    if VERSITYGW is not None:
        kind = "versitygw"
        command = [VERSITYGW, "--access", KEY, "--secret", SECRET]
        command += ["--port", f"127.0.0.1:{port}", "posix", str(folder)]
    else:
        kind = "moto"
        command = [sys.executable, "-m", "moto.server", "-p", str(port)]
    quiet = subprocess.DEVNULL
    with subprocess.Popen(command, stdout=quiet, stderr=quiet) as server:
        try:
            _await_port(server, port)
            _forget_others()
            yield ObjectStore(kind, f"http://127.0.0.1:{port}")
        finally:
            _forget_others()
            server.terminate()


@contextmanager
def serving_bucket(folder: Path) -> Iterator[ObjectStore]:
    """Start a store with an empty `bucket`, which the environment points at."""
    with serving(folder) as store, pytest.MonkeyPatch.context() as patch:
        for name, value in store.environment.items():
            patch.setenv(name, value)
        store.files().mkdir("bucket")
        yield store


def _await_port(server: subprocess.Popen[bytes], port: int) -> None:
    end = time.monotonic() + 60
    while time.monotonic() < end and server.poll() is None:
        with closing(socket.socket()) as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.05)
    raise RuntimeError("the object store does not answer")


def _forget_others() -> None:
    """Close the file systems that s3fs caches by their arguments.

    The cache ignores the environment, which states the address of the store.
    """
    for fs in list(s3fs.S3FileSystem._cache.values()):
        if fs._s3 is not None:
            loop = zarr_loop() if fs.asynchronous else fs.loop  # the loop in which it was opened
            closing = fs._s3.__aexit__(None, None, None)
            asyncio.run_coroutine_threadsafe(closing, loop).result(30)
    s3fs.S3FileSystem.clear_instance_cache()
