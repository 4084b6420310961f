"""Join a running Dask cluster, and check that it can do the work."""

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

T = TypeVar("T")
R = TypeVar("R")

_ANSWER_S = 8  # s for a scheduler to answer
_WORKER_S = 20  # s for its first worker to appear
_MAX_BYTES = 1 << 20  # largest size of a scheduler file in bytes
_ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx)://\S+")
_TLS_HELP = (
    "expected certificates in Dask's configuration, and DASK_CONFIG to name its file (see "
    "docs/cluster.md)"
)
_EXPECTED = "expected the address of a Dask scheduler, as tls://host:8786, or its scheduler file"


class ClusterError(StereoCellError):
    """The cluster can't be joined, or its workers can't do the work."""


def join(scheduler: str, shared: Path | None) -> Any:
    """Return a client of a cluster.

    scheduler  address, as `tls://host:8786`, or the path of a scheduler file
    shared     a file that all workers must see, or None

    A scheduler with TLS (`tls://`) takes the certificates of Dask's configuration.

    Raises ClusterError where the scheduler doesn't answer or refuses us, or where the workers lack
    StereoCell, would write other bytes than this process (another version of StereoCell or of a
    library, other code), or don't see the file.
    """
    is_file = Path(scheduler).is_file()
    address = _address_in(Path(scheduler)) if is_file else scheduler
    if not is_file and not _ADDRESS.fullmatch(address):
        raise ClusterError(f"--scheduler {scheduler}: no such file and no address; {_EXPECTED}")
    from distributed import Client

    try:
        # The client is not the default one, so that a caller's own use of Dask stays as it is.
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
    """Return whether a cluster runs the code of everybody who can reach its scheduler's port."""
    return not str(client.scheduler.address).startswith("tls://")


def _reason(error: Exception) -> str:
    """Return why a scheduler can't be joined, and a remedy."""
    text = str(error).splitlines()[0] if str(error) else "it does not answer"
    if isinstance(error, TypeError) and "ssl_context" in text:  # Dask's message
        return f"it admits only clients with a certificate, and this command has none; {_TLS_HELP}"
    return f"{text}; {_EXPECTED}"


def _address_in(file: Path) -> str:
    """Return the address in a scheduler file. Raises ClusterError where there is none."""
    try:
        with file.open("rb") as opened:
            content = json.loads(opened.read(_MAX_BYTES))
    except (OSError, ValueError, RecursionError) as error:
        raise ClusterError(f"--scheduler {file}: {error!s:.100}; {_EXPECTED}") from None
    address = content.get("address") if isinstance(content, dict) else None
    if not isinstance(address, str) or not _ADDRESS.fullmatch(address):
        raise ClusterError(f"--scheduler {file}: address: found {address!r:.100}; {_EXPECTED}")
    return address


def _require_able(client: Any, scheduler: str, shared: Path | None) -> None:
    try:
        client.wait_for_workers(1, timeout=_WORKER_S)
    except TimeoutError:
        raise ClusterError(f"--scheduler {scheduler}: has no workers") from None
    ours = _look()
    for address, answer in client.run(_look_at, str(shared or ""), on_error="return").items():
        if isinstance(answer, BaseException):
            raise ClusterError(
                f"worker {address}: can't run StereoCell: {type(answer).__name__}: {answer}"
            )
        _require_alike(f"worker {address} on", answer, ours, shared)


def able(function: Callable[[T], R], shared: Path | None) -> Callable[[T], R]:
    """Return a function that first applies the checks of `join` to its own worker.

    Workers may join while others are at work.
    """
    return _Able(function, _look(), shared)


@dataclass(frozen=True, slots=True)
class _Sight:
    """A worker: versions of StereoCell and libraries, a digest of our code, access to a file.

    extras  versions of packages of extras that make results; empty: not installed. A worker may
            lack one, because few builds use it. A build that needs it reports that by itself
    """

    host: str
    versions: tuple[tuple[str, str], ...]
    extras: tuple[tuple[str, str], ...]
    code: str
    sees: bool = True


@dataclass(frozen=True, slots=True)
class _Able(Generic[T, R]):
    function: Callable[[T], R]
    ours: _Sight
    shared: Path | None

    def __call__(self, task: T) -> R:
        here = _look_at(str(self.shared or ""))
        _require_alike("a worker on", here, self.ours, self.shared)
        return self.function(task)


def _require_alike(who: str, worker: _Sight, ours: _Sight, shared: Path | None) -> None:
    who = f"{who} {worker.host}"
    found = dict(worker.versions)
    for name, expected in ours.versions:
        if found.get(name) != expected:
            raise ClusterError(f"{who}: has {name} {found.get(name, 'none')}, expected {expected}")
    found = dict(worker.extras)
    for name, expected in ours.extras:
        if expected and found[name] not in (expected, ""):
            raise ClusterError(f"{who}: has {name} {found[name]}, expected {expected}")
    if worker.code != ours.code:
        raise ClusterError(
            f"{who}: runs other code than this command: expected the same installation of "
            "StereoCell, and workers that were started after it"
        )
    if not worker.sees:
        raise ClusterError(
            f"{who}: does not see {shared}; expected OUT in a file system that all of the "
            "cluster share"
        )


def _look_at(shared: str) -> _Sight:
    return replace(_look(), sees=not shared or Path(shared).exists())


def _look() -> _Sight:
    versions = {"StereoCell": version("stereocell"), **all_libraries()}
    extras = tuple((name, version_of(name)) for name in MAKERS)
    return _Sight(socket.gethostname(), tuple(versions.items()), extras, _digest_of_code())


@cache
def _digest_of_code() -> str:
    """Return a digest of this installation's own code."""
    digest, package = hashlib.sha256(), Path(__file__).parents[1]
    for file in sorted(package.rglob("*.py")):
        digest.update(f"{file.relative_to(package).as_posix()}\n".encode() + file.read_bytes())
    return digest.hexdigest()
