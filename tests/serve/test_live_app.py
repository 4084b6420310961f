"""A source is served while it is built: views in folders, a websocket, and finally the bundle."""

import json
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from stereocell.live.build_process import BuildProcess
from stereocell.live.build_state import State
from stereocell.live.reading import Reading
from stereocell.live.show_source import Live
from stereocell.model.errors import SourceError
from stereocell.serve import live_app, live_socket
from stereocell.serve.server import BundleServer
from support.server.requests import ask
from support.server.running import running
from support.server.timeouts import connect


class FakeBuild(BuildProcess):
    """A build whose state a test sets."""

    def __init__(self, out: Path) -> None:
        super().__init__(lambda _: "", out)
        self.asked: list[str] = []

    def do(self, command: str) -> None:  # type: ignore[override]
        self.asked.append(command)
        self.set(doing="pausing")

    def rest(self) -> None:
        self.asked.append("rest")

    def set(self, **news: Any) -> None:
        self._set(**news)


@pytest.fixture
def live(tmp_path: Path) -> Live:
    """A page, a first view that is not written yet, and a build that has not begun."""
    for folder, files in {
        "page": {"index.html": "<html>page", "assets/viewer.js": "run()"},
        "first": {"manifest.json": "first", "luts/A.ktx2": "first"},
        "g1": {"manifest.json": "second", "luts/A.ktx2": "second"},
        "out/bundle": {"manifest.json": "built", "index.html": "built", "luts/A.ktx2": "built"},
    }.items():
        for name, text in files.items():
            (tmp_path / folder / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / folder / name).write_text(text)
    (tmp_path / "secret").write_text("secret")
    build = FakeBuild(tmp_path / "out")
    build.set(all_tiles=10)
    return Live(
        tmp_path / "page", tmp_path / "first", Future(), None, build, Reading(lambda _: None)
    )


@contextmanager
def serving(live: Live) -> Iterator[int]:
    with running(BundleServer(live.bundle, 0, False, live=live)) as server:
        yield server.port


def build_of(live: Live) -> FakeBuild:
    assert isinstance(live.build, FakeBuild)
    return live.build


def text_of(port: int, path: str) -> str:
    return ask(port, path)[1].decode()


def test_the_page_comes_before_the_first_view(live: Live) -> None:
    with serving(live) as port:
        assert text_of(port, "/") == "<html>page"
        assert text_of(port, "/assets/viewer.js") == "run()"
        live.first.set_result(None)
        response, body = ask(port, "/manifest.json")
        assert body == b"first"
        assert response.headers["Stereocell-Live"] == "version=1; folder="
        assert text_of(port, "/luts/A.ktx2") == "first"
        assert ask(port, "/missing")[0].status == 404


def test_the_share_that_was_read_is_reported_until_the_first_view_exists(live: Live) -> None:
    with serving(live) as port:
        assert ask(port, "/")[0].headers["Server-Timing"] == "stereocell-reading"
        live.reading.add(0.25)
        assert json.loads(text_of(port, "/reading")) == {"share": 0.25}
        live.first.set_result(None)
        assert json.loads(text_of(port, "/reading")) == {"share": 1}
        assert "Server-Timing" not in ask(port, "/")[0].headers


def test_a_source_that_cant_be_read_is_answered_in_a_sentence(live: Live) -> None:
    with serving(live) as port:
        live.first.set_exception(SourceError("f.tif: cut off"))
        response, body = ask(port, "/manifest.json")
        assert response.status == 503
        assert body == b"the source can't be shown: see the terminal"


def test_the_manifest_is_that_of_the_newest_view_and_names_its_folder(
    live: Live, tmp_path: Path
) -> None:
    live.first.set_result(None)
    build = build_of(live)
    with serving(live) as port:
        assert ask(port, "/g1/manifest.json")[0].status == 404  # not reported by the build
        build._views["g1"] = tmp_path / "g1"
        build.set(folder="g1/")
        response, body = ask(port, "/manifest.json")
        assert body == b"second"
        assert response.headers["Stereocell-Live"] == "version=1; folder=g1/"
        assert text_of(port, "/g1/luts/A.ktx2") == "second"
        assert text_of(port, "/luts/A.ktx2") == "first"  # for a page that still shows it


