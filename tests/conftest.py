"""Fixtures that several test modules share: tiny sources on disk, and servers on loopback."""

import gc
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

import numpy as np
import pytest
from numpy.typing import NDArray

from support import phantoms
from support.exhaustive import IS_EXHAUSTIVE
from support.long_files import LONG_FILES
from support.object_store import VERSITYGW
from support.small_viewer import write_small_viewer

# While modules and tests are loaded, Python's garbage collector finds nothing but takes a third of
# the time. `pytest_collection_finish` turns it on and excludes the loaded objects.
gc.disable()

pytest_plugins = ["support.message_catalogue"]

CHANNELS = [{"label": "Hoechst", "color": "0000FF"}, {"label": "CD31", "color": "00FF80"}]


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave sweeps to `make test-exhaustive`, and run long files first.

    Each process runs whole files in this order. A long file at the end would run alone.
    """
    if not IS_EXHAUSTIVE:
        of_sweeps = {item: item.get_closest_marker("exhaustive") is not None for item in items}
        config.hook.pytest_deselected(items=[item for item in items if of_sweeps[item]])
        items[:] = [item for item in items if not of_sweeps[item]]
    slow = Counter(item.path for item in items if item.get_closest_marker("slow"))
    slow.update(LONG_FILES)
    items.sort(key=lambda item: -slow[item.path])  # a stable sort keeps a file's tests together


def pytest_collection_finish() -> None:
    """Start Python's garbage collector, without the objects that have been loaded."""
    gc.enable()
    gc.freeze()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print which tests ran and which did not, because `-q` hides the header."""
    store = "moto" if VERSITYGW is None else "versitygw"
    terminalreporter.write_line(f"object store of the tests: {store}")
    reasons = Counter(
        str(report.longrepr[2]).removeprefix("Skipped: ")
        for report in terminalreporter.stats.get("skipped", ())
        if isinstance(report.longrepr, tuple)
    )
    for reason, count in sorted(reasons.items()):
        terminalreporter.write_line(f"skipped {count}: {reason}")


@pytest.fixture(scope="session", autouse=True)
def quick_builds(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Spare builds in this process three costs: flushing files, copying the viewer, and workers.

    Tests spent most of their time waiting for the disk. The built viewer has 145 files that each
    bundle copies and hashes. Worker processes import everything again, so a command starts them
    only if its test passes `--workers`.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda file: None)
        if sys.modules.keys() & {"stereocell.cli.__main__", "stereocell.building.phases"}:
            folder = write_small_viewer(tmp_path_factory.mktemp("viewer"))
            patch.setattr("stereocell.building.phases.viewer_dist", lambda: folder)
            patch.setattr("stereocell.cli.flags.cores", lambda: 0)
        yield


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make builds draw no report, which would take most of the time of a small build."""
    monkeypatch.setattr("stereocell.report.phase.run_report", lambda *_, **__: None)


