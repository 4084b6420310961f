"""Attacks on the server are refused; other clients are served (support/server/attacks.py)."""

import asyncio
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from threading import Thread
from unittest.mock import patch

import pytest
from websockets.exceptions import ConnectionClosed

from stereocell.serve import limits as serve_limits
from stereocell.serve.deadline import HeadDeadline
from stereocell.serve.lifetime import Lifetime
from stereocell.serve.limits import CLIENT_CONNECTIONS, HEAD_S, REQUESTS_AT_ONCE, Clients
from stereocell.serve.server import BundleServer
from support import ctrl_c
from support.exhaustive import IS_EXHAUSTIVE
from support.server.attacks import ATTACKS, MARK, attack, attacked, is_well, write_bundle
from support.server.raw_sockets import is_answer
from support.server.timeouts import PATIENCE_S, connect

SLOW = 24 << 20  # bytes of a file: more than sockets hold


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return write_bundle(tmp_path)


@pytest.mark.slow
def test_every_attack_is_refused_and_the_server_writes_nothing(
    out: Path, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    assert any(MARK in one.sent for one in ATTACKS)
    of_each_kind = {one.name: one for one in reversed(ATTACKS)}
    attacks = ATTACKS if IS_EXHAUSTIVE else list(of_each_kind.values())[::-1]
    with attacked(out) as targets:
        answers = {(one.name, one.sent): (attack(one, targets), one.right) for one in attacks}
        assert len(answers) == len(attacks) > (200 if IS_EXHAUSTIVE else 140)
        wrong = {name: found for name, found in answers.items() if found[0] not in found[1]}
        assert wrong == {}
        time.sleep(3)  # the flood is forgiven by a request a second
        assert all(is_well(targets[name]) for name in ("plain", "few"))
    assert caplog.text == ""
    assert capfd.readouterr() == ("", "")


def test_a_bundle_of_thousands_of_files_is_opened_at_once_and_a_flood_is_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def visit() -> None:
        now = 1000.0
        monkeypatch.setattr(asyncio.get_running_loop(), "time", lambda: now)
        clients = Clients()
        assert all(clients.ask("10.0.0.1") for _ in range(REQUESTS_AT_ONCE))
        assert not clients.ask("10.0.0.1")
        assert clients.ask("10.0.0.2")  # has a share of its own
        now += 1
        assert sum(clients.ask("10.0.0.1") for _ in range(1000)) == 500

    asyncio.run(visit())
    assert REQUESTS_AT_ONCE >= 10_000


def test_connections_are_counted_by_client_and_in_all_and_forgotten(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def visit() -> None:
        clients = Clients()
        assert all(clients.enter("10.0.0.1") for _ in range(CLIENT_CONNECTIONS))
        assert not clients.enter("10.0.0.1")
        assert all(clients.enter("10.0.0.2") for _ in range(CLIENT_CONNECTIONS))
        assert not clients.enter("10.0.0.3")  # too many in all
        clients.leave("10.0.0.1")
        assert clients.enter("10.0.0.3")
        for k in range(3000):
            clients.ask(f"10.1.{k // 256}.{k % 256}")
        assert len(clients._known) <= serve_limits._KNOWN + 3
        assert not clients.enter("10.0.0.2")  # who has connections is not forgotten

    asyncio.run(visit())


@pytest.mark.slow
def test_a_viewers_pace_is_served_by_the_server_itself(out: Path) -> None:
    """Six connections, as browsers open, with forty files each."""
    # the deadline of the server itself: on a busy machine a half second passes between requests
    with attacked(out) as targets, patch.object(HeadDeadline, "head_s", HEAD_S):
        port = targets["plain"].server.port
        ask = b"GET /data.bin HTTP/1.1\r\nHost: localhost\r\nRange: bytes=0-0\r\n\r\n"
        with ExitStack() as stack:
            dial = partial(socket.create_connection, ("127.0.0.1", port), timeout=PATIENCE_S)
            streams = [stack.enter_context(dial()) for _ in range(6)]
            for _ in range(40):
                for stream in streams:
                    stream.sendall(ask)
                for stream in streams:
                    received = b""
                    while not is_answer(received):
                        received += stream.recv(4096)
                    assert received.startswith(b"HTTP/1.1 206 ")


def test_the_documented_limits_are_the_servers() -> None:
    text = (Path(__file__).parents[2] / "docs" / "server.md").read_text("utf-8")
    section = text.split("## What the server refuses")[1].split("\n## ")[0]
    for name, shown in {
        "TARGET_BYTES": "8 KiB of address",
        "HEAD_BYTES": "16 KiB of head",
        "MAX_HEADERS": "100 headers",
        "HEAD_S": "10 s for a head",
        "STALL_S": "60 s without a byte",
        "CONNECTIONS": "400 connections in all",
        "CLIENT_CONNECTIONS": "200 connections of one address",
        "CLIENT_SOCKETS": "64 websockets of one address",
        "REQUESTS_PER_S": "500 requests a second",
        "REQUESTS_AT_ONCE": "20,000 at once",
        "CONTROLS_PER_S": "20 pings or pongs a second",
        "MAX_FRAGMENTS": "64 frames of one message",
        "FRAGMENTS_S": "10 s from the first to the last",
        "STOP_S": "8 s",
    }.items():
        assert shown in " ".join(section.split()), name
        value = float(shown.split()[0].replace(",", ""))
        assert getattr(serve_limits, name) == value * (1024 if "KiB" in shown else 1), name


# --- the end


@contextmanager
def command(
    out: Path, start: Callable[[], AbstractContextManager[None]] = ctrl_c.heeded
) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """Run `stereocell serve OUT`, heeding Ctrl+C or not; give its process and port."""
    arguments = [sys.executable, "-m", "stereocell.cli", "serve", str(out), "--port", "0"]
    pipe = subprocess.PIPE
    with start():
        begun = subprocess.Popen(arguments, stdout=pipe, stderr=pipe, text=True)
    with begun as process:
        try:
            assert process.stdout is not None
            yield process, int(process.stdout.readline().split()[0].strip("/").rpartition(":")[2])
        finally:
            process.kill()


def begin_download(port: int) -> socket.socket:
    """Return a stream on which an answer of SLOW bytes has begun."""
    stream = socket.socket()
    stream.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)
    stream.settimeout(PATIENCE_S)
    stream.connect(("127.0.0.1", port))
    ask = f"GET /large.bin HTTP/1.1\r\nHost: localhost\r\nRange: bytes=0-{SLOW - 1}\r\n\r\n"
    stream.sendall(ask.encode())
    head = b""
    while b"\r\n\r\n" not in head:
        head += stream.recv(1)
    assert f"Content-Length: {SLOW}".lower() in head.decode().lower()
    return stream


def read_all(stream: socket.socket, for_s: float) -> int:
    """Return how many bytes come, read over at least a time."""
    size, start = 0, time.monotonic()
    while part := stream.recv(1 << 18):
        size += len(part)
        time.sleep(max(0, start + for_s * size / SLOW - time.monotonic()))
    return size


@pytest.mark.slow
@pytest.mark.parametrize("kind", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_lets_transfers_end_and_nothing_begin(out: Path, kind: signal.Signals) -> None:
    with (
        command(out) as (process, port),
        connect(f"ws://localhost:{port}/bricks") as client,
        begin_download(port) as stream,
    ):
        client.send('{"type": "hello", "version": 1}')
        client.recv(timeout=PATIENCE_S)
        os.kill(process.pid, kind)
        with pytest.raises(ConnectionClosed) as closed:
            client.recv(timeout=PATIENCE_S)
        assert closed.value.rcvd is not None
        assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1001, "the server ends")
        with pytest.raises(ConnectionError):
            socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S).recv(1)
        assert read_all(stream, for_s=1.5) == SLOW
        printed, faults = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, faults) == (0, "")
    assert printed == "finishing 1 transfer, at most 8 s; Ctrl+C again stops at once\n"


