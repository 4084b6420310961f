"""Clients that connect and send no request, or one byte at a time, are cut off."""

import http.client
import json
import socket
import ssl
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from stereocell.serve import server as serve_module
from stereocell.serve.deadline import HeadDeadline
from stereocell.serve.lifetime import Lifetime
from stereocell.serve.limits import HEAD_S
from stereocell.serve.server import BundleServer
from support.server.running import serving
from support.server.timeouts import PATIENCE_S, connect

GET = b"GET /index.html HTTP/1.1\r\nHost: localhost\r\n"
DEADLINE_S = 0.5
Opener = Callable[[BundleServer], socket.socket]


@pytest.fixture
def out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A bundle that can be served, and short deadlines."""
    (tmp_path / "bundle").mkdir()
    (tmp_path / "bundle" / "manifest.json").write_text("{}")
    (tmp_path / "bundle" / "index.html").write_text("<!doctype html>")
    (tmp_path / "bundle" / "large.bin").write_bytes(bytes(30 << 20))
    monkeypatch.setattr(HeadDeadline, "head_s", DEADLINE_S)
    monkeypatch.setattr(serve_module, "find_addresses", lambda: ["127.0.0.1"])
    return tmp_path


def plain(server: BundleServer) -> socket.socket:
    return socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE_S)


def encrypted(server: BundleServer) -> socket.socket:
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    return context.wrap_socket(plain(server), suppress_ragged_eofs=True)


def seconds_until_closed(stream: socket.socket, drip: bytes = b"", first: bytes = b"") -> float:
    """Return the seconds from now, or from the answer to `first`, until the server closes.

    first  request that is sent and answered before the time begins; empty: none
    drip   bytes that are sent meanwhile, one every 50 ms
    """
    if first:
        stream.sendall(first)
        answer = b""
        while b"html>" not in answer and b"\r\n\r\n" not in answer:
            answer += stream.recv(4096)
        assert b" 200 " in answer or b" 403 " in answer
    start = time.perf_counter()
    stream.settimeout(0.05)
    place = 0
    while time.perf_counter() - start < 8:
        try:
            if place < len(drip):
                stream.send(drip[place : place + 1])
                place += 1
            if stream.recv(4096) == b"":
                break
        except TimeoutError:
            continue
        except (ConnectionError, ssl.SSLError):
            break
    else:
        pytest.fail("still open after 8 s")
    return time.perf_counter() - start


def live_connections(server: BundleServer) -> int:
    return len(server._server.server_state.connections)


def await_connections(server: BundleServer, count: int) -> None:
    """Wait until the server counts this many connections; it notices a close with a delay."""
    end = time.monotonic() + 10
    while live_connections(server) != count:
        assert time.monotonic() < end, f"{live_connections(server)} connections, not {count}"
        time.sleep(0.01)


@pytest.mark.parametrize("opener", [plain, encrypted])
def test_a_client_that_sends_no_whole_head_is_cut_off(out: Path, opener: Opener) -> None:
    with serving(out, lan=opener is encrypted) as server:
        for drip in (b"", GET * 40):
            with opener(server) as stream:
                assert DEADLINE_S * 0.8 < seconds_until_closed(stream, drip) < DEADLINE_S + 2
        await_connections(server, 0)


def test_after_an_answer_the_next_head_has_as_long(out: Path) -> None:
    with serving(out, lan=False) as server, plain(server) as stream:
        taken = seconds_until_closed(stream, GET * 40, GET + b"\r\n")
        assert DEADLINE_S * 0.7 < taken < DEADLINE_S + 2


def test_many_silent_clients_are_gone_and_others_are_served(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    head_s = 8 * DEADLINE_S  # so that on a busy machine the one that asks is not late itself
    monkeypatch.setattr(HeadDeadline, "head_s", head_s)
    with serving(out, lan=False) as server:
        silent = [plain(server) for _ in range(100)]
        await_connections(server, 100)
        connection = http.client.HTTPConnection("localhost", server.port, timeout=PATIENCE_S)
        for _ in range(8):  # one connection, longer than the deadline in all
            connection.request("GET", "/index.html")
            assert connection.getresponse().read() == b"<!doctype html>"
            time.sleep(head_s / 7)
        await_connections(server, 1)
        connection.close()
        for stream in silent:
            with suppress(ConnectionError):
                assert stream.recv(1) == b""
            stream.close()


def test_a_slow_answer_and_a_websocket_outlive_the_deadline(out: Path) -> None:
    with serving(out, lan=False) as server:
        with plain(server) as stream:
            stream.sendall(GET.replace(b"index.html", b"large.bin") + b"\r\n")
            stream.recv(1000)
            time.sleep(2 * DEADLINE_S)
            size = 1000
            with suppress(TimeoutError):
                stream.settimeout(3)
                while size < 30 << 20:
                    part = stream.recv(1 << 20)
                    assert part
                    size += len(part)
            assert size >= 30 << 20
        with connect(f"ws://localhost:{server.port}/bricks", compression=None) as client:
            time.sleep(2 * DEADLINE_S)
            client.send('{"type": "hello", "version": 1}')
            assert json.loads(client.recv(timeout=PATIENCE_S))["type"] == "welcome"


def test_a_handshake_that_does_not_come_is_cut_off(
    out: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    assert Lifetime.handshake_s == HEAD_S
    monkeypatch.setattr(Lifetime, "handshake_s", DEADLINE_S)
    hello = bytes.fromhex("16030100f0010000ec0303") + bytes(300)
    with serving(out, lan=True) as server:
        for drip in (b"", hello[:200]):
            with plain(server) as stream:
                assert DEADLINE_S * 0.8 < seconds_until_closed(stream, drip) < DEADLINE_S + 2
        await_connections(server, 0)
    assert caplog.text == ""
