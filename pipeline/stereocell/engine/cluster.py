"""Join a running Dask cluster, and check that its workers can do the work."""

import hashlib
import json
import re
import socket
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Generic, TypeVar

from stereocell.engine.step_record import all_libraries
from stereocell.model.errors import StereoCellError
from stereocell.model.extra_packages import MAKERS, version_of
from stereocell.storage.processes import keep_freed_memory, release_freed_memory

T = TypeVar("T")
R = TypeVar("R")

_ANSWER_S = 8  # s for a scheduler to answer
_WORKER_S = 20  # s for the first worker of a scheduler to appear
_MAX_BYTES = 1 << 20  # bytes; largest scheduler file
_ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx)://\S+")
_TLS_HELP = (
    "expected certificates in Dask's configuration, and DASK_CONFIG to name its file (see "
    "docs/cluster.md)"
)
_EXPECTED = (
    "expected the address of a Dask scheduler, such as tls://host:8786, or its scheduler file"
)


class ClusterError(StereoCellError):
    """The cluster can't be joined, or its workers can't do the work."""


def join(scheduler: str, shared: Path | None) -> Any:
    """Return a client of a cluster.

    scheduler  address, such as `tls://host:8786`, or the path of a scheduler file
    shared     a file that all workers must see; None: there is none

    For a scheduler with TLS (`tls://`) the certificates come from Dask's configuration.

    Raises ClusterError in these cases:

    - The scheduler does not answer, or refuses this client.
    - A worker lacks StereoCell, or does not see the file.
    - A worker has other code, or another version of StereoCell or of a library. It might write
      other bytes than this process.
    """
    is_file = Path(scheduler).is_file()
    address = _address_in(Path(scheduler)) if is_file else scheduler
    if not is_file and not _ADDRESS.fullmatch(address):
        raise ClusterError(f"--scheduler {scheduler}: found no such file, {_EXPECTED}")
    from distributed import Client

    try:
        # The client does not become Dask's default, because the caller may use Dask, too.
        client = Client(address, timeout=_ANSWER_S, set_as_default=False)
    except (OSError, OverflowError, ValueError, TypeError, KeyError, RuntimeError) as error:
        raise ClusterError(f"--scheduler {scheduler}: {_reason(error)}") from None
    try:
        _require_able(client, scheduler, shared)
    except BaseException:
        client.close()
        raise
    return client


def is_open_to_all(client: Any) -> bool:
    """Return whether anybody who can reach the scheduler's port can run code on the cluster."""
    return not str(client.scheduler.address).startswith("tls://")


def _reason(error: Exception) -> str:
    """Return why a scheduler can't be joined, and what to do."""
    text = str(error).splitlines()[0] if str(error) else "the scheduler does not answer"
    if isinstance(error, TypeError) and "ssl_context" in text:  # Dask's error without a certificate
        return (
            "the scheduler admits only clients with a certificate, and this command has none, "
            f"{_TLS_HELP}"
        )
    return f"{text}, {_EXPECTED}"


def _address_in(file: Path) -> str:
    """Return the address in a scheduler file. Raises ClusterError if there is none."""
    try:
        with file.open("rb") as opened:
            content = json.loads(opened.read(_MAX_BYTES))
    except (OSError, ValueError, RecursionError) as error:
        raise ClusterError(f"--scheduler {file}: {error!s:.100}, {_EXPECTED}") from None
    address = content.get("address") if isinstance(content, dict) else None
    if not isinstance(address, str) or not _ADDRESS.fullmatch(address):
        raise ClusterError(f"--scheduler {file}: address: found {address!r:.100}, {_EXPECTED}")
    return address


def _require_able(client: Any, scheduler: str, shared: Path | None) -> None:
    try:
        client.wait_for_workers(1, timeout=_WORKER_S)
    except TimeoutError:
        raise ClusterError(
            f"--scheduler {scheduler}: the cluster has no workers, expected at least one"
        ) from None
    ours = _describe()
    for address, answer in client.run(
        _describe_worker, str(shared or ""), on_error="return"
    ).items():
        if isinstance(answer, BaseException):
            raise ClusterError(
                f"worker {address}: can't run StereoCell: {type(answer).__name__}: {answer}"
            )
        _require_alike(f"worker {address} on", answer, ours, shared)


def able(function: Callable[[T], R], shared: Path | None) -> Callable[[T], R]:
    """Return a function that first applies the checks of `join` to the worker it runs on.

    A worker may join the cluster after `join` has checked the others.
    """
    return _Able(function, _describe(), shared)


@dataclass(frozen=True, slots=True)
class _Installation:
    """The installation of StereoCell on a worker.

    versions  versions of StereoCell and of the libraries that make results
    extras    versions of optional packages that make results; empty: not installed. A worker may
              lack one, because few builds use it, and a build that needs it reports that by itself
    code      digest of StereoCell's code
    sees      whether the worker sees the shared file
    """

    host: str
    versions: tuple[tuple[str, str], ...]
    extras: tuple[tuple[str, str], ...]
    code: str
    sees: bool = True


@dataclass(frozen=True, slots=True)
class _Able(Generic[T, R]):
    function: Callable[[T], R]
    ours: _Installation
    shared: Path | None

    def __call__(self, task: T) -> R:
        here = _describe_worker(str(self.shared or ""))
        _require_alike("a worker on", here, self.ours, self.shared)
        keep_freed_memory()
        try:
            return self.function(task)
        finally:
            release_freed_memory()


def _require_alike(
    place: str, worker: _Installation, ours: _Installation, shared: Path | None
) -> None:
    place = f"{place} {worker.host}"
    found = dict(worker.versions)
    for name, expected in ours.versions:
        if found.get(name) != expected:
            raise ClusterError(
                f"{place}: has {name} {found.get(name, 'none')}, expected {expected}"
            )
    found = dict(worker.extras)
    for name, expected in ours.extras:
        if expected and found[name] not in (expected, ""):
            raise ClusterError(f"{place}: has {name} {found[name]}, expected {expected}")
    if worker.code != ours.code:
        raise ClusterError(
            f"{place}: runs other code than this command, expected the same installation of "
            "StereoCell, and workers that were started after it"
        )
    if not worker.sees:
        raise ClusterError(
            f"{place}: does not see {shared}, expected OUT in a file system that the whole cluster "
            "shares"
        )


def _describe_worker(shared: str) -> _Installation:
    return replace(_describe(), sees=not shared or Path(shared).exists())


def _describe() -> _Installation:
    versions = {"StereoCell": version("stereocell"), **all_libraries()}
    extras = tuple((name, version_of(name)) for name in MAKERS)
    return _Installation(socket.gethostname(), tuple(versions.items()), extras, _digest_of_code())


@cache
def _digest_of_code() -> str:
    """Return a digest of StereoCell's code on this machine."""
    digest, package = hashlib.sha256(), Path(__file__).parents[1]
    for file in sorted(package.rglob("*.py")):
        digest.update(f"{file.relative_to(package).as_posix()}\n".encode() + file.read_bytes())
    return digest.hexdigest()
