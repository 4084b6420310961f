"""A proxy before an object store, failing as real ones do: 500, 503, slow, cut, lost and short."""

import http.client
import random
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import urlsplit

# cut: the connection ends before the request reaches the store; lost: the store carries out the
# request, but its answer never arrives; short: half of the answer arrives
FAULTS = ("500", "503", "slow", "cut", "lost", "short")
_CODES = {"500": "InternalError", "503": "SlowDown"}
_HOP = ("connection", "transfer-encoding", "keep-alive")


@dataclass
class Faults:
    """Rules for failing requests; `seen` counts requests by fault.

    rate  share of requests that fail at random, 0 to 1
    only  kinds of faults from which random ones are chosen
    once  by method and end of the path: the fault of the next request that has both
    """

    endpoint: str
    rate: float = 0.0
    only: tuple[str, ...] = FAULTS
    once: dict[tuple[str, str], str] = field(default_factory=dict)
    seen: Counter[str] = field(default_factory=Counter)
    dice: random.Random = field(default_factory=lambda: random.Random(0))
    lock: threading.Lock = field(default_factory=threading.Lock)

    def draw(self, method: str, path: str) -> str:
        """Return the fault for a request; empty: none."""
        with self.lock:
            fault = self.dice.choice(self.only) if self.dice.random() < self.rate else ""
            for wanted in [each for each in self.once if each[0] == method]:
                if urlsplit(path).path.endswith(wanted[1]):
                    fault = self.once.pop(wanted)
            if fault == "short" and method != "GET":
                fault = "cut"
            self.seen[fault or "none"] += 1
        return fault


@contextmanager
def before(endpoint: str) -> Iterator[Faults]:
    """Serve a proxy of a store on loopback; `Faults.endpoint` is the proxy's address."""
    faults = Faults("")
    target = urlsplit(endpoint).netloc

    class Handler(_Proxy):
        pass

    Handler.faults, Handler.target = faults, target
    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    faults.endpoint = f"http://127.0.0.1:{server.server_address[1]}"
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield faults
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


class _Proxy(BaseHTTPRequestHandler):
    faults: Faults
    target: str
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def _forward(self) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        fault = self.faults.draw(self.command, self.path)
        if fault == "cut":
            self.close_connection = True
            return
        if fault in _CODES:
            error = f"<Error><Code>{_CODES[fault]}</Code><Message>try again</Message></Error>"
            self._answer(int(fault), [], error.encode())
            return
        if fault == "slow":
            time.sleep(0.5)
        back = http.client.HTTPConnection(self.target, timeout=60)
        try:
            # The client's own Host is sent on, because the signature covers it.
            back.putrequest(self.command, self.path, skip_host=True, skip_accept_encoding=True)
            for name, value in self.headers.items():
                if name.lower() not in _HOP:
                    back.putheader(name, value)
            back.endheaders(body)
            answer = back.getresponse()
            content = answer.read()
        finally:
            back.close()
        if fault == "lost":
            self.close_connection = True
            return
        headers = [(k, v) for k, v in answer.getheaders() if k.lower() not in _HOP]
        self._answer(answer.status, headers, content, is_short=fault == "short")

    do_GET = do_HEAD = do_PUT = do_POST = do_DELETE = _forward

    def _answer(
        self, status: int, headers: list[tuple[str, str]], content: bytes, is_short: bool = False
    ) -> None:
        self.send_response_only(status)
        for name, value in headers:
            if name.lower() != "content-length" or self.command == "HEAD":
                self.send_header(name, value)
        if self.command != "HEAD":
            self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        with suppress(ConnectionError):
            if self.command != "HEAD":
                self.wfile.write(content[: len(content) // 2] if is_short else content)
        if is_short:
            self.close_connection = True

    def log_message(self, *_: object) -> None:
        pass
