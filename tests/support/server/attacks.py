"""Attacks on the server by raw sockets, and the expected answers.

    PYTHONPATH=tests .venv/bin/python -m support.server.attacks

serves a made-up bundle, runs all attacks, and prints a Markdown table of requests and answers. It
exits with 1 if an attack got a wrong answer, or the server wrote a line or no longer serves.

Time limits are short here (DEADLINES), and attacks on limits by number meet small limits (FEW).
serve/test_attacks.py tests that the usual limits are those of docs/server.md.
"""

import logging
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import Thread
from unittest.mock import patch

from stereocell.serve import brick_session, websocket_protocol
from stereocell.serve import limits as serve_limits
from stereocell.serve import server as serve_module
from stereocell.serve.deadline import HeadDeadline
from stereocell.serve.http_protocol import GuardedHttp
from stereocell.serve.lifetime import Lifetime
from stereocell.serve.limits import (
    HEAD_BYTES,
    MAX_HEADERS,
    MESSAGE_BYTES,
    TARGET_BYTES,
)
from stereocell.serve.server import BundleServer
from support import plain_bundle
from support.server.raw_sockets import (
    DEADLINE_S,
    GOODBYE,
    HELLO,
    LARGE,
    SECRET,
    Attack,
    Target,
    bare,
    crowd,
    flood,
    frame,
    framed,
    get,
    handshake,
    landing,
    never_reading,
    raw,
    silent_crowd,
    slowly,
    socket_crowd,
    used_token,
    without_tls,
)  # fmt: skip

MARK = "PATIENT-NAME"  # part of requests; the server must not write it anywhere
DEADLINES = [
    (HeadDeadline, "head_s", DEADLINE_S),
    (GuardedHttp, "stall_s", DEADLINE_S),
    (Lifetime, "handshake_s", DEADLINE_S),
    (websocket_protocol, "FRAGMENTS_S", DEADLINE_S),
    (brick_session, "HELLO_S", 4 * DEADLINE_S),
    (serve_module, "find_addresses", lambda: ["127.0.0.1"]),
    (BundleServer, "invite", lambda _: None),
]
FEW = [
    (serve_limits, "CLIENT_CONNECTIONS", 20),
    (serve_limits, "REQUESTS_AT_ONCE", 60),
    (serve_limits, "REQUESTS_PER_S", 1),
    (brick_session, "CLIENT_SOCKETS", 4),
]

# --- the list

CHUNKED = "Transfer-Encoding: chunked"
FEW_LAN = "few, lan"
WHOLE = ("200",)  # RFC 9110, section 14.2: a Range that makes no sense is ignored
ABSENT = ("404",)
FOREIGN = ("403",)
CUT = ("closed",)
SMUGGLED = b"GET /manifest.json HTTP/1.1\r\nHost: localhost\r\n\r\n"


def _paths() -> Iterator[Attack]:
    for name, path in {
        "dots": "/../secret.txt",
        "dots, encoded": "/%2e%2e/secret.txt",
        "dots and slash, encoded": "/%2e%2e%2fsecret.txt",
        "dots, encoded twice": "/%252e%252e/secret.txt",
        "dots in overlong UTF-8": "/%c0%ae%c0%ae/secret.txt",
        "dots behind a folder": "/channels/../../secret.txt",
        "backslashes": "/..\\secret.txt",
        "backslashes, encoded": "/%2e%2e%5csecret.txt",
        "absolute": "//etc/passwd",
        "absolute, encoded": "/%2fetc%2fpasswd",
        "a drive": "/C:/windows/win.ini",
        "NUL": "/manifest.json%00.png",
        "no UTF-8": "/%ff%fe",
        "surrogates": "/%ed%a0%80",
        "a name of 1000 bytes": "/" + "a" * 1000,
        "3000 folders": "/" + "a/" * 3000,
        "a link to a file outside": "/link.txt",
        "a link to a folder outside": "/folder/secret.txt",
        "a link to itself": "/ring",
        "a folder without an index": "/channels/",
        "a patient's name": f"/{MARK}.ktx2?token={MARK}",
    }.items():
        shown = path if len(path) < 60 else f"{path[:20]}... ({len(path):,} bytes)"
        yield Attack(f"path: {name}", f"`GET {shown}`", raw(get(path)), ABSENT)
    long = "/" + "a" * TARGET_BYTES
    yield Attack("path: too long", f"{len(long):,} bytes", raw(get(long)), ("414",))
    huge = b"GET /" + b"a" * (10 << 20)
    yield Attack("path: huge", "10 MB without an end", raw(huge), ("414",))
    yield Attack(
        "path: absolute form", "`GET http://localhost/`", raw(get("http://localhost/")), ("400",)
    )
    yield Attack("path: none", "`GET *`", raw(get("*")), ("400",))


