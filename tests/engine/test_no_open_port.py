"""Another user of the machine, or of the network, can't run code in a command's processes."""

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from distributed import Client, LocalCluster

from support.busy_command import started_with_two_tasks

pytestmark = pytest.mark.slow


@pytest.fixture
def family(tmp_path: Path) -> Iterator[list[psutil.Process]]:
    """The processes of a command whose two workers are busy."""
    command = started_with_two_tasks(tmp_path)
    first = psutil.Process(command.pid)
    try:
        yield [first, *first.children(recursive=True)]
    finally:
        command.terminate()
        command.communicate()


def listening(processes: list[psutil.Process]) -> list[tuple[str, int]]:
    """Return host and port of every socket of the processes that takes connections or packets."""
    return [
        (socket.laddr.ip, socket.laddr.port)
        for process in processes
        for socket in process.net_connections("inet")
        if socket.laddr and not socket.raddr
    ]


def code_run_by_a_stranger(host: str, port: int) -> int | None:
    """Run a function in the process that listens, as an attacker would; None: it was refused."""
    try:
        with Client(f"tcp://{host}:{port}", timeout=2) as client:
            return int(client.run_on_scheduler(os.getpid))
    except (OSError, TimeoutError):  # the error of Dask if there is no scheduler
        return None


def test_the_attack_runs_code_in_a_dask_cluster_without_certificates() -> None:
    """Without this test, the next one could pass because its attack never works."""
    with LocalCluster(
        n_workers=0,
        processes=False,
        protocol="tcp",
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
    ) as cluster:
        host, _, port = cluster.scheduler_address.removeprefix("tcp://").partition(":")
        assert (host, int(port)) in listening([psutil.Process()])
        assert code_run_by_a_stranger(host, int(port)) == os.getpid()


def test_workers_of_this_machine_listen_on_no_port(family: list[psutil.Process]) -> None:
    assert len(family) >= 3  # the command and its workers, on Linux their server, too
    ports = listening(family)
    assert [code_run_by_a_stranger(*port) for port in ports] == []
    assert ports == []


@pytest.mark.skipif(os.name != "posix", reason="Windows has no sockets in folders")
def test_the_server_of_workers_has_its_socket_in_a_folder_that_only_its_user_can_open(
    family: list[psutil.Process],
) -> None:
    places = {socket.laddr for process in family for socket in process.net_connections("unix")} - {
        "",
        None,
    }
    assert len(places) == 1
    for place in places:
        assert Path(
            place
        ).is_absolute()  # an abstract socket, which begins with @, is open to all users
        folder = Path(place).parent.stat()
        assert (stat.S_IMODE(folder.st_mode), folder.st_uid) == (0o700, os.getuid())
