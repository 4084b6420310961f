"""An inbox that is served on a free port, and a client that uploads files as the page does."""

import http.client
import json
import os
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

from stereocell.inbox import builds, readers
from stereocell.inbox.choices import Choices
from stereocell.inbox.limits import InboxLimits
from stereocell.live.build_process import Build, BuildProcess, Coarse
from stereocell.read.addresses.resolved import Resolved
from stereocell.serve import inbox_server
from stereocell.serve.inbox_server import InboxServer
from stereocell.serve.server import LOCALHOST
from stereocell.storage.child_process import Child
from support.server.running import running
from support.server.timeouts import PATIENCE_S, connect
from support.small_viewer import write_small_viewer

# Small limits that tests can reach.


class NearReader:
    """Stands in for the process of a reader, whose imports would take seconds for each item."""

    def __init__(self, factory: Any) -> None:
        self._reader = factory()

    def call(self, method: str, *arguments: Any, bounds: object = None) -> Any:
        with patch.object(tempfile, "tempdir", tempfile.tempdir), patch.dict(os.environ):
            return getattr(self._reader, method)(*arguments)

    def close(self) -> None:
        pass


LIMITS = InboxLimits(bytes=50_000_000, files=300, items=40, piece=1 << 20, reserve=0)


class FakeBuilds:
    """Makes builds that compute nothing, and records their arguments."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, Choices, bool]] = []

    def __call__(
        self, source: str, found: Resolved, choices: Choices, out: Path, *, is_stranger: bool
    ) -> Build:
        self.asked.append((source, choices, is_stranger))
        return lambda _: ""


class NearBuild(BuildProcess):
    """A build without a process. It follows commands, and ends when a test calls `end`."""

    def _start(self, coarse: Coarse | None) -> None:
        self.out.mkdir(exist_ok=True)
        with (self.out / "starts").open("a") as starts:
            starts.write("*")
        if self.state.doing == "pausing":
            self._set(doing="paused")

    def _send(self, command: str) -> None:
        if command == "pause":
            threading.Timer(0.05, self._pause).start()

    def _pause(self) -> None:
        if self.state.doing == "pausing":
            self._set(doing="paused")

    def end(self, line: str = "") -> None:
        """Leave a bundle of two files, or fail with a line."""
        if line:
            self._set(doing="failed", line=line)
            return
        (self.out / "bundle").mkdir(exist_ok=True)
        for name in ("manifest.json", "index.html"):
            (self.out / "bundle" / name).write_text('"built"')
        self._set(doing="complete", share=1.0, has_bundle=True)


def end_build(server: InboxServer, item: str, line: str = "") -> None:
    """End the running build of an item, once it runs."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        build = server.inbox.find(item).build
        is_begun = build is not None and (build.out / "starts").exists()
        if is_begun and isinstance(build, NearBuild) and build.state.doing == "building":
            build.end(line)
            return
        time.sleep(0.02)
    raise AssertionError(f"{item} is not built")


@contextmanager
def serving_inbox(
    folder: Path,
    make: Any = None,
    *,
    limits: InboxLimits = LIMITS,
    lan: bool = False,
    is_near: bool = True,
) -> Iterator[InboxServer]:
    """Serve an inbox until the block ends; `folder` gets a folder of the inbox and one of its page.

    is_near  read and build in the process of the test
    """
    page = write_small_viewer(folder / "page")
    (page / "inbox.html").write_text("<!doctype html>inbox")
    box = folder / "box"
    box.mkdir(exist_ok=True)
    with patch.object(inbox_server, "viewer_dist", lambda: page):
        server = InboxServer(box, limits, make or FakeBuilds(), port=0, lan=lan)
    with ExitStack() as stack:
        # Each inbox replaces the classes that read and build. A test may serve a second inbox while
        # the first one runs.
        child, process = (NearReader, NearBuild) if is_near else (Child, BuildProcess)
        stack.enter_context(patch.object(readers, "Child", child))
        stack.enter_context(patch.object(builds, "BuildProcess", process))
        yield stack.enter_context(running(server))


class InboxClient:
    """One client. Every request has a connection of its own."""

    def __init__(self, port: int) -> None:
        self.port = port

    def ask(
        self, method: str, path: str, body: Any = None, headers: dict[str, str] | None = None
    ) -> tuple[int, Any, http.client.HTTPMessage]:
        """Return status, content and headers of an answer."""
        connection = http.client.HTTPConnection(LOCALHOST, self.port, timeout=PATIENCE_S)
        sent = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        try:
            connection.request(method, path, sent, headers or {})
            answer = connection.getresponse()
            content: Any = answer.read()
        finally:
            connection.close()
        if answer.headers.get("Content-Type") == "application/json":
            content = json.loads(content)
        return answer.status, content, answer.headers

    def announce(self, files: Sequence[tuple[str, bytes]]) -> str:
        """Announce files; return the item's ID."""
        listed = [[name, len(content)] for name, content in files]
        status, content, _ = self.ask("POST", "/items", {"files": listed})
        assert status in (200, 201), content
        return str(content["id"])

    def send(self, item: str, data: bytes, offset: int) -> int:
        """Send one piece; return how far the upload has come."""
        status, content, headers = self.ask(
            "PATCH", f"/items/{item}/bytes", data, {"Upload-Offset": str(offset)}
        )
        assert status == 204, content
        return int(headers["Upload-Offset"])

    def hand_in(self, files: Sequence[tuple[str, bytes]]) -> str:
        """Upload files in pieces; return the item's ID."""
        item, stream, offset = self.announce(files), b"".join(data for _, data in files), 0
        while offset < len(stream):
            offset = self.send(item, stream[offset : offset + LIMITS.piece], offset)
        return item

    def state(self) -> dict[str, Any]:
        """Return the state that the websocket sends first."""
        with connect(f"ws://localhost:{self.port}/events") as socket:
            found: dict[str, Any] = json.loads(socket.recv())
        return found

    def item(self, item: str) -> dict[str, Any]:
        """Return the state of an item."""
        return next(one for one in self.state()["items"] if one["id"] == item)

    def wait(self, item: str, *doings: str) -> dict[str, Any]:
        """Return the state of an item once it is in one of these states."""
        end_s = time.monotonic() + 5 * PATIENCE_S  # a build starts after all other work
        with connect(f"ws://localhost:{self.port}/events") as socket:
            while (left_s := end_s - time.monotonic()) > 0:
                items = json.loads(socket.recv(timeout=left_s))["items"]
                found: dict[str, Any] = next(one for one in items if one["id"] == item)
                if found["doing"] in doings:
                    return found
        raise AssertionError(f"{found['doing']} ({found['line']}), expected {doings}")

    def command(self, item: str, verb: str, body: Any = None) -> Any:
        """Send a command, such as a preview, a build or a pause; return the answer's content."""
        status, content, _ = self.ask("POST", f"/items/{item}/{verb}", body)
        assert status in (200, 202), content
        return content


def files_below(folder: Path, top: str = "") -> list[tuple[str, bytes]]:
    """Return the files of a folder as a browser lists them when the folder is dropped."""
    found = sorted(path for path in folder.rglob("*") if path.is_file())
    head = f"{top}/" if top else ""
    return [(f"{head}{one.relative_to(folder).as_posix()}", one.read_bytes()) for one in found]
