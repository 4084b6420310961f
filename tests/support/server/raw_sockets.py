"""Send attacks to the server over raw sockets, and judge the answers."""

import base64
import os
import re
import select
import socket
import ssl
import struct
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from urllib.parse import urljoin, urlsplit

from stereocell.serve.server import BundleServer

SECRET = b"what lies beside the bundle"
LARGE = 256 << 20  # bytes of a sparse file, more than the buffers of sockets hold
DEADLINE_S = 2.0  # long enough for a TLS handshake on a busy machine
WAIT_S = 32.0
PROTECTION = (  # headers that every answer must have
    b"x-content-type-options: nosniff",
    b"referrer-policy: no-referrer",
    b"cross-origin-resource-policy: same-origin",
    b"cross-origin-opener-policy: same-origin",
    b"content-security-policy: ",
    b"frame-ancestors 'none'",
)


@dataclass(frozen=True)
class Target:
    """A server that is attacked."""

    server: BundleServer
    shakes_hands: bool = True  # does the TLS handshake, if the server has TLS

    def dial(self) -> socket.socket:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)  # made first, because it takes time
        context.check_hostname = False
        context.verify_mode = ssl.CERT_NONE
        stream = socket.create_connection(("127.0.0.1", self.server.port), timeout=WAIT_S)
        if self.server.gate is None or not self.shakes_hands:
            return stream
        return context.wrap_socket(stream)


@dataclass(frozen=True)
class Attack:
    """An attack on a server, and the right answers.

    sent   description of the attack
    act    attacks the server, and returns its answer
    right  the allowed answers; "closed": the connection ends without an answer
    """

    name: str
    sent: str
    act: Callable[[Target], str]
    right: tuple[str, ...]
    server: str = "plain"  # or "lan"; "few" and "few, lan" have small limits on requests


def converse(stream: socket.socket, data: bytes, is_whole: Callable[[bytes], bool]) -> bytes:
    """Send as much as the server takes; return all that it sends before it ends the connection.

    Returns early after a whole answer if nothing is left to send. Raises TimeoutError if
    the server neither answers nor ends the connection.
    """
    received, left = b"", memoryview(data)
    end = time.monotonic() + WAIT_S
    stream.setblocking(False)
    while not (left.nbytes == 0 and is_whole(received)):
        rest = end - time.monotonic()
        if rest < 0:
            raise TimeoutError(f"no end after {WAIT_S:g} s")
        pending = isinstance(stream, ssl.SSLSocket) and stream.pending()
        select.select([stream], [stream] if left else [], [], 0 if pending else min(rest, 0.25))
        try:
            with suppress(BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError):
                part = stream.recv(1 << 16)
                if not part:
                    break
                received += part
            with suppress(BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError):
                if left:
                    left = left[stream.send(left[: 1 << 16]) :]
        except (ConnectionError, ssl.SSLError):
            break
    return received


def is_answer(received: bytes) -> bool:
    """Return whether an HTTP answer on an open connection has arrived with its body."""
    head, _, body = received.partition(b"\r\n\r\n")
    fields = dict(line.lower().split(b": ", 1) for line in head.split(b"\r\n")[1:] if b": " in line)
    is_kept = fields.get(b"connection") != b"close" and b"content-length" in fields
    return is_kept and len(body) >= int(fields[b"content-length"])


def judge(received: bytes) -> str:
    """Return the status of the last answer, or a description of a fault in one of the answers."""
    if not received:
        return "closed"
    if SECRET in received:
        return "the answer shows a file outside of the bundle"
    statuses = []
    for answer in received.split(b"HTTP/1.1 ")[1:]:
        head = answer.partition(b"\r\n\r\n")[0].lower()
        statuses.append(head[:3].decode())
        missing = [one.decode() for one in PROTECTION if one not in head]
        if missing:
            return f"{statuses[-1]} without {missing[0]}"
        if b"\r\nserver:" in head or b"uvicorn" in head:
            return f"{statuses[-1]} with a banner"
    return statuses[-1] if statuses else f"{received[:20]!r}"


def get(path: str, *headers: str, method: str = "GET", host: str = "localhost") -> bytes:
    lines = [f"{method} {path} HTTP/1.1", f"Host: {host}", *headers, "Connection: close"]
    return "\r\n".join([*lines, "", ""]).encode("latin-1")


def raw(data: bytes, count: int = 1) -> Callable[[Target], str]:
    """Return an attack that sends bytes; more answers than `count` are a fault."""

    def act(target: Target) -> str:
        with target.dial() as stream:
            filled = data.replace(b"{port}", str(target.server.port).encode())
            if target.server.gate is not None:
                filled = filled.replace(b"{token}", target.server.gate.token.encode())
            received = converse(stream, filled, is_answer)
        if received.count(b"HTTP/1.1 ") > count:
            return f"{received.count(b'HTTP/1.1 ')} answers to {count} request"
        return judge(received)

    return act


def bare(data: bytes) -> Callable[[Target], str]:
    """Return an attack whose answer must be a head without a body, as for HEAD requests."""

    def act(target: Target) -> str:
        with target.dial() as stream:
            received = converse(stream, data, lambda received: False)
        _, _, body = received.partition(b"\r\n\r\n")
        return f"a body of {len(body)} bytes" if body else judge(received)

    return act