def _origins() -> Iterator[Attack]:
    for host in ("evil.example", "localhost.evil.example", "127.0.0.1.nip.example:80", "[::1]", ""):
        yield Attack("DNS rebinding", f"`Host: {host}`", raw(get("/", host=host)), FOREIGN)
        shook = handshake(host=host)
        yield Attack("DNS rebinding, websocket", f"`Host: {host}`", raw(shook), FOREIGN)
    two = get("/", "Host: evil.example")
    yield Attack("two hosts", "`Host: localhost`, `Host: evil.example`", raw(two), ("400",))
    yield Attack("no host", "HTTP/1.1 without", raw(b"GET / HTTP/1.1\r\n\r\n"), ("400",))
    yield Attack("no host", "HTTP/1.0 without", raw(b"GET / HTTP/1.0\r\n\r\n"), FOREIGN)
    for origin in ("https://evil.example", "null", "http://localhost:1", "http://[", "file://"):
        line = f"Origin: {origin}"
        yield Attack("foreign origin, fetch", f"`{line}`", raw(get("/", line)), FOREIGN)
        yield Attack("foreign origin, websocket", f"`{line}`", raw(handshake(line)), FOREIGN)
    for site, mode, dest in (
        ("cross-site", "no-cors", "image"),
        ("same-site", "no-cors", "script"),
        ("cross-site", "navigate", "iframe"),
    ):
        lines = [f"Sec-Fetch-Site: {site}", f"Sec-Fetch-Mode: {mode}", f"Sec-Fetch-Dest: {dest}"]
        yield Attack("a foreign page's request", f"{site} {dest}", raw(get("/", *lines)), FOREIGN)


def _ranges() -> Iterator[Attack]:
    for name, value, right in (
        ("negative", "bytes=-5--1", WHOLE),
        ("reversed", "bytes=9-1", WHOLE),
        ("of another unit", "pages=1-2", WHOLE),
        ("many", "bytes=" + ",".join(f"{k}-{k + 1}" for k in range(1000)), WHOLE),
        ("overlapping", "bytes=0-,0-,0-,0-,0-", WHOLE),
        ("too large numbers", "bytes=0-" + "9" * 5000, WHOLE),
        ("of 2^64", f"bytes={2**64}-", WHOLE),
        ("of other digits", "bytes=\xb2-\xb3", WHOLE),
        ("behind the end", "bytes=100000-200000", ("416",)),
        ("nothing", "bytes=-0", ("416",)),
    ):
        shown = value if len(value) < 40 else f"{value[:20]}... ({len(value):,} bytes)"
        act = raw(get("/data.bin", f"Range: {value}"))
        yield Attack(f"range: {name}", f"`{shown}`", act, right)


