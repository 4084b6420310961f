"""Builds wait in a queue, one runs at a time, and a restart loses no build."""

import io
import json
import shutil
import zipfile
from collections import namedtuple
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from stereocell.inbox.inbox import Inbox
from stereocell.inbox.limits import InboxLimits
from stereocell.inbox.upload import Announced, Upload
from stereocell.model.errors import OutputError
from support.nifti_files import write as write_nifti
from support.phantoms import f_phantom
from support.server.inbox_client import LIMITS, FakeBuilds, InboxClient, end_build, serving_inbox

Usage = namedtuple("Usage", "total used free")


@pytest.fixture(scope="module")
def head(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("head") / "head.nii"
    write_nifti(path, np.diag([0.7, 0.7, 1.2, 1.0]), f_phantom(1).astype(np.int16))
    return path.read_bytes()


def hand_in(client: InboxClient, name: str, data: bytes) -> str:
    item = client.hand_in([(name, data)])
    assert client.wait(item, "understood", "failed")["line"] == ""
    return item


def test_one_builds_at_a_time_and_the_others_wait_in_order(tmp_path: Path, head: bytes) -> None:
    make = FakeBuilds()
    with serving_inbox(tmp_path, make) as server:
        client = InboxClient(server.port)
        items = [hand_in(client, f"{k}.nii", head) for k in range(3)]
        for item in items:
            client.command(item, "build", {"keep_upload": item == items[0]})
        client.wait(items[0], "building")
        state = {one["id"]: one for one in client.state()["items"]}
        assert [state[item]["place"] for item in items] == [1, 2, 3]
        assert [state[item]["doing"] for item in items[1:]] == ["queued", "queued"]
        client.command(items[1], "cancel")
        assert client.item(items[2])["place"] == 2
        client.command(items[0], "pause")
        assert client.wait(items[0], "paused")["left_s"] is None
        client.command(items[0], "continue")
        end_build(server, items[0])
        built = client.wait(items[0], "built")
        assert (built["has_upload"], built["share"]) == (True, 1.0)
        client.wait(items[2], "building")
        client.command(items[2], "look")  # waits for its first view
        client.command(items[2], "cancel")
        assert client.wait(items[2], "cancelled")["page"]  # its first view stays
        client.command(items[1], "continue")
        end_build(server, items[1])
        assert not client.wait(items[1], "built")["has_upload"]
        assert client.ask("GET", f"/items/{items[1]}/view/manifest.json")[1] == "built"
    assert [choices.title for _, choices, _ in make.asked] == ["MR volume"] * 3


def test_a_restart_goes_on_with_uploads_the_queue_and_the_build(
    tmp_path: Path, head: bytes
) -> None:
    with serving_inbox(tmp_path, FakeBuilds()) as server:
        client = InboxClient(server.port)
        first, second = (hand_in(client, f"{k}.nii", head) for k in range(2))
        for item in (first, second):
            client.command(item, "build")
        third = client.announce([("third.nii", head)])
        client.send(third, head[:100], 0)
        client.wait(first, "building")
        state = client.item(third)
    assert (state["bytes"], state["total"]) == (100, len(head))
    with serving_inbox(tmp_path, FakeBuilds()) as server:
        client = InboxClient(server.port)
        assert client.announce([("third.nii", head)]) == third
        client.send(third, head[100:], 100)
        for item in (first, second):
            end_build(server, item)
            client.wait(item, "built")
        client.wait(third, "understood")
        starts = tmp_path / "box" / first / "out" / "starts"
        assert starts.read_text() == "**"  # the build was interrupted, and started again
    with serving_inbox(tmp_path) as server:
        client = InboxClient(server.port)
        assert client.ask("GET", f"/items/{first}/view/manifest.json")[1] == "built"
        assert client.item(third)["doing"] == "understood"


def test_a_server_that_ends_while_a_build_ends_loses_nothing(tmp_path: Path, head: bytes) -> None:
    with serving_inbox(tmp_path) as server:
        client = InboxClient(server.port)
        item = hand_in(client, "a.nii", head)
        client.command(item, "build")
        client.wait(item, "building")
        server.inbox.close()
        end_build(server, item)
        client.wait(item, "built")
    box, upload = tmp_path / "box", tmp_path / "box" / item / "upload"
    assert upload.exists()
    inbox = Inbox(box, LIMITS)
    found = inbox.find(item)
    assert found.doing == "queued"  # the build will find that everything is built
    inbox.set(found, "built")
    assert upload.exists()
    assert Inbox(box, LIMITS).find(item).doing == "built"  # after a power cut at this moment
    assert not upload.exists()


def test_delete_removes_all_files_and_ends_running_work(tmp_path: Path, head: bytes) -> None:
    with serving_inbox(tmp_path, FakeBuilds()) as server:
        client = InboxClient(server.port)
        building, begun = hand_in(client, "a.nii", head), client.announce([("b.nii", head)])
        client.command(building, "build")
        client.wait(building, "building")
        for item in (building, begun):
            assert client.ask("DELETE", f"/items/{item}")[0] == 204
            assert client.ask("GET", f"/items/{item}/view/")[0] == 404
            assert client.ask("DELETE", f"/items/{item}")[0] == 404
        assert client.state()["items"] == []
        left = sorted(one.name for one in (tmp_path / "box").iterdir())
        assert left == ["inbox.json"]
        again = hand_in(client, "c.nii", head)
        client.command(again, "build")
        client.wait(again, "building")  # the queue goes on


def test_an_upload_that_broke_off_too_long_ago_is_removed(tmp_path: Path, head: bytes) -> None:
    box = tmp_path / "box"
    box.mkdir()
    inbox = Inbox(box, InboxLimits(hours=0.0, reserve=0))
    item, _ = inbox.announce({"files": [["old.nii", 10]]}, is_local=True)
    whole, _ = inbox.announce({"files": [["new.nii", 4]]}, is_local=True)
    with inbox.piece(whole, 0) as write:
        write(b"head")
    inbox.remove_old()
    assert [one.id for one in inbox.items()] == [whole.id]
    assert not item.folder.exists()


def test_a_full_disk_refuses_new_uploads_and_keeps_the_bytes_that_arrived(
    tmp_path: Path, head: bytes
) -> None:
    with serving_inbox(tmp_path) as server:
        client = InboxClient(server.port)
        item = client.announce([("a.nii", head)])
        free = len(head) + 50
        with patch.object(shutil, "disk_usage", lambda _: Usage(0, 0, free)):
            status, content, _ = client.ask("POST", "/items", {"files": [["b.nii", 51]]})
            assert (status, content["line"].split(":")[0]) == (
                507,
                "the server's disk has 50 bytes free, expected 51 for this upload",
            )
            assert client.ask("POST", "/items", {"files": [["c.nii", 50]]})[0] == 201
        with patch.object(Upload, "part", lambda *_: Path("/dev/full")):
            status, content, headers = client.ask(
                "PATCH", f"/items/{item}/bytes", head, {"Upload-Offset": "0"}
            )
        assert (status, headers["Upload-Offset"]) == (507, "0")
        assert content["line"].startswith("the server's disk is full")
        client.send(item, head, 0)
        client.wait(item, "understood")
        with patch.object(shutil, "disk_usage", lambda _: Usage(0, 0, 10)):
            client.command(item, "build")
            assert "has 10 bytes free" in client.wait(item, "failed")["line"]
        client.command(item, "build")
        end_build(server, item)
        client.wait(item, "built")


def test_a_failed_build_shows_its_line_and_can_be_built_again(tmp_path: Path, head: bytes) -> None:
    with serving_inbox(tmp_path) as server:
        client = InboxClient(server.port)
        item = hand_in(client, "a.nii", head)
        client.command(item, "build")
        end_build(server, item, f"{tmp_path}/box/{item}/upload/source/specimen.nii: cut off")
        assert client.wait(item, "failed")["line"] == "specimen.nii: cut off"
        client.command(item, "build")
        client.wait(item, "building")
        end_build(server, item)
        client.wait(item, "built")


@pytest.mark.slow
def test_a_reader_that_dies_or_hangs_is_one_line_and_the_server_goes_on(
    tmp_path: Path, head: bytes
) -> None:
    with serving_inbox(tmp_path, is_near=False) as server:
        client = InboxClient(server.port)
        item = client.hand_in([("a.nii", head)])
        client.wait(item, "understanding", "understood")
        server.inbox.reader.stop(server.inbox.find(item))  # as a crash does
        state = client.wait(item, "failed", "understood")
        assert state["doing"] == "understood" or "reading was stopped" in state["line"]
        with patch("stereocell.inbox.preparing.UNPACK_S", 0.0):
            archive = io.BytesIO()
            with zipfile.ZipFile(archive, "w") as packed:
                for k in range(250):
                    packed.writestr(f"{k}.bin", bytes(100_000))
            slow = client.hand_in([("b.zip", archive.getvalue())])
            line = client.wait(slow, "failed")["line"]
        assert line == "reading was stopped: it did not end within 0 s"
        assert client.wait(hand_in(client, "c.nii", head), "understood")


def test_a_folder_of_other_files_and_a_damaged_queue_are_refused(tmp_path: Path) -> None:
    (tmp_path / "scan.nii").touch()
    with pytest.raises(OutputError, match="expected an empty folder or an inbox"):
        Inbox(tmp_path, LIMITS)
    box = tmp_path / "box"
    box.mkdir()
    Inbox(box, LIMITS).announce({"files": [["a.nii", 1]]}, is_local=True)
    text = (box / "inbox.json").read_text()
    assert "a.nii" not in text
    (box / "inbox.json").write_text(text.replace("uploading", "built"))
    with pytest.raises(OutputError, match=r"inbox.json: damaged or changed by hand"):
        Inbox(box, LIMITS)


def test_the_stream_of_an_upload_is_cut_into_its_files_at_any_byte(tmp_path: Path) -> None:
    files = {"a": b"", "b": b"12345", "c": b"", "d": b"678", "e": b""}
    announced = Announced(tuple(files), tuple(map(len, files.values())))
    for size in range(1, 9):
        folder = tmp_path / str(size)
        Upload.create(folder, announced)
        stream = b"".join(files.values())
        for start in range(0, len(stream), size):
            upload = Upload.open(folder)  # as after a restart
            assert upload is not None
            assert upload.offset == start
            upload.write(stream[start : start + size])
        assert upload is not None
        assert upload.is_whole
        upload.finish()
        found = [upload.part(k).read_bytes() for k in range(len(files))]
        assert found == list(files.values())
    assert json.loads((folder / "names.json").read_text())["files"][1] == ["b", 5]


@pytest.mark.slow
def test_an_item_is_read_again_after_its_idle_reader_was_ended(tmp_path: Path, head: bytes) -> None:
    with serving_inbox(tmp_path, FakeBuilds(), is_near=False) as server:
        client = InboxClient(server.port)
        item = hand_in(client, "a.nii", head)
        server.inbox.reader.stop(server.inbox.find(item))  # as a cancelled build does
        assert client.command(item, "look")["page"]
