"""Malformed frames: the server closes each connection with a reason, or ignores the frame."""

import base64
import json
import os
import random
import socket
import struct
import time
from contextlib import contextmanager, suppress

import pytest
from websockets.exceptions import ConnectionClosed

from stereocell.serve.limits import MESSAGE_BYTES
from support.exhaustive import examples
from support.server.brick_bundles import phantom, write_out
from support.server.brick_client import BrickClient, look_at
from support.server.running import serving
from support.server.timeouts import PATIENCE_S, connect

CAMERA = look_at((44, -36, 300), (44, -36, 29))
VALID = [
    {"type": "hello", "version": 1, "window": 65536},
    {"type": "open", "volumes": [{"tile": "r0_c0", "channel": "CD31", "table": "0" * 32}]},
    {"type": "have", "tree": 0, "nodes": "AQ=="},
    {
        **{"type": "view", "id": 1, "trees": [0], "pixels_per_radian": 500, "texel_px": 1},
        **{"budget": 1000},
        **CAMERA,
    },
    {"type": "cancel", "id": 3},
    {"type": "ack", "sequence": 1},
]
ODD = [
    None,
    True,
    -1,
    0,
    1.5,
    1e308,
    10**400,
    2**64,
    "",
    "x" * 1000,
    "\0",
    [],
    {},
    [[[]]],
    [1] * 99,
]
PROBE = json.dumps({"type": "open", "volumes": [{"tile": "probe", "channel": "probe"}]})
CODES = {1003, 1007, 1008, 1009}


def texts(count):
    """Return text messages: valid ones with a damaged part, and noise."""
    rng = random.Random(7)
    found = [
        "",
        " ",
        "null",
        "NaN",
        "[" * 50000,
        '{"a":' * 9000,
        "9" * 60000,
        '"\\ud800"',
        "\ufeff{}",
    ]
    found += ["x" * (MESSAGE_BYTES + 1), "\u00e9" * 40000]
    while len(found) < count:
        message = dict(rng.choice(VALID))
        kind = rng.randrange(6)
        key = rng.choice(list(message))
        if kind == 0:
            del message[key]
        elif kind == 1:
            message[key] = rng.choice(ODD)
        elif kind == 2:
            message[rng.choice(["x", "", "__proto__"])] = rng.choice(ODD)
        elif kind == 3 and isinstance(message[key], list):
            message[key] = [*message[key][:-1], rng.choice(ODD)]
        text = json.dumps(message)
        if kind == 4:
            at = rng.randrange(len(text))
            text = text[:at] + rng.choice('{}[]",:\\\0e-') + text[at + rng.randrange(3) :]
        elif kind == 5:
            text = "".join(chr(rng.choice([rng.randrange(32, 127), 0x20AC])) for _ in range(60))
        found.append(text)
    return found


def frame(opcode, payload, fin=True, mask=True, rsv=0, length=None):
    """Return a websocket frame (RFC 6455, section 5.2), right or wrong."""
    head = bytes([fin << 7 | rsv << 4 | opcode])
    n = len(payload) if length is None else length
    size = bytes([mask << 7 | n]) if n < 126 else bytes([mask << 7 | 127]) + struct.pack(">Q", n)
    key = b"\x11\x22\x33\x44" if mask else b""
    body = bytes(b ^ key[i % 4] for i, b in enumerate(payload)) if mask else payload
    return head + size + key + body


def raw_frames():
    """Return bytes after the handshake that break the websocket's own rules."""
    rng = random.Random(8)
    found = [frame(opcode, b"x") for opcode in (3, 4, 5, 6, 7, 11, 12, 13, 14, 15)]
    found += [frame(1, b"{}", rsv=rsv) for rsv in (1, 2, 4, 7)]
    found += [frame(1, b"{}", mask=False), frame(1, b"\xff\xfe"), frame(1, b"\xed\xa0\x80")]
    found += [frame(1, b"", length=n) for n in (2**63, 2**64 - 1, MESSAGE_BYTES + 1)]
    found += [frame(9, b"x" * 126), frame(9, b"x", fin=False), frame(0, b"{}")]
    found += [frame(1, b"{", fin=False) + frame(1, b"}"), frame(8, b"x"), frame(8, b"\x00\x01")]
    found += [frame(8, struct.pack(">H", 1005)), frame(8, b"\x03\xe8\xff"), frame(2, b"")]
    found += [frame(1, b"x" * 40000, fin=False) + frame(0, b"x" * 40000)]
    found += [frame(1, b"{}", length=100)]  # and then silence
    found += [rng.randbytes(rng.randrange(1, 200)) for _ in range(examples(30, 6))]
    return found


@pytest.fixture(scope="module")
def port(tmp_path_factory):
    out = write_out(tmp_path_factory.mktemp("malformed") / "out", phantom())
    with serving(out) as server:
        yield server.port