def _requests() -> Iterator[Attack]:
    for method in (
        "POST",
        "PUT",
        "DELETE",
        "OPTIONS",
        "TRACE",
        "PATCH",
        "PROPFIND",
        "get",
        "X" * 99,
    ):
        sent = f"`{method[:9]} /manifest.json`"
        yield Attack("method", sent, raw(get("/manifest.json", method=method)), ("405",))
    tunnel = get("a.example:443", method="CONNECT")
    yield Attack("method", "`CONNECT a.example:443`", raw(tunnel), ("400",))
    yield Attack("method", "`CONNECT /`", raw(get("/", method="CONNECT")), ("405",))
    yield Attack("method", "`OPTIONS *`", raw(get("*", method="OPTIONS")), ("400",))
    yield Attack("HTTP/0.9", "`GET /`", raw(b"GET /\r\n\r\n"), ("400",))
    yield Attack("HTTP/9.9", "", raw(b"GET / HTTP/9.9\r\nHost: localhost\r\n\r\n"), ("505",))
    prelude = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
    yield Attack("HTTP/2 at once", "its prelude", raw(prelude), ("505",))
    yield Attack("no HTTP", "zeros", raw(bytes(1000) + b"\r\n\r\n"), ("400",))
    yield Attack("no HTTP", "a TLS hello", raw(bytes.fromhex("16030100f001") + bytes(99)), ("400",))
    lines = [f"X-{k}: {MARK}" for k in range(MAX_HEADERS + 1)]
    yield Attack("headers: too many", f"{len(lines)}", raw(get("/", *lines)), ("431",))
    lines = [f"X-{k}: " + "a" * 1000 for k in range(HEAD_BYTES // 1000 + 1)]
    yield Attack("headers: too long", f"{HEAD_BYTES:,} bytes", raw(get("/", *lines)), ("431",))
    data = b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"a" * (10 << 20)
    yield Attack("headers: one without an end", "10 MB", raw(data), ("431",))
    data = b"GET / HTTP/1.1\r\nHost: localhost\r\n" + b"X: a\r\n" * (10 << 17)
    yield Attack("headers: without an end", f"{len(data) >> 20} MB", raw(data), ("431",))
    for name, line, right in (
        ("NUL", "X: a\0b", "400"),
        ("a line break", "X: a\nHost: evil.example", "400"),
        ("folded", "X: a\r\n\tHost: evil.example", "200"),  # RFC 9112, section 5.2: a space
        ("a space before the colon", "Content-Length : 5", "400"),
    ):
        yield Attack(f"headers: {name}", f"`{line!r}`", raw(get("/", line)), (right,))


def _heads() -> Iterator[Attack]:
    """Yield HEAD requests. The answer has no body, whichever part of the server refuses them."""
    upgrade = ("Upgrade: websocket", "Connection: Upgrade")
    many = [f"X-{k}: a" for k in range(MAX_HEADERS + 1)]
    for name, sent, right in (
        ("of everything", get("*", method="HEAD"), "400"),
        ("of no path", get("?token=x", method="HEAD"), "400"),
        ("in absolute form", get("http://localhost/", method="HEAD"), "400"),
        ("of a host", get("evil.example:443", method="HEAD"), "400"),
        ("too long a target", get("/" + "a" * TARGET_BYTES, method="HEAD"), "414"),
        ("a huge target", b"HEAD /" + b"a" * (1 << 20), "414"),
        ("too many headers", get("/", *many, method="HEAD"), "431"),
        ("too long headers", get("/", "X: " + "a" * HEAD_BYTES, method="HEAD"), "431"),
        ("a body", get("/", "Content-Length: 3", method="HEAD") + b"abc", "413"),
        ("a websocket", get("/bricks", *upgrade, method="HEAD"), "405"),
        ("two hosts", get("/", "Host: localhost", method="HEAD"), "400"),
        ("HTTP/9.9", b"HEAD / HTTP/9.9\r\nHost: localhost\r\n\r\n", "505"),
    ):
        for server in ("plain", "lan"):
            yield Attack(f"HEAD: {name}", server, bare(sent), (right,), server)
    evil = get("/", method="HEAD", host="evil.example")
    yield Attack("HEAD: another host", "plain", bare(evil), FOREIGN)
    yield Attack("HEAD: another host", "lan", bare(evil), FOREIGN, "lan")
    yield Attack("HEAD: no file", "plain", bare(get("/a", method="HEAD")), ABSENT)
    yield Attack("HEAD: no session", "lan", bare(get("/a", method="HEAD")), FOREIGN, "lan")


def _redirects() -> Iterator[Attack]:
    """Yield paths whose redirect must stay on the server, and paths that must get none."""
    for path in (
        "//evil.example/",
        "///evil.example/",
        "////evil.example",
        "/\\evil.example/",
        "/\\/evil.example/",
        "//evil.example\\@localhost/",
        "/%2fevil.example/",
        "/%2f%2fevil.example/",
        "/%5cevil.example/",
        "/%5c%5cevil.example/",
        "/%09/evil.example/",
        "/%0d%0aLocation:%20https://evil.example/",
        "/.//evil.example/",
        "/..//evil.example/",
        "/a/..//evil.example/",
        "/%2e/%2fevil.example/",
        "/https://evil.example/",
        "/javascript:alert(1)",
        "/@evil.example/",
    ):
        act = landing(path + "?token={token}")
        yield Attack("LAN, redirect", f"`GET {path}?token=...`", act, ("own",), "lan")
    for path in ("?token={token}", "https://evil.example/?token={token}"):
        yield Attack("LAN, redirect", f"`GET {path}`", landing(path), ("400",), "lan")
    for path in ("/%0a/", "//evil.example/%0a/", "/%0a"):
        yield Attack("path: a line break", f"`GET {path}`", raw(get(path)), ABSENT)


def _smuggling() -> Iterator[Attack]:
    for name, lines, body, right in (
        ("both lengths", ["Content-Length: 4", CHUNKED], b"0\r\n\r\n", "400"),
        ("two lengths", ["Content-Length: 0", f"Content-Length: {len(SMUGGLED)}"], b"", "400"),
        ("a list of lengths", ["Content-Length: 0, 5"], b"", "400"),
        ("a length with a sign", ["Content-Length: +0"], b"", "400"),
        ("a negative length", ["Content-Length: -1"], b"", "400"),
        ("a length of 5000 digits", ["Content-Length: " + "9" * 5000], b"", "400"),
        ("a body", [f"Content-Length: {len(SMUGGLED)}"], b"", "413"),
        ("chunks", [CHUNKED], b"0\r\n\r\n", "413"),
        ("a bad chunk", [CHUNKED], b"zz\r\n", "413"),
        ("a chunk of 2^64", [CHUNKED], b"10000000000000000\r\n", "413"),
        ("an unknown coding", ["Transfer-Encoding: xchunked"], b"0\r\n\r\n", "501"),
        ("chunks twice", [CHUNKED, CHUNKED], b"0\r\n\r\n", "501"),
        ("a body after 100", ["Content-Length: 9", "Expect: 100-continue"], b"", "413"),
    ):
        head = get("/", *lines).replace(b"\r\nConnection: close", b"")
        sent = ", ".join(f"`{line[:30]}`" for line in lines)
        yield Attack(f"smuggling: {name}", sent, raw(head + body + SMUGGLED), (right,))
    head = get("/", "Content-Length: 104857600", method="POST")
    yield Attack("a body of 100 MB", "10 MB of it", raw(head + bytes(10 << 20)), ("413",))


def _slow() -> Iterator[Attack]:
    head = b"GET / HTTP/1.1\r\nHost: localhost\r\n" + b"X: a\r\n" * 40
    keep = b"GET /manifest.json HTTP/1.1\r\nHost: localhost\r\n\r\n"
    yield Attack("slow-loris: head", "a byte every 50 ms", slowly(b"", head), CUT)
    yield Attack("slow-loris: second head", "a byte every 50 ms", slowly(keep, head), CUT)
    body = get("/", "Content-Length: 1000", method="POST")
    yield Attack("slow-loris: body", "a byte every 50 ms", slowly(body, bytes(200)), CUT)
    yield Attack("silence", "nothing", raw(b""), CUT)
    yield Attack("an answer that is not read", f"{LARGE >> 20} MB asked for", never_reading, CUT)


def _sockets() -> Iterator[Attack]:
    shook = handshake().replace(b": 13", b": 99")
    yield Attack("websocket: version", "99", raw(shook), ("400",))
    shook = handshake().replace(b"Sec-WebSocket-Key", b"X")
    yield Attack("websocket: no key", "", raw(shook), ("400",))
    shook = handshake().replace(b"GET", b"POST")
    yield Attack("websocket: by POST", "", raw(shook), ("405",))
    yield Attack("websocket: elsewhere", "`/a`", raw(handshake(path="/a")), FOREIGN)
    shook = handshake("X: " + "a" * 9000)
    yield Attack("websocket: long header", "9,000 bytes", raw(shook), ("431",))
    for name, frames, right in (
        ("too long", [frame(1, bytes(MESSAGE_BYTES + 1))], "1009"),
        ("of 2^62 bytes", [frame(1, length=2**62)], "1009"),
        ("of 2^64 - 1 bytes", [frame(1, length=2**64 - 1)], "1002 1009"),
        ("not masked", [frame(1, b"{}", mask=0)], "1002"),
        ("of an unknown kind", [frame(3)], "1002"),
        ("with reserved bits", [frame(1, b"{}", rsv=4)], "1002"),
        ("no UTF-8", [frame(1, b"\xff\xfe")], "1007"),
        ("surrogates", [frame(1, b"\xed\xa0\x80")], "1007"),
        ("binary", [HELLO, frame(2, b"x")], "1003"),
        ("no JSON", [HELLO, frame(1, MARK.encode())], "1007"),
        ("JSON nested 10,000 deep", [HELLO, frame(1, b"[" * 10000)], "1007"),
        ("a number of 5000 digits", [HELLO, frame(1, b'{"type":' + b"9" * 5000)], "1007"),
        ("not as the schema asks", [HELLO, frame(1, b'{"type": "view"}')], "1007"),
        ("a path for a tree", [HELLO, frame(1, b'{"type": "have", "tree": -1}')], "1007"),
        ("before hello", [frame(1, b'{"type": "cancel", "id": 1}')], "1008"),
        ("a long ping", [frame(9, bytes(126))], "1002"),
        ("a ping in two", [frame(9, b"x", fin=0)], "1002"),
        ("no beginning", [frame(0, b"x")], "1002"),
        ("a beginning in a beginning", [frame(1, b"x", fin=0), frame(1, b"x")], "1002"),
        ("a bad end", [frame(8, b"\x00")], "1002"),
        ("fragments without end", [frame(1, fin=0)] + [frame(0, fin=0)] * 9999, "1008"),
        (
            "fragments, too long",
            [frame(1, bytes(9999), fin=0)] + [frame(0, bytes(9999), 0)] * 9,
            "1009",
        ),
        ("a fragment, then silence", [frame(1, b"{", fin=0)], "1008"),
        ("half a frame, then silence", [frame(1, b"{", length=100)], "1008"),
        ("silence", [], "1008"),
        ("a flood of pings", [HELLO] + [frame(9, bytes(100))] * 20000, "1008 closed"),
        ("a flood of pongs", [HELLO] + [frame(10)] * 20000, "1008 closed"),
        (
            "a flood of messages",
            [HELLO] + [frame(1, b'{"type": "cancel", "id": 1}')] * 999,
            "1008 closed",
        ),
        ("a flood of acks", [HELLO] + [frame(1, b'{"type": "ack", "sequence": 1}')] * 9, "1008"),
    ):
        sent = f"{sum(map(len, frames)):,} bytes of frames"
        yield Attack(f"websocket: {name}", sent, framed(*frames), tuple(right.split()))


def _limits() -> Iterator[Attack]:
    """Yield attacks that use up a client's share; the flood of requests comes last."""
    yield Attack("a crowd of connections", "20 are allowed here", crowd, ("503", "closed"), "few")
    yield Attack("a crowd of websockets", "4 are allowed here", socket_crowd, ("1013",), "few")
    yield Attack("a flood of requests", "60 are allowed here", flood, ("429",), "few")


def _strangers() -> Iterator[Attack]:
    for name, path, lines in (
        ("none", "/", []),
        ("empty", "/?token=", []),
        ("wrong", "/?token=" + "A" * 43, []),
        ("of another alphabet", "/?token=%ff%00", []),
        ("a thousand", "/?" + "token=a&" * 900, []),
        ("wrong cookie", "/", [f"Cookie: __Host-stereocell={MARK}"]),
        ("broken cookie", "/", ["Cookie: =;=\xff;__Host-stereocell"]),
        ("as a cookie", "/", ["Cookie: __Host-stereocell={token}"]),
        ("as a password", "/", ["Authorization: Bearer {token}"]),
    ):
        act = raw(get(path, *lines))
        yield Attack(f"LAN, token: {name}", f"`GET {path[:30]}`", act, FOREIGN, "lan")
    peek = raw(get("/?token={token}", method="HEAD"))
    yield Attack("LAN, token: by a preview", "`HEAD /?token=...`", peek, FOREIGN, "lan")
    evil = raw(get("/?token={token}", host="evil.example"))
    yield Attack("LAN, token: for another host", "", evil, FOREIGN, "lan")
    yield Attack("LAN, token: used", "the second time", used_token, FOREIGN, "lan")
    yield Attack("LAN, websocket: no session", "", raw(handshake()), FOREIGN, "lan")
    shook = handshake(path="/bricks?token={token}")
    yield Attack("LAN, websocket: a token", "", raw(shook), FOREIGN, "lan")
    yield Attack(
        "LAN, path: outside", "`/../secret.txt`", raw(get("/../secret.txt")), FOREIGN, "lan"
    )
    data = b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"a" * (1 << 20)
    yield Attack("LAN, headers: too long", "1 MB", raw(data), ("431", "closed"), "lan")
    plain = without_tls(raw(get("/")))
    yield Attack("LAN, without TLS", "`GET /`", plain, CUT, "lan")
    yield Attack("LAN, silence", "no handshake", without_tls(raw(b"")), CUT, "lan")
    hello = b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(500)
    drip = without_tls(slowly(b"", hello))
    yield Attack("LAN, slow-loris: handshake", "a byte every 50 ms", drip, CUT, "lan")
    yield Attack(
        "LAN, a crowd that keeps silent", "20 are allowed here", silent_crowd, CUT, FEW_LAN
    )


ATTACKS: tuple[Attack, ...] = (
    *_paths(),
    *_origins(),
    *_ranges(),
    *_requests(),
    *_heads(),
    *_redirects(),
    *_smuggling(),
    *_slow(),
    *_sockets(),
    *_limits(),
    *_strangers(),
)


# --- a server to attack


def write_bundle(out: Path) -> Path:
    """Write the served files of a bundle, with links that lead out of it; return its OUT."""
    bundle = out / "bundle"
    (bundle / "channels").mkdir(parents=True)
    plain_bundle.write(out, {"index.html": b"<!doctype html>"})
    (bundle / "data.bin").write_bytes(bytes(4096))
    with (bundle / "large.bin").open("wb") as file:
        file.truncate(LARGE)
    (out / "secret.txt").write_bytes(SECRET)
    (bundle / "link.txt").symlink_to(out / "secret.txt")
    (bundle / "folder").symlink_to(out)
    (bundle / "ring").symlink_to(bundle / "ring")
    return out


@contextmanager
def attacked(out: Path) -> Iterator[dict[str, Target]]:
    """Serve an OUT by servers with short deadlines, and "few" with small limits as well."""
    patches = [patch.object(*one) for one in DEADLINES]
    servers: dict[str, BundleServer] = {}
    threads = []
    for one in patches:
        one.start()
    try:
        for name in ("plain", "lan", "few", FEW_LAN):
            servers[name] = BundleServer(out, 0, lan="lan" in name)
            threads.append(Thread(target=servers[name].run))
            threads[-1].start()
        while not all(server.has_started for server in servers.values()):
            time.sleep(0.01)
        yield {name: Target(server) for name, server in servers.items()}
    finally:
        for server in servers.values():
            server.stop()
        for thread in threads:
            thread.join()
        for one in patches:
            one.stop()


def attack(one: Attack, targets: dict[str, Target]) -> str:
    """Return the answer to an attack."""
    patches = [patch.object(*few) for few in FEW] if "few" in one.server else []
    for limit in patches:
        limit.start()
    try:
        return one.act(targets[one.server])
    except (TimeoutError, ValueError) as error:
        return str(error)
    finally:
        for limit in patches:
            limit.stop()


def is_well(target: Target) -> bool:
    """Return whether an honest client is served."""
    return raw(get("/data.bin"))(target) == "200" and framed(HELLO, GOODBYE)(target) == "1000"


class Written(logging.Handler):
    """Collects the lines that the server logs."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(self.format(record))


def main(names: Sequence[str] = ()) -> int:
    """Run attacks whose name begins with one of `names`, or all; print the table."""
    written = Written()
    logging.getLogger().addHandler(written)
    wanted = [one for one in ATTACKS if not names or one.name.startswith(tuple(names))]
    wrong = 0
    print("| attack | sent | answer | |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder, attacked(write_bundle(Path(folder))) as targets:
        for one in wanted:
            found = attack(one, targets)
            is_right = found in one.right
            wrong += not is_right
            verdict = {"200": "ignored", "own": "led here"}.get(found, "refused")
            if not is_right:
                verdict = f"**WRONG**, expected {' or '.join(one.right)}"
            sent = one.sent.replace("|", "\\|")
            print(f"| {one.name} | {sent} | {found} | {verdict} |", flush=True)
        is_served = is_well(targets["plain"])
    print(f"\n{len(wanted)} attacks, {wrong} with a wrong answer; the server wrote ", end="")
    print(f"{len(written.lines)} lines and {'serves on' if is_served else 'serves NO MORE'}")
    print("\n".join(written.lines), file=sys.stderr)
    return 1 if wrong or written.lines or not is_served else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
