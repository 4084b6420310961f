"""The local server: byte ranges, types, nothing outside the bundle, no clients from elsewhere."""

import gzip
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from websockets.exceptions import InvalidStatus

from stereocell.cli.__main__ import main
from stereocell.model.errors import StereoCellError
from stereocell.serve import server as serve_module
from stereocell.serve.server import LOCALHOST, BundleServer
from stereocell.serve.static_files import accepted_encodings, parse_range
from support.server.requests import ask
from support.server.running import running, serving
from support.server.timeouts import PATIENCE_S, connect

DATA = bytes(range(256)) * 1000
CODE = b"let sum = 0;" * 1000


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("serve") / "out" / "bundle"
    (folder / "volumes" / "r0_c0").mkdir(parents=True)
    (folder / "assets").mkdir()
    (folder / "manifest.json").write_text("{}")
    (folder / "index.html").write_text("<!doctype html>")
    (folder / "volumes" / "r0_c0" / "CD31.ktx2").write_bytes(DATA)
    (folder / "lod0.glb").write_bytes(b"glTF")
    (folder / "specimen.usdz").write_bytes(b"PK")
    (folder / "assets" / "decoder.wasm").write_bytes(b"\0asm")
    (folder / "assets" / "index.js").write_text("0")
    (folder / "assets" / "code.js").write_bytes(CODE)
    (folder / "assets" / "code.js.gz").write_bytes(gzip.compress(CODE))
    (folder / "assets" / "code.js.br").write_bytes(b"as brotli has it")
    return folder


@pytest.fixture(scope="module")
def port(bundle: Path) -> Iterator[int]:
    with serving(bundle.parent) as server:
        yield server.port


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
        ("bytes=\u0661-\u0662", None),
        (f"bytes=0-{'9' * 5000}", None),
    ],
)
def test_ranges_follow_rfc_9110(header: str, expected: range | None) -> None:
    assert parse_range(header, 100) == expected


@pytest.mark.parametrize(
    ("header", "status", "expected"),
    [
        ("bytes=-10", 206, DATA[-10:]),
        ("bytes=255990-", 206, DATA[-10:]),
        ("bytes=5-5", 206, DATA[5:6]),
        ("bytes=0-1,5-6", 200, DATA),
        ("bytes=9-1", 200, DATA),
        ("nonsense", 200, DATA),
        ("bytes=256000-", 416, b""),
        ("bytes=-0", 416, b""),
    ],
)
def test_ranges_are_answered_as_they_mean(
    port: int, header: str, status: int, expected: bytes
) -> None:
    response, body = ask(port, "/volumes/r0_c0/CD31.ktx2", Range=header)
    assert (response.status, body) == (status, expected)


def test_a_compressed_file_is_sent_to_clients_that_accept_it(port: int) -> None:
    path = "/assets/code.js"
    plain, body = ask(port, path)
    assert (plain.headers["Content-Encoding"], body) == (None, CODE)
    packed, body = ask(port, path, **{"Accept-Encoding": "gzip;q=0.5, deflate"})
    assert packed.headers["Content-Encoding"] == "gzip"
    assert gzip.decompress(body) == CODE
    shortest, body = ask(port, path, **{"Accept-Encoding": "gzip, br"})
    assert (shortest.headers["Content-Encoding"], body) == ("br", b"as brotli has it")
    for response in (plain, packed, shortest):
        assert response.headers["Content-Type"] == "text/javascript; charset=utf-8"
        assert response.headers["Vary"] == "Accept-Encoding"
    tags = {response.headers["ETag"] for response in (plain, packed, shortest)}
    assert len(tags) == 3
    again, _ = ask(
        port, path, **{"Accept-Encoding": "br", "If-None-Match": shortest.headers["ETag"]}
    )
    assert again.status == 304


def test_a_range_is_one_of_the_file_itself(port: int) -> None:
    headers = {"Accept-Encoding": "gzip, br", "Range": "bytes=4-6"}
    response, body = ask(port, "/assets/code.js", **headers)
    assert (response.status, response.headers["Content-Encoding"], body) == (206, None, b"sum")


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("", set()),
        ("gzip", {"gzip"}),
        ("GZIP , br;q=0.1", {"gzip", "br"}),
        ("br;q=0, gzip;q=0.000", set()),
        ("br; q=1.0", {"br"}),
    ],
)
def test_encodings_are_accepted_as_rfc_9110_says(header: str, expected: set[str]) -> None:
    assert accepted_encodings(header) - {""} == expected


def test_a_file_that_a_browser_has_cached_is_not_sent_again(port: int, bundle: Path) -> None:
    (bundle / "lod1.glb").write_bytes(b"glTF")
    response, _ = ask(port, "/lod1.glb")
    tag = response.headers["ETag"]
    again, body = ask(port, "/lod1.glb", **{"If-None-Match": tag})
    assert (again.status, body) == (304, b"")
    (bundle / "lod1.glb").write_bytes(b"another one")
    changed, body = ask(port, "/lod1.glb", **{"If-None-Match": tag})
    assert (changed.status, body) == (200, b"another one")