def landing(path: str) -> Callable[[Target], str]:
    """Return an attack that follows a redirect as browsers do; "own" if it stays on the server."""

    def act(target: Target) -> str:
        assert target.server.gate is not None
        head = get(path.replace("{token}", target.server.gate.token))
        with target.dial() as stream:
            received = converse(stream, head, is_answer)
        if (status := judge(received)) != "303":
            return status
        place = re.search(rb"^location: (.*)\r$", received, re.IGNORECASE | re.MULTILINE)
        assert place is not None
        shown = re.sub(r"[\t\r\n]", "", place[1].decode()).replace("\\", "/")
        base = urlsplit(target.server.address)
        whole = urlsplit(urljoin(target.server.address, shown))
        is_own = (whole.scheme, whole.netloc) == (base.scheme, base.netloc)
        # A page may take the path out of the address and resolve it again.
        again = urljoin(target.server.address, whole.path)
        return "own" if is_own and urlsplit(again).netloc == base.netloc else shown

    return act


def slowly(first: bytes, drip: bytes) -> Callable[[Target], str]:
    """Return an attack that sends a byte every 50 ms."""

    def act(target: Target) -> str:
        with target.dial() as stream:
            received = converse(stream, first, is_answer) if first else b""
            stream.settimeout(0.05)
            end = time.monotonic() + WAIT_S
            for place in range(len(drip)):
                try:
                    stream.send(drip[place : place + 1])
                    if not (part := stream.recv(1000)):
                        return "closed" if time.monotonic() < end else "still open"
                    received += part
                except TimeoutError:
                    continue
                except ConnectionError:
                    return "closed"
        return "still open"

    return act


def never_reading(target: Target) -> str:
    with target.dial() as stream:
        stream.sendall(get("/large.bin"))
        time.sleep(4 * DEADLINE_S)
        size = 0
        with suppress(ConnectionError, TimeoutError):
            while part := stream.recv(1 << 20):
                size += len(part)
        return "closed" if size < LARGE else "all of it, late"


def crowd(target: Target) -> str:
    """Open more connections than a client may have; the server refuses the next one."""
    streams = [target.dial() for _ in range(20)]
    try:
        time.sleep(0.1)
        return raw(get("/"))(target)
    finally:
        for stream in streams:
            stream.close()
        time.sleep(0.1)


def without_tls(act: Callable[[Target], str]) -> Callable[[Target], str]:
    """Return an attack that does not shake hands."""
    return lambda target: act(replace(target, shakes_hands=False))


def silent_crowd(target: Target) -> str:
    """Open more connections than a client may have, send nothing; the server cuts the next one."""
    streams = [replace(target, shakes_hands=False).dial() for _ in range(20)]
    try:
        time.sleep(0.05)
        return raw(get("/"))(target)
    except (ConnectionError, ssl.SSLError):
        return "closed"
    finally:
        for stream in streams:
            stream.close()
        time.sleep(0.1)


def flood(target: Target) -> str:
    """Send more requests than a client may, on connections that stay open."""
    for _ in range(80):
        found = raw(get("/manifest.json"))(target)
        if found != "200":
            return found
    return found


def frame(
    opcode: int, payload: bytes = b"", fin: int = 1, mask: int = 1, rsv: int = 0, length: int = -1
) -> bytes:
    """Return a frame (RFC 6455, section 5.2), masked with 0; it may be valid or faulty."""
    size = len(payload) if length < 0 else length
    head = struct.pack(">BBQ", fin << 7 | rsv << 4 | opcode, mask << 7 | 127, size)
    if size < 126:
        head = struct.pack(">BB", fin << 7 | rsv << 4 | opcode, mask << 7 | size)
    return head + bytes(4 * mask) + payload


def handshake(*headers: str, path: str = "/bricks", host: str = "localhost:{port}") -> bytes:
    key = base64.b64encode(os.urandom(16)).decode()
    lines = ["Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13"]
    lines = [f"GET {path} HTTP/1.1", f"Host: {host}", *lines, f"Sec-WebSocket-Key: {key}"]
    return "\r\n".join([*lines, *headers, "", ""]).encode()


GOODBYE = frame(8, struct.pack(">H", 1000))
HELLO = frame(1, b'{"type": "hello", "version": 1}')


def open_socket(target: Target) -> tuple[socket.socket, bytes]:
    """Return a stream with an open websocket, and the bytes that followed the handshake."""
    stream = target.dial()
    stream.sendall(handshake().replace(b"{port}", str(target.server.port).encode()))
    received = b""
    while b"\r\n\r\n" not in received:
        received += stream.recv(4096)
    head, _, rest = received.partition(b"\r\n\r\n")
    found = judge(head)
    if found != "101":
        raise ValueError(found)
    return stream, rest


def closing(received: bytes) -> str:
    """Return the code of the close frame among the server's frames."""
    while len(received) >= 2:
        size, at = received[1] & 127, 2
        if size == 126:
            size, at = int.from_bytes(received[2:4], "big"), 4
        payload, received, opcode = (
            received[at : at + size],
            received[at + size :],
            received[0] & 15,
        )
        if opcode == 8:
            return str(int.from_bytes(payload[:2], "big"))
    return "closed"


def framed(*frames: bytes) -> Callable[[Target], str]:
    """Return an attack that opens a websocket and sends frames."""

    def act(target: Target) -> str:
        stream, first = open_socket(target)
        with stream:
            rest = converse(
                stream, b"".join(frames), lambda received: closing(first + received) != "closed"
            )
        return closing(first + rest)

    return act


def socket_crowd(target: Target) -> str:
    opened = [open_socket(target)[0] for _ in range(4)]
    try:
        return framed()(target)
    finally:
        for stream in opened:
            stream.close()


def used_token(target: Target) -> str:
    assert target.server.gate is not None
    path = f"/?token={target.server.gate.token}"
    if (first := raw(get(path))(target)) != "303":
        return f"first {first}"
    return raw(get(path))(target)