@pytest.fixture
def without_node(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep checks from starting Node, twice each. tests/verify tests the rules of glTF and KTX2."""
    monkeypatch.setattr("stereocell.verify.node_validators._run_node", lambda script, paths: "")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """An empty file system of 400 kB; mounting it needs root."""
    disk = tmp_path / "disk"
    disk.mkdir()
    options = ["-t", "tmpfs", "-o", "size=400k"]
    if subprocess.run(["mount", *options, "tmpfs", str(disk)], capture_output=True).returncode:
        pytest.skip("mounting a small tmpfs is not allowed here (it takes root)")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


@pytest.fixture
def voxels() -> NDArray[np.uint16]:
    """Two channels, uint16 (c, z, y, x) = (2, 6, 40, 56), every voxel different."""
    return np.arange(2 * 6 * 40 * 56, dtype=np.uint16).reshape(2, 6, 40, 56)


@pytest.fixture
def tiny_zarr_04(tmp_path: Path, voxels: NDArray[np.uint16]) -> Path:
    """OME-Zarr 0.4 of `voxels` in chunks of (1, 2, 16, 16), two levels, named channels."""
    return _tiny_zarr(tmp_path / "tiny04.ome.zarr", voxels, "0.4")


@pytest.fixture
def tiny_zarr_05(tmp_path: Path, voxels: NDArray[np.uint16]) -> Path:
    """OME-Zarr 0.5, otherwise like `tiny_zarr_04`."""
    return _tiny_zarr(tmp_path / "tiny05.ome.zarr", voxels, "0.5")


@pytest.fixture
def tiny_tiff(tmp_path: Path, voxels: NDArray[np.uint16]) -> Path:
    """OME-TIFF of `voxels` in tiles of 16 x 16, two levels, named channels."""
    return phantoms.write_ome_tiff(
        tmp_path / "tiny.ome.tif",
        voxels,
        axes="CZYX",
        names=["Hoechst", "CD31"],
        colors=[0x0000FFFF, 0x00FF80FF],
        levels=2,
        tile=(16, 16),
    )


def _tiny_zarr(path: Path, voxels: NDArray[np.uint16], version: str) -> Path:
    return phantoms.write_ome_zarr(
        path,
        [voxels, voxels[..., ::2, ::2]],
        axes="czyx",
        version=version,
        scales=[{"z": 0.5, "y": 0.2, "x": 0.2}, {"z": 0.5, "y": 0.4, "x": 0.4}],
        channels=CHANNELS,
        chunks=(1, 2, 16, 16),
    )


@dataclass
class Server:
    """A folder served on loopback. `requests` holds (method, path, range header or None)."""

    url: str
    requests: list[tuple[str, str, str | None]] = field(default_factory=list)

    def gets(self, part: str) -> list[str]:
        """Paths of the GET requests that contain `part`."""
        return [path for method, path, _ in self.requests if method == "GET" and part in path]


@pytest.fixture
def serve() -> Iterator[Callable[[Path], Server]]:
    """Serve a folder by http, with byte ranges: `server = serve(folder)`."""
    with ExitStack() as stack:
        yield lambda folder: stack.enter_context(_serving(folder, _FileHandler))


@pytest.fixture(scope="session")
def s3_bucket(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder that is the bucket `s3://bucket` (GET, HEAD and ListObjectsV2, unsigned).

    The session has one server, because s3fs caches its client and so the server's address.
    """
    root = tmp_path_factory.mktemp("s3")
    bucket = root / "bucket"
    bucket.mkdir()
    with _serving(root, _S3Handler) as server, pytest.MonkeyPatch.context() as patch:
        for name in ("AWS_ACCESS_KEY_ID", "AWS_PROFILE", "AWS_WEB_IDENTITY_TOKEN_FILE"):
            patch.delenv(name, raising=False)
        patch.setenv("AWS_ENDPOINT_URL", server.url)
        patch.setenv("AWS_DEFAULT_REGION", "us-east-1")
        yield bucket


@contextmanager
def _serving(folder: Path, handler: type["_FileHandler"]) -> Iterator[Server]:
    server = Server("")
    bound = type("Bound", (handler,), {"folder": folder, "server_log": server.requests})
    http = ThreadingHTTPServer(("127.0.0.1", 0), bound)
    server.url = f"http://127.0.0.1:{http.server_address[1]}"
    thread = Thread(target=http.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
    thread.start()
    try:
        yield server
    finally:
        http.shutdown()
        http.server_close()
        thread.join()


class _FileHandler(BaseHTTPRequestHandler):
    folder: Path
    server_log: list[tuple[str, str, str | None]]
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True  # otherwise each small answer waits 40 ms for an ACK

    def do_GET(self) -> None:
        self._answer(with_body=True)

    def do_HEAD(self) -> None:
        self._answer(with_body=False)

    def log_message(self, *args: Any) -> None:
        """Tests read `server_log`; nothing goes to stderr."""

    def _answer(self, with_body: bool) -> None:
        wanted = self.headers.get("Range")
        path = unquote(urlsplit(self.path).path)
        self.server_log.append((self.command, path, wanted))
        file = self.folder / path.lstrip("/")
        if not file.is_file():
            self._send(404, self.missing(path), with_body)
            return
        content, status, headers = file.read_bytes(), 200, {}
        if wanted is not None:
            first, _, last = wanted.removeprefix("bytes=").partition("-")
            start = int(first) if first else max(len(content) - int(last), 0)
            stop = min(int(last) + 1, len(content)) if first and last else len(content)
            headers = {"Content-Range": f"bytes {start}-{stop - 1}/{len(content)}"}
            content, status = content[start:stop], 206
        self._send(status, content, with_body, headers)

    def missing(self, path: str) -> bytes:
        return b""

    def _send(
        self, status: int, content: bytes, with_body: bool, headers: dict[str, str] | None = None
    ) -> None:
        self.send_response(status)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Accept-Ranges", "bytes")
        self.send_header("ETag", '"0"')
        for key, value in (headers or {}).items():
            self.send_header(key, value)
        self.end_headers()
        if with_body:
            # Clients that only want the length close the connection before the body.
            with suppress(ConnectionError):
                self.wfile.write(content)


class _S3Handler(_FileHandler):
    def _answer(self, with_body: bool) -> None:
        query = parse_qs(urlsplit(self.path).query)
        if "list-type" not in query:
            super()._answer(with_body)
            return
        bucket = unquote(urlsplit(self.path).path).strip("/")
        self.server_log.append((self.command, f"/{bucket}?list", None))
        prefix = query.get("prefix", [""])[0]
        root = self.folder / bucket
        keys = [p.relative_to(root).as_posix() for p in sorted(root.rglob("*")) if p.is_file()]
        items = "".join(
            f"<Contents><Key>{key}</Key><Size>{(root / key).stat().st_size}</Size></Contents>"
            for key in keys
            if key.startswith(prefix)
        )
        content = (
            '<?xml version="1.0"?><ListBucketResult>'
            f"<Name>{bucket}</Name><IsTruncated>false</IsTruncated>{items}</ListBucketResult>"
        )
        self._send(200, content.encode(), with_body)

    def missing(self, path: str) -> bytes:
        return b"<Error><Code>NoSuchKey</Code><Message>no such key</Message></Error>"
