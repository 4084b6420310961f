"""A service on loopback that gives recorded answers, and keeps the requests."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from json import dumps
from threading import Thread
from typing import Any


@dataclass(frozen=True)
class Answer:
    """An answer. `length` is the stated Content-Length; None: the true length."""

    body: bytes = b""
    status: int = 200
    headers: dict[str, str] = field(default_factory=dict)
    length: int | None = None


@dataclass(frozen=True)
class Asked:
    """A request that came in."""

    method: str
    path: str
    headers: dict[str, str]
    body: bytes


@dataclass
class Service:
    """Answers by path, or by path and query; 404 for others."""

    url: str = ""
    answers: dict[str, Answer] = field(default_factory=dict)
    asked: list[Asked] = field(default_factory=list)

    def json(self, path: str, value: Any, *, status: int = 200) -> None:
        """Answer a path with JSON."""
        headers = {"Content-Type": "application/json"}
        self.answers[path] = Answer(dumps(value).encode(), status, headers)

    def put(self, path: str, body: bytes = b"", **headers: str) -> None:
        """Answer a path with bytes."""
        named = {key.replace("_", "-"): value for key, value in headers.items()}
        self.answers[path] = Answer(body, headers=named)

    def redirect(self, path: str, target: str) -> None:
        """Answer a path with the address of another one."""
        self.answers[path] = Answer(b"", 302, {"Location": target})

    @property
    def paths(self) -> list[str]:
        """The requested paths, with their queries."""
        return [one.path for one in self.asked]


@contextmanager
def serving(host: str = "127.0.0.1") -> Iterator[Service]:
    """Run a service on loopback."""
    service = Service()

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        disable_nagle_algorithm = True

        def do_GET(self) -> None:
            length = int(self.headers.get("Content-Length", 0))
            asked = Asked(self.command, self.path, dict(self.headers), self.rfile.read(length))
            service.asked.append(asked)
            bare = self.path.partition("?")[0]
            answer = service.answers.get(self.path) or service.answers.get(bare)
            answer = answer or Answer(b"<html>not here</html>", 404)
            stated = len(answer.body) if answer.length is None else answer.length
            self.send_response(answer.status)
            self.send_header("Content-Length", str(stated))
            self.send_header("Connection", "close")
            for key, value in answer.headers.items():
                self.send_header(key, value)
            self.end_headers()
            with suppress(ConnectionError):
                self.wfile.write(answer.body if self.command != "HEAD" else b"")
            self.close_connection = True

        do_POST = do_HEAD = do_GET

        def log_message(self, *args: Any) -> None:
            """Tests read `asked`; nothing goes to stderr."""

    http = ThreadingHTTPServer((host, 0), Handler)
    service.url = f"http://{host}:{http.server_address[1]}"
    thread = Thread(target=http.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
    thread.start()
    try:
        yield service
    finally:
        http.shutdown()
        http.server_close()
        thread.join()