def test_caches_ask_each_time_and_pages_learn_of_the_bricks(port: int) -> None:
    response, _ = ask(port, "/manifest.json")
    assert response.headers["Cache-Control"] == "no-cache"
    assert response.headers["X-Content-Type-Options"] == "nosniff"
    assert response.headers["Stereocell-Bricks"] == "version=1"


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("/", "text/html; charset=utf-8"),
        ("/manifest.json", "application/json"),
        ("/lod0.glb", "model/gltf-binary"),
        ("/specimen.usdz", "model/vnd.usdz+zip"),
        ("/volumes/r0_c0/CD31.ktx2", "image/ktx2"),
        ("/assets/decoder.wasm", "application/wasm"),
        ("/assets/index.js?v=1", "text/javascript; charset=utf-8"),
    ],
)
def test_media_types_are_the_ones_that_browsers_require(
    port: int, path: str, expected: str
) -> None:
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


@pytest.mark.parametrize(
    "host", ["evil.example", "localhost.evil.example", "127.0.0.1.evil.example:80", "", "[::1]"]
)
def test_another_host_name_is_refused(port: int, host: str) -> None:
    assert ask(port, "/manifest.json", Host=host)[0].status == 403


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST:9", "127.0.0.1:8000"])
def test_the_servers_own_names_are_answered_at_any_port(port: int, host: str) -> None:
    assert ask(port, "/manifest.json", Host=host)[0].status == 200


@pytest.mark.parametrize(
    "origin",
    [
        "https://evil.example",
        "http://localhost:1",
        "http://localhost",
        "http://localhost:{port}.evil.example",
        "http://evil@localhost:{port}",
        "null",
        "http://[",
    ],
)
def test_pages_of_other_origins_get_no_websocket(
    port: int, origin: str, caplog: pytest.LogCaptureFixture
) -> None:
    origin = origin.format(port=port)
    with (
        pytest.raises(InvalidStatus) as refused,
        connect(f"ws://localhost:{port}/bricks", origin=origin),
    ):
        pass
    assert refused.value.response.status_code == 403
    ask(port, "/manifest.json")  # by now the server has done with the other one
    assert (
        caplog.records == []
    )  # a refused request is not a fault, and prints nothing in the terminal


def test_the_servers_own_page_and_programs_get_a_websocket(port: int) -> None:
    for origin in (f"http://localhost:{port}", None):
        with connect(f"ws://localhost:{port}/bricks", origin=origin) as client:
            client.send('{"type": "hello", "version": 1}')
            assert '"welcome"' in client.recv(timeout=PATIENCE_S)


def test_a_websocket_of_another_host_name_is_refused(port: int) -> None:
    with (
        socket.create_connection((LOCALHOST, port), timeout=PATIENCE_S) as stream,
        pytest.raises(InvalidStatus) as refused,
        connect("ws://evil.example/bricks", sock=stream),
    ):
        pass
    assert refused.value.response.status_code == 403


@pytest.mark.parametrize(
    ("site", "mode", "dest", "status"),
    [
        ("none", "navigate", "document", 200),  # typed
        ("cross-site", "navigate", "document", 200),  # a link
        ("same-origin", "cors", "empty", 200),
        ("same-origin", "no-cors", "image", 200),
        ("same-site", "no-cors", "image", 403),  # another port of localhost
        ("cross-site", "navigate", "iframe", 403),
        ("cross-site", "cors", "empty", 403),
    ],
)
def test_pages_of_other_sites_may_lead_here_and_no_more(
    port: int, site: str, mode: str, dest: str, status: int
) -> None:
    headers = {"Sec-Fetch-Site": site, "Sec-Fetch-Mode": mode, "Sec-Fetch-Dest": dest}
    assert ask(port, "/index.html", **headers)[0].status == status


@pytest.fixture(scope="module")
def framed(bundle: Path) -> Iterator[int]:
    server = BundleServer(bundle.parent, 0, lan=False, frames=("https://lab.example",))
    with running(server):
        yield server.port


def test_a_page_that_is_allowed_may_hold_the_viewer_in_a_frame(framed: int) -> None:
    fetch_headers = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}
    page, _ = ask(framed, "/", **fetch_headers, **{"Sec-Fetch-Dest": "iframe"})
    policy = page.headers["Content-Security-Policy"]
    assert page.status == 200
    assert "frame-ancestors https://lab.example;" in policy
    data, _ = ask(framed, "/lod0.glb")
    assert "frame-ancestors 'none'" in data.headers["Content-Security-Policy"]
    image, _ = ask(framed, "/lod0.glb", **fetch_headers, **{"Sec-Fetch-Dest": "image"})
    assert image.status == 403


