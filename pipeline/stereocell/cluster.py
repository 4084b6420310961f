"""Join a Dask cluster that others have started, and see that it can do the work."""

import json
import re
import socket
from importlib.metadata import version
from pathlib import Path
from typing import Any

from stereocell.errors import StereoCellError

_ANSWER_S = 8  # in which a scheduler has to answer
_WORKER_S = 20  # and to have its first worker
_MAX_BYTES = 1 << 20  # of a scheduler file
_ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx)://\S+")
_EXPECTED = "expected the address of a Dask scheduler, as tcp://host:8786, or its scheduler file"


class ClusterError(StereoCellError):
    """The cluster can't be joined, or its workers can't do the work."""


def join(scheduler: str, shared: Path | None) -> Any:
    """Return a client of a cluster.

    scheduler  address, as `tcp://host:8786`, or the path of a scheduler file
    shared     a file that all workers have to see, or None

    Raises ClusterError if nobody answers, or the workers lack StereoCell, have another version of
    it, or don't see the file.
    """
    is_file = Path(scheduler).is_file()
    address = _address_in(Path(scheduler)) if is_file else scheduler
    if not is_file and not _ADDRESS.fullmatch(address):
        raise ClusterError(f"--scheduler {scheduler}: no such file and no address; {_EXPECTED}")
    from distributed import Client

    try:
        client = Client(address, timeout=_ANSWER_S)
    except (OSError, OverflowError, ValueError, TypeError, KeyError) as error:
        reason = str(error).splitlines()[0] if str(error) else "it does not answer"
        raise ClusterError(f"--scheduler {scheduler}: {reason}; {_EXPECTED}") from None
    try:
        _require_able(client, scheduler, shared)
    except BaseException:
        client.close()
        raise
    return client


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
    ours = version("stereocell")
    for address, answer in client.run(_look, str(shared or ""), on_error="return").items():
        if isinstance(answer, BaseException):
            raise ClusterError(
                f"worker {address}: can't run StereoCell: {type(answer).__name__}: {answer}"
            )
        host, theirs, sees = answer
        if theirs != ours:
            raise ClusterError(
                f"worker {address} on {host}: has StereoCell {theirs}, expected {ours}"
            )
        if not sees:
            raise ClusterError(
                f"worker {address} on {host}: does not see {shared}; expected OUT in a file system "
                "that all of the cluster share"
            )


def _look(shared: str) -> tuple[str, str, bool]:
    """Return, on a worker: its host, its version, and whether it sees a file."""
    return socket.gethostname(), version("stereocell"), not shared or Path(shared).exists()
