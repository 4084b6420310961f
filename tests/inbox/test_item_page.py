"""The page of an item watches its build, whenever the build begins, fails and begins again."""

import http.client
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from stereocell.live import first_view
from stereocell.serve import inbox_app
from support.nifti_files import write as write_nifti
from support.phantoms import f_phantom
from support.server.brick_client import reconstruct
from support.server.inbox_client import FakeBuilds, InboxClient, end_build, serving_inbox
from support.server.sent_bricks import sent
from support.server.timeouts import PATIENCE_S, connect


@pytest.fixture(scope="module")
def head(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("head") / "head.nii"
    write_nifti(path, np.diag([0.7, 0.7, 1.2, 1.0]), f_phantom(1).astype(np.int16))
    return path.read_bytes()


def hand_in(client: InboxClient, head: bytes, name: str = "a.nii") -> str:
    item = client.hand_in([(name, head)])
    assert client.wait(item, "understood", "failed")["line"] == ""
    return item


def watch(client: InboxClient, item: str) -> ClientConnection:
    return connect(f"ws://localhost:{client.port}/items/{item}/view/live")


def until(socket: ClientConnection, doing: str) -> dict[str, Any]:
    while True:
        found: dict[str, Any] = json.loads(socket.recv(timeout=PATIENCE_S))
        if found["doing"] == doing:
            return found


def folder_in(headers: http.client.HTTPMessage) -> str:
    found = re.fullmatch(r"version=1; folder=(g[0-9]+/)", headers["Stereocell-Live"])
    assert found is not None
    return found[1]


def test_a_page_that_was_opened_before_follows_the_build_to_its_bundle(
    tmp_path: Path, head: bytes
) -> None:
    with serving_inbox(tmp_path, FakeBuilds()) as server:
        client = InboxClient(server.port)
        item = hand_in(client, head)
        view = f"/items/{item}/view"
        client.command(item, "look")
        _, first, headers = client.ask("GET", f"{view}/manifest.json")
        folder = folder_in(headers)
        with watch(client, item) as socket:
            assert until(socket, "unbuilt")["may_control"] is True
            client.command(item, "build")
            assert until(socket, "building")["folder"] == folder  # the preview is still served
            assert client.ask("GET", f"{view}/{folder}manifest.json")[1] == first
            socket.send("pause")
            until(socket, "paused")
            assert client.wait(item, "paused")
            socket.send("continue")
            until(socket, "building")
            socket.send("cancel")
            assert until(socket, "cancelled")["may_continue"] is True
            socket.send("continue")  # at once, while the queue still ends the build
            until(socket, "building")
            end_build(server, item, "a.nii: cut off")
            failed = until(socket, "failed")
            assert (failed["line"], failed["may_continue"]) == ("...: cut off", True)
            socket.send("continue")
            end_build(server, item)
            assert until(socket, "complete")["has_bundle"] is True
        assert client.ask("GET", f"{view}/manifest.json")[1] == "built"
        assert client.ask("GET", f"{view}/{folder}manifest.json")[1] == first


def test_a_page_waits_for_the_builds_before_its_own_and_may_leave_the_queue(
    tmp_path: Path, head: bytes
) -> None:
    with serving_inbox(tmp_path, FakeBuilds()) as server:
        client = InboxClient(server.port)
        first, second = (hand_in(client, head, f"{k}.nii") for k in range(2))
        client.command(second, "look")
        for item in (first, second):
            client.command(item, "build")
        client.wait(first, "building")
        with watch(client, second) as socket:
            assert until(socket, "queued")["place"] == 2
            socket.send("cancel")
            until(socket, "cancelled")
            assert client.item(second)["doing"] == "cancelled"
            socket.send("continue")
            until(socket, "queued")
            client.command(first, "cancel")
            until(socket, "building")


def test_a_preview_after_a_choice_is_new_and_the_older_one_stays_for_pages_that_show_it(
    tmp_path: Path, head: bytes
) -> None:
    with serving_inbox(tmp_path, FakeBuilds()) as server:
        client = InboxClient(server.port)
        item = hand_in(client, head)
        view = f"/items/{item}/view"
        client.command(item, "look")
        _, first, headers = client.ask("GET", f"{view}/manifest.json")
        older = folder_in(headers)
        with watch(client, item) as socket:
            assert until(socket, "unbuilt")["folder"] == older
            assert client.ask("PUT", f"/items/{item}/choices", {"title": "Other"})[0] == 202
            assert client.wait(item, "understood")["page"] == ""
            assert client.command(item, "look")["page"]
            newer = json.loads(socket.recv(timeout=PATIENCE_S))["folder"]
        assert newer != older
        manifest, headers = client.ask("GET", f"{view}/manifest.json")[1:]
        assert (manifest["specimen"]["name"], folder_in(headers)) == ("Other", newer)
        assert client.ask("GET", f"{view}/{older}manifest.json")[1] == first


def test_the_page_of_a_deleted_item_receives_that_state(tmp_path: Path, head: bytes) -> None:
    with serving_inbox(tmp_path, FakeBuilds()) as server:
        client = InboxClient(server.port)
        item = hand_in(client, head)
        client.command(item, "look")
        with watch(client, item) as socket:
            until(socket, "unbuilt")
            client.ask("DELETE", f"/items/{item}")
            until(socket, "deleted")
        with watch(client, item) as socket:  # a page that connects again
            assert until(socket, "deleted")["may_control"] is False


def test_a_client_that_may_only_view_sees_the_build_and_cannot_control_it(
    tmp_path: Path, head: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    with serving_inbox(tmp_path, FakeBuilds()) as server:
        client = InboxClient(server.port)
        item = hand_in(client, head)
        monkeypatch.setattr(inbox_app, "MAY_UPLOAD", "another right")
        with watch(client, item) as socket:  # there is no preview yet
            until(socket, "deleted")
        monkeypatch.undo()
        client.command(item, "look")
        client.command(item, "build")
        client.wait(item, "building")
        monkeypatch.setattr(inbox_app, "MAY_UPLOAD", "another right")
        with watch(client, item) as socket:
            assert until(socket, "building")["may_control"] is False
            end_build(server, item, "a.nii: cut off")
            assert until(socket, "failed")["line"] == ""
            socket.send("continue")
            with pytest.raises(ConnectionClosed, match="1008"):
                socket.recv(timeout=PATIENCE_S)
        monkeypatch.undo()
        assert client.item(item)["doing"] == "failed"


def look(client: InboxClient, item: str) -> tuple[dict[str, Any], str, dict[str, str]]:
    """Return the manifest of an item's preview, the path of its bricks, and its first volume."""
    client.command(item, "look")
    _, manifest, headers = client.ask("GET", f"/items/{item}/view/manifest.json")
    assert headers["Stereocell-Bricks"] == headers["Stereocell-Live"]
    volume = {"tile": manifest["tiles"][0]["id"], "channel": manifest["channels"][0]["id"]}
    return manifest, f"/items/{item}/view/{folder_in(headers)}bricks", volume


def test_a_tile_in_the_view_gets_the_voxels_of_the_upload_before_any_build(
    tmp_path: Path, head: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(first_view, "VOXELS", 10_000)
    with serving_inbox(tmp_path, FakeBuilds()) as server:
        client = InboxClient(server.port)
        item, other = (hand_in(client, head, name) for name in ("a.nii", "b.nii"))
        manifest, bricks, volume = look(client, item)
        box = tuple(manifest["specimen"]["bounds_um"].values())
        with server.inbox.find(other).reading, server.inbox.reader._busy:  # as while reading other
            found = sent(server.port, bricks, [volume], box)
        assert found.done[1]["reason"] == "complete"
        (tree,) = found.trees.values()
        low, high = manifest["channels"][0]["window"]
        expected = np.clip((f_phantom(1) - low) / (high - low) * 255, 0, 255)
        voxels = reconstruct(tree.table, tree.frames)[1:-1, 1:-1, 1:-1]
        # Sorted values are compared, because the file's axes are in another order.
        shown, known = (np.sort(one[one > tree.table.threshold + 1]) for one in (voxels, expected))
        assert shown.size
        np.testing.assert_allclose(shown, known, atol=0.51)


def test_an_upload_that_is_damaged_after_the_preview_gives_an_error_without_its_name(
    tmp_path: Path, head: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(first_view, "VOXELS", 10_000)
    with serving_inbox(tmp_path, FakeBuilds()) as server:
        client = InboxClient(server.port)
        item = hand_in(client, head, "Doe^Jane.nii")
        _, bricks, volume = look(client, item)
        next((tmp_path / "box" / item / "upload").rglob("*.nii")).write_bytes(head[:-1000])
        found = sent(server.port, bricks, [volume])
        (error,) = (one for one in found.messages if one["type"] == "error")
        assert error["code"] == "damaged"
        assert "Doe" not in str(error)
        client.ask("DELETE", f"/items/{item}")
        assert not (tmp_path / "box" / item).exists()
