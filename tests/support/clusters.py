"""A Dask cluster for tests: it listens on loopback only, and refuses clients without its key."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import dask
import pytest
import trustme

from support.server.timeouts import PATIENCE_S

# The dashboard needs an address: `--no-dashboard` leaves some of its pages open to the network.
_ON_LOOPBACK = ["--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0"]


@dataclass(frozen=True)
class Cluster:
    """A running `dask scheduler` and its workers."""

    file: str  # path of the scheduler file
    scheduler: subprocess.Popen[bytes]
    workers: list[subprocess.Popen[bytes]]


def write_tls(folder: Path) -> dict[str, object]:
    """Write certificates into a folder; return the settings of Dask that use them."""
    authority = trustme.CA()
    authority.cert_pem.write_to_path(folder / "authority.pem")
    own = folder / "key.pem"
    authority.issue_cert("dask.test").private_key_and_cert_chain_pem.write_to_path(own)
    comm = "distributed.comm"
    return {
        f"{comm}.require-encryption": True,
        f"{comm}.tls.ca-file": str(folder / "authority.pem"),
        **{f"{comm}.tls.{role}.cert": str(own) for role in ("scheduler", "worker", "client")},
    }


def as_variables(settings: Mapping[str, object]) -> dict[str, str]:
    """Return the environment that gives settings to Dask, as its documentation names them."""
    return {
        "DASK_" + name.upper().replace(".", "__").replace("-", "_"): str(value)
        for name, value in settings.items()
    }


def wait_for_scheduler(file: Path) -> None:
    """Wait until a scheduler has written the whole of its scheduler file, at most PATIENCE_S."""
    end = time.monotonic() + PATIENCE_S
    # Dask opens the file before it writes it, so an existing file may still be empty.
    while time.monotonic() < end:
        with suppress(FileNotFoundError, ValueError):
            json.loads(file.read_text("utf-8"))
            return
        time.sleep(0.02)
    pytest.fail(f"{file.name} is not complete after {PATIENCE_S:.0f} s")


@contextmanager
def running_cluster(
    folder: Path, workers: int, environment: Mapping[str, str] | None = None
) -> Iterator[Cluster]:
    """Run a scheduler and workers of one thread, with TLS.

    folder  holds the certificates and the scheduler file, and is the workers' working folder

    Within the block, this process and the commands that it starts have the certificates.
    """
    file = folder / "scheduler.json"
    file.unlink(missing_ok=True)
    settings = write_tls(folder)
    tls = as_variables(settings)
    given = {**(os.environ if environment is None else environment), **tls}
    with pytest.MonkeyPatch.context() as patch:
        for name, value in tls.items():
            patch.setenv(name, value)
        with dask.config.set(settings):
            processes = [_start(folder, given, "scheduler", "--port", "0", "--protocol", "tls")]
            try:
                # A nanny would start a killed worker again.
                lone = ("worker", "--nthreads", "1", "--no-nanny")
                processes += [_start(folder, given, *lone) for _ in range(workers)]
                wait_for_scheduler(file)
                yield Cluster(str(file), processes[0], processes[1:])
            finally:
                for process in reversed(processes):
                    process.kill()
                    process.wait()


def _start(folder: Path, environment: Mapping[str, str], *words: str) -> subprocess.Popen[bytes]:
    arguments = ["--scheduler-file", str(folder / "scheduler.json"), *_ON_LOOPBACK]
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *words, *arguments],
        cwd=folder,
        env=environment,
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