@pytest.mark.slow
def test_a_second_ctrl_c_stops_at_once(out: Path) -> None:
    with command(out) as (process, port), begin_download(port):
        assert process.stdout is not None
        os.kill(process.pid, signal.SIGINT)
        assert "finishing" in process.stdout.readline()
        start = time.monotonic()
        os.kill(process.pid, signal.SIGINT)
        _, faults = process.communicate(timeout=PATIENCE_S)
        assert time.monotonic() - start < 4
    assert process.returncode == 130
    assert len(faults.splitlines()) == 1


@pytest.mark.slow
def test_in_the_background_ctrl_c_is_not_its_own_and_sigterm_is(out: Path) -> None:
    with command(out, ctrl_c.ignored) as (process, port):
        for _ in range(3):
            os.kill(process.pid, signal.SIGINT)
            with begin_download(port) as stream:
                assert read_all(stream, for_s=0.1) == SLOW
        os.kill(process.pid, signal.SIGTERM)
        printed, faults = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, printed, faults) == (0, "", "")


def test_a_transfer_that_takes_too_long_is_cut_off(
    out: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(Lifetime, "stop_s", 0.3)
    server = BundleServer(out, 0, lan=False)
    thread = Thread(target=server.run)
    thread.start()
    while not server.has_started:
        time.sleep(0.01)
    size = 0
    with begin_download(server.port) as stream:
        server.stop()
        thread.join(timeout=5)
        assert not thread.is_alive()
        with suppress(ConnectionError):
            while part := stream.recv(1 << 20):
                size += len(part)
    assert size < SLOW
    assert caplog.text == ""


@pytest.mark.slow
def test_a_file_that_is_cut_while_it_is_sent_is_named_in_a_line(out: Path) -> None:
    file, size = out / "bundle" / "large.bin", 0
    whole = file.stat().st_size
    with command(out) as (process, port), begin_download(port) as stream:
        os.truncate(file, 1 << 20)
        with suppress(ConnectionError):
            while part := stream.recv(1 << 20):
                size += len(part)
        assert size < SLOW
        os.kill(process.pid, signal.SIGTERM)
        _, faults = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    os.truncate(file, whole)
    assert faults == f"{file}: the file became shorter while it was sent\n"