def test_once_there_is_a_bundle_it_is_served_and_views_stay(live: Live, tmp_path: Path) -> None:
    live.first.set_result(None)
    build = build_of(live)
    with serving(live) as port:
        build._views["g1"] = tmp_path / "g1"
        build.set(has_bundle=True, doing="complete")
        response, body = ask(port, "/manifest.json")
        assert body == b"built"
        assert "Stereocell-Live" not in response.headers
        assert response.headers["Stereocell-Bricks"] == "version=1"
        assert text_of(port, "/g1/luts/A.ktx2") == "second"
        assert text_of(port, "/luts/A.ktx2") == "built"


@pytest.mark.parametrize(
    "path",
    ["/../secret", "/g1/../../secret", "/g1/..%2f..%2fsecret", "/g1//../secret", "/%2e%2e/secret"],
)
def test_no_path_leads_out_of_the_folders(live: Live, tmp_path: Path, path: str) -> None:
    live.first.set_result(None)
    build_of(live)._views["g1"] = tmp_path / "g1"
    with serving(live) as port:
        response, body = ask(port, path)
        assert response.status in (400, 404)
        assert body != b"secret"


def test_the_state_is_sent_at_once_and_at_each_change(live: Live) -> None:
    with serving(live) as port, connect(f"ws://localhost:{port}/live") as socket:
        first = json.loads(socket.recv())
        assert first["doing"] == State().doing
        assert (first["all_tiles"], first["may_control"]) == (10, True)
        build_of(live).set(label="units", done=3, total=20, tiles=1)
        assert json.loads(socket.recv())["tiles"] == 1
        socket.send("pause")
        assert json.loads(socket.recv())["doing"] == "pausing"
    assert build_of(live).asked == ["pause"]


@pytest.mark.parametrize("sent", ["stop", "", '{"do": "pause"}', "pause\n", b"pause"])
def test_an_unknown_command_ends_the_connection(live: Live, sent: str | bytes) -> None:
    with serving(live) as port, connect(f"ws://localhost:{port}/live") as socket:
        socket.recv()
        socket.send(sent)
        with pytest.raises(ConnectionClosed):
            socket.recv()
    assert build_of(live).asked == []


def test_a_page_whose_frames_are_late_lets_the_build_rest(live: Live) -> None:
    with serving(live) as port, connect(f"ws://localhost:{port}/live") as socket:
        socket.recv()
        socket.send("late")
        socket.send("pause")
        while json.loads(socket.recv())["doing"] != "pausing":
            pass
    assert build_of(live).asked == ["rest", "pause"]


def test_a_phone_that_looks_on_can_not_stop_the_build(
    live: Live, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_app, "is_on_this_machine", lambda _: False)
    build_of(live).set(doing="failed", line="patient.dcm: cut off")
    with serving(live) as port, connect(f"ws://localhost:{port}/live") as socket:
        state = json.loads(socket.recv())
        assert (state["may_control"], state["line"]) == (False, "")
        socket.send("cancel")
        with pytest.raises(ConnectionClosed):
            socket.recv()
    assert build_of(live).asked == []


@pytest.mark.parametrize(
    ("address", "is_on_this_machine"),
    [("127.0.0.1", True), ("::1", True), ("192.168.1.7", False), ("fe80::1", False), ("", False)],
)
def test_a_client_of_this_machine_is_known_by_its_address(
    address: str, is_on_this_machine: bool
) -> None:
    assert (
        live_socket.is_on_this_machine({"type": "websocket", "client": (address, 50_000)})
        is is_on_this_machine
    )


def test_without_a_build_there_is_no_websocket(live: Live) -> None:
    live.first.set_result(None)
    only = replace(live, build=None)
    with serving(only) as port:
        assert "Stereocell-Live" not in ask(port, "/manifest.json")[0].headers
        refused = pytest.raises((ConnectionClosed, InvalidStatus))
        with refused, connect(f"ws://localhost:{port}/live") as socket:
            socket.recv()