def is_well(port):
    """Return whether a client gets a whole volume."""
    client = BrickClient()
    with connect(f"ws://localhost:{port}/bricks", compression=None) as stream:

        def until(is_over):
            while not is_over():
                for answer in client.take(stream.recv(timeout=PATIENCE_S)):
                    stream.send(json.dumps(answer))

        stream.send('{"type": "hello", "version": 1}')
        stream.send('{"type": "open", "volumes": [{"tile": "r0_c0", "channel": "CD31"}]}')
        until(lambda: client.is_ready(0))
        stream.send(json.dumps(VALID[3] | {"texel_px": 0, "budget": 1 << 30}))
        until(lambda: 1 in client.done)
    return len(client.trees[0].frames) == client.trees[0].message["bricks"]


def fate(port, message, hello):
    """Return code and reason of the close that a message brings; None: the client is served."""
    with connect(f"ws://localhost:{port}/bricks", compression=None) as stream:
        try:
            if hello:
                stream.send('{"type": "hello", "version": 1}')
            stream.send(message)
            stream.send(PROBE)
            while True:
                answer = stream.recv(timeout=PATIENCE_S)
                if isinstance(answer, str) and '"tile": "probe"' in answer:
                    return None
        except ConnectionClosed as closed:
            if closed.rcvd is None:
                pytest.fail(f"no close frame after {message[:80]!r}")
            return closed.rcvd.code, closed.rcvd.reason


@pytest.mark.slow
def test_every_malformed_message_is_closed_with_a_reason_or_ignored(port, capfd, caplog):
    fates = []
    count = examples(170, 60)
    for i, text in enumerate(texts(count)):
        fates.append(fate(port, text, hello=i % 8 > 0))
    rng = random.Random(9)
    for i in range(examples(40, 8)):
        found = fate(port, rng.randbytes(rng.randrange(100)), hello=i % 4 > 0)
        assert found == (1003, "a client may send text only, not binary frames")
    closed = [found for found in fates if found is not None]
    assert len(closed) / count > 100 / 170
    for code, reason in closed:
        assert code in CODES
        assert 0 < len(reason.encode()) <= 123 or code == 1009
        assert "Traceback" not in reason
    assert is_well(port)
    assert capfd.readouterr().err == ""
    assert caplog.text == ""


def handshake():
    """Return the request by which a client opens a websocket."""
    key = base64.b64encode(os.urandom(16))
    return (
        b"GET /bricks HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " + key + b"\r\n\r\n"
    )


@contextmanager
def raw_stream(port):
    """Yield a socket after the handshake of a websocket, so that frames come next."""
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as stream:
        stream.sendall(handshake())
        answer = b""
        while b"\r\n\r\n" not in answer:
            answer += stream.recv(4096)
        assert answer.startswith(b"HTTP/1.1 101")
        yield stream


@pytest.mark.slow
def test_a_refused_client_reads_the_reason_even_if_it_goes_on_sending(port):
    with raw_stream(port) as stream:
        whole = frame(1, bytes(MESSAGE_BYTES + 1))
        for start in range(0, len(whole), 16384):
            stream.sendall(whole[start : start + 16384])
            time.sleep(0.02)  # by now the server has judged the first part
        received = b""
        while part := stream.recv(4096):
            received += part
        assert struct.unpack(">H", received[2:4]) == (1009,)


def test_every_broken_frame_ends_its_connection_alone(port, capfd, caplog):
    frames = raw_frames()
    for data in frames:
        # suppressed: it closed before all was read
        with raw_stream(port) as stream, suppress(ConnectionError):
            stream.sendall(data)
            stream.shutdown(socket.SHUT_WR)
            while stream.recv(4096):  # until the server closes, too
                pass
    hello = handshake()
    heads = [b"GET /bricks HTTP/1.1\r\n\r\n", b"\x00" * 100, hello.replace(b": 13", b": 99")]
    heads += [
        hello.replace(b"Sec-WebSocket-Key", b"X"),
        hello[:60],
        b"GET /" + b"a" * 70000,
    ]
    for head in heads:
        with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as stream:
            stream.sendall(head)
            stream.shutdown(socket.SHUT_WR)
            with suppress(ConnectionError):
                assert b"101 Switching" not in stream.recv(4096)
    assert is_well(port)
    messages = examples(170 + 40, 60 + 8)  # the examples of the previous test
    assert len(frames) + len(heads) + messages >= examples(270, 110)
    assert capfd.readouterr().err == ""
    assert caplog.text == ""


def test_clients_that_vanish_leave_nothing_behind(port, capfd, caplog):
    for wait in (0, 0.02):
        for _ in range(5):
            stream = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S)
            with connect(f"ws://localhost:{port}/bricks", sock=stream) as client:
                client.send('{"type": "hello", "version": 1}')
                client.send('{"type": "open", "volumes": [{"tile": "r0_c0", "channel": "CD31"}]}')
                while '"type": "tree"' not in str(client.recv(timeout=PATIENCE_S)):
                    pass
                client.send(json.dumps(VALID[3] | {"texel_px": 0, "budget": 1 << 30}))
                time.sleep(wait)
                stream.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                stream.close()
    assert is_well(port)
    assert capfd.readouterr().err == ""
    assert caplog.text == ""
