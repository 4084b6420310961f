"""The local server: byte ranges, types, and nothing outside the bundle."""

import http.client
import socket
from collections.abc import Iterator
from pathlib import Path
from threading import Thread

import pytest

from stereocell.errors import StereoCellError
from stereocell.serve import HOST, make_server, parse_range

DATA = bytes(range(256)) * 1000


@pytest.fixture
def bundle(tmp_path: Path) -> Path:
    folder = tmp_path / "bundle"
    (folder / "volumes" / "r0_c0").mkdir(parents=True)
    (folder / "assets").mkdir()
    (folder / "manifest.json").write_text("{}")
    (folder / "index.html").write_text("<!doctype html>")
    (folder / "volumes" / "r0_c0" / "CD31.ktx2").write_bytes(DATA)
    (folder / "lod0.glb").write_bytes(b"glTF")
    (folder / "assets" / "decoder.wasm").write_bytes(b"\0asm")
    (folder / "assets" / "index.js").write_text("0")
    return folder


@pytest.fixture
def port(bundle: Path) -> Iterator[int]:
    with make_server(bundle, 0) as server:
        thread = Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield server.server_port
        server.shutdown()
        thread.join()


def ask(
    port: int, path: str, method: str = "GET", **headers: str
) -> tuple[http.client.HTTPResponse, bytes]:
    connection = http.client.HTTPConnection(HOST, port, timeout=10)
    try:
        connection.request(method, path, headers=headers)
        response = connection.getresponse()
        return response, response.read()
    finally:
        connection.close()


def test_a_range_is_answered_with_its_bytes(port: int) -> None:
    response, body = ask(port, "/volumes/r0_c0/CD31.ktx2", Range="bytes=1000-1999")
    assert response.status == 206
    assert response.headers["Content-Range"] == f"bytes 1000-1999/{len(DATA)}"
    assert response.headers["Content-Length"] == "1000"
    assert body == DATA[1000:2000]


def test_a_whole_file_says_that_it_has_ranges(port: int) -> None:
    response, body = ask(port, "/volumes/r0_c0/CD31.ktx2")
    assert (response.status, body) == (200, DATA)
    assert response.headers["Accept-Ranges"] == "bytes"


def test_a_range_behind_the_end_is_refused_with_the_size(port: int) -> None:
    response, body = ask(port, "/lod0.glb", Range="bytes=4-9")
    assert (response.status, body) == (416, b"")
    assert response.headers["Content-Range"] == "bytes */4"


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("bytes=0-0", range(0, 1)),
        ("bytes=10-", range(10, 100)),
        ("bytes=90-1000", range(90, 100)),
        ("bytes=-30", range(70, 100)),
        ("bytes=-1000", range(0, 100)),
        ("bytes=100-", range(100, 100)),
        ("bytes=20-10", None),
        ("bytes=-", None),
        ("bytes=0-1,5-6", None),
        ("pages=1-2", None),
    ],
)
def test_ranges_mean_what_rfc_9110_says(header: str, expected: range | None) -> None:
    assert parse_range(header, 100) == expected


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("/", "text/html; charset=utf-8"),
        ("/manifest.json", "application/json"),
        ("/lod0.glb", "model/gltf-binary"),
        ("/volumes/r0_c0/CD31.ktx2", "image/ktx2"),
        ("/assets/decoder.wasm", "application/wasm"),
        ("/assets/index.js?v=1", "text/javascript; charset=utf-8"),
    ],
)
def test_types_are_what_browsers_want(port: int, path: str, expected: str) -> None:
    response, _ = ask(port, path)
    assert (response.status, response.headers["Content-Type"]) == (200, expected)


def test_head_sends_no_body(port: int) -> None:
    response, body = ask(port, "/lod0.glb", "HEAD")
    assert (response.status, response.headers["Content-Length"], body) == (200, "4", b"")


@pytest.mark.parametrize(
    "path",
    [
        "/../secret.txt",
        "/%2e%2e/secret.txt",
        "/volumes/../../secret.txt",
        "//etc/hostname",
        "/a%00b",
    ],
)
def test_no_path_leaves_the_bundle(port: int, bundle: Path, path: str) -> None:
    (bundle.parent / "secret.txt").write_text("secret")
    response, body = ask(port, path)
    assert response.status == 404
    assert b"secret" not in body


def test_a_link_that_leads_out_is_refused(port: int, bundle: Path) -> None:
    (bundle.parent / "secret.txt").write_text("secret")
    (bundle / "link.txt").symlink_to(bundle.parent / "secret.txt")
    (bundle / "folder").symlink_to(bundle.parent)
    assert ask(port, "/link.txt")[0].status == 404
    assert ask(port, "/folder/secret.txt")[0].status == 404


def test_another_host_name_is_refused(port: int) -> None:
    assert ask(port, "/manifest.json", Host="evil.example")[0].status == 403
    assert ask(port, "/manifest.json", Host=f"localhost:{port}")[0].status == 200


def test_writing_is_not_offered(port: int) -> None:
    assert ask(port, "/manifest.json", "PUT")[0].status == 501


def test_a_missing_bundle_is_one_line_that_says_how_to_make_it(tmp_path: Path) -> None:
    with pytest.raises(StereoCellError, match=r"manifest\.json: expected a built bundle, found no"):
        make_server(tmp_path, 0)


def test_a_taken_port_is_named(bundle: Path) -> None:
    with socket.socket() as taken:
        taken.bind((HOST, 0))
        taken.listen()
        with pytest.raises(StereoCellError, match="choose another"):
            make_server(bundle, taken.getsockname()[1])


def test_a_client_that_goes_away_leaves_the_server_working(port: int) -> None:
    with socket.create_connection((HOST, port), timeout=10) as client:
        client.sendall(b"GET /volumes/r0_c0/CD31.ktx2 HTTP/1.1\r\nHost: localhost\r\n\r\n")
        client.recv(10)
    assert ask(port, "/lod0.glb")[0].status == 200