@pytest.mark.parametrize("origin", ["lab.example", "https://lab.example/page", "*", "https://a;b"])
def test_a_frame_address_that_is_not_an_origin_is_refused(
    origin: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["serve", "out", "--allow-frame", origin]) == 2
    assert "is not an origin, expected a scheme and a host" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("path", "is_run"),
    [("/", True), ("/assets/index.js", True), ("/lod0.glb", False), ("/nothing", False)],
)
def test_a_page_and_its_scripts_run_and_data_does_not(port: int, path: str, is_run: bool) -> None:
    response, _ = ask(port, path)
    policy = response.headers["Content-Security-Policy"]
    assert ("sandbox" not in policy and "default-src" not in policy) == is_run
    assert ("default-src 'none'" in policy) != is_run
    assert "frame-ancestors 'none'" in policy
    if response.status == 200:  # a cache takes over what a 304 says: a worker then ran nothing
        again, _ = ask(port, path, **{"If-None-Match": response.headers["ETag"]})
        assert (again.status, again.headers["Content-Security-Policy"]) == (304, policy)


@pytest.mark.parametrize(
    ("arguments", "lan", "browser"),
    [
        (["view"], False, True),
        (["view", "--no-browser"], False, False),
        (["view", "--lan"], True, False),  # here everybody needs a code of their own
        (["serve"], False, False),
        (["serve", "--lan"], True, False),
    ],
)
def test_both_commands_serve_here_or_on_the_lan(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    lan: bool,
    browser: bool,
) -> None:
    monkeypatch.chdir(tmp_path)
    asked: list[tuple[object, ...]] = []
    monkeypatch.setattr(serve_module, "serve", lambda *given, **more: asked.append((given, more)))
    command, *flags = arguments
    assert main([command, "out", *flags]) == 0
    ((given, more),) = asked
    assert given == (Path("out"), 8000)
    assert (more["lan"], more["open_browser"]) == (lan, browser)


def test_writing_is_not_offered(port: int) -> None:
    assert ask(port, "/manifest.json", "PUT")[0].status == 405


def test_other_machines_get_no_answer(bundle: Path) -> None:
    server = BundleServer(bundle.parent, 0, lan=False)
    assert server._socket.getsockname()[0] == LOCALHOST
    server._socket.close()


def test_a_missing_bundle_is_one_line_that_says_how_to_make_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in ("view", "serve"):
        assert main([command, str(tmp_path), "--port", "0"]) == 1
        (line,) = capsys.readouterr().err.splitlines()
        assert "manifest.json: not found, expected a built bundle: run" in line
        assert f"`stereocell bundle {tmp_path}`" in line


def test_a_place_that_does_not_exist_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in ("view", "serve"):
        assert main([command, str(tmp_path / "vizarr.io"), "--port", "0"]) == 1
        (line,) = capsys.readouterr().err.splitlines()
        assert "vizarr.io: not found, expected a build, a bundle, or a source" in line


def test_a_bundle_is_served_by_its_own_folder_with_bricks_where_it_is_a_builds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    of_build, by_itself = tmp_path / "out" / "bundle", tmp_path / "sent" / "bundle"
    for folder in (of_build, by_itself):
        folder.mkdir(parents=True)
        (folder / "manifest.json").write_text("{}")
        (folder / "index.html").write_text("<!doctype html>")
    (tmp_path / "out" / "plan.json").write_text("{}")
    monkeypatch.chdir(of_build)
    for folder, has_bricks in ((of_build, True), (Path(), True), (by_itself, False)):
        with serving(folder) as server:
            response, body = ask(server.port, "/manifest.json")
            assert (response.status, body) == (200, b"{}")
            assert ("Stereocell-Bricks" in response.headers) == has_bricks
            if not has_bricks:
                with pytest.raises(InvalidStatus), connect(f"ws://localhost:{server.port}/bricks"):
                    pass


def test_a_taken_port_is_named(bundle: Path) -> None:
    with socket.socket() as taken:
        taken.bind((LOCALHOST, 0))
        taken.listen()
        with pytest.raises(StereoCellError, match="choose another by --port"):
            BundleServer(bundle.parent, taken.getsockname()[1], lan=False)
    with pytest.raises(StereoCellError, match="port 70000: "):
        BundleServer(bundle.parent, 70000, lan=False)


def test_a_client_that_goes_away_leaves_the_server_working(port: int) -> None:
    with socket.create_connection((LOCALHOST, port), timeout=PATIENCE_S) as client:
        client.sendall(b"GET /volumes/r0_c0/CD31.ktx2 HTTP/1.1\r\nHost: localhost\r\n\r\n")
        client.recv(10)
    assert ask(port, "/lod0.glb")[0].status == 200
