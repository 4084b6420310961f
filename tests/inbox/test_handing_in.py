"""Specimens are uploaded over HTTP, read, viewed and built by the product's own code."""

import io
import json
import socket
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from stereocell.cli.inbox_build import make_inbox_build
from stereocell.inbox.item import Item
from stereocell.inbox.lines import without_identity
from stereocell.inbox.upload import Announced, Upload
from stereocell.serve.inbox_protocol import InboxHttp
from support.dicom_series import grid, write_series
from support.identity_search import find
from support.nifti_files import write as write_nifti
from support.phantoms import f_phantom, write_ome_tiff, write_ome_zarr
from support.server.inbox_client import (
    LIMITS,
    FakeBuilds,
    InboxClient,
    end_build,
    files_below,
    serving_inbox,
)
from support.server.timeouts import PATIENCE_S, connect

PATIENT = "Mustermann"


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[InboxClient]:
    with serving_inbox(tmp_path_factory.mktemp("inbox"), FakeBuilds()) as server:
        yield InboxClient(server.port)


def nifti(folder: Path, name: str = f"{PATIENT}_Max.nii.gz") -> tuple[str, bytes]:
    path = write_nifti(folder / "f.nii.gz", np.diag([0.7, 0.7, 1.2, 1.0]), voxels())
    return name, path.read_bytes()


def voxels() -> NDArray[Any]:
    return f_phantom(2).astype(np.int16)


def dicom(folder: Path) -> list[tuple[str, bytes]]:
    def name_patient(ds: Any) -> None:
        ds.PatientName, ds.PatientID = f"{PATIENT}^Max", "4711"

    write_series(folder / "series", grid(), change=name_patient)
    return files_below(folder / "series", f"{PATIENT}/CT")


def zipped(files: list[tuple[str, bytes]]) -> bytes:
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files:
            archive.writestr(name, content)
    return held.getvalue()


def understood(client: InboxClient, item: str) -> dict[str, Any]:
    assert client.wait(item, "understood", "failed")["line"] == ""
    status, content, _ = client.ask("GET", f"/items/{item}/understood")
    assert status == 200
    found: dict[str, Any] = content
    return found


def test_a_nifti_file_is_understood_with_sizes_levels_and_slices(
    client: InboxClient, tmp_path: Path
) -> None:
    item = client.hand_in([nifti(tmp_path)])
    found = understood(client, item)
    assert found["format"].startswith("NIfTI")
    assert found["title"] == "MR volume"
    assert sorted(found["size_voxels"]) == sorted(voxels().shape)
    assert found["size_um"] == pytest.approx(
        [n * step for n, step in zip(found["size_voxels"], found["spacing_um"], strict=True)]
    )
    assert found["size_text"] == "2.2 x 8.6 x 6.7 cm"
    assert found["channels"][0]["has_surface"]
    assert 0 < found["channels"][0]["level"] < voxels().max()
    assert found["choices"]["preset"]["value"] == "mri"
    assert [one["axis"] for one in found["slices"]] == ["z", "y", "x"]
    for one in found["slices"]:
        status, data, headers = client.ask("GET", f"/items/{item}/{one['image']}")
        assert (status, headers["Content-Type"]) == (200, "image/png")
        colors = np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).reshape(-1, 3)
        is_amber = (colors[:, 0] > 200) & (colors[:, 2] < 100)
        assert is_amber.any(), "no contour"


@pytest.mark.parametrize("way", ["folder", "zip"])
def test_dicom_is_understood_as_a_folder_and_in_a_zip(
    client: InboxClient, tmp_path: Path, way: str
) -> None:
    files = dicom(tmp_path)
    item = client.hand_in(files if way == "folder" else [("scan.zip", zipped(files))])
    found = understood(client, item)
    assert found["format"] == "DICOM"
    assert sorted(found["size_voxels"]) == [22, 26, 30]
    assert PATIENT not in json.dumps([found, client.state()])


def test_a_stack_of_tiff_planes_and_an_ome_tiff_are_understood(
    client: InboxClient, tmp_path: Path
) -> None:
    image = write_ome_tiff(tmp_path / "f.ome.tif", f_phantom(2), spacing=(1.0, 0.5, 0.5))
    found = understood(client, client.hand_in([(f"{PATIENT}.ome.tif", image.read_bytes())]))
    assert (found["format"], found["title"]) == ("TIFF", "TIFF volume")
    assert found["spacing_um"] == [0.5, 0.5, 1.0]
    planes = []
    for k, plane in enumerate(f_phantom(2)):
        held = io.BytesIO()
        Image.fromarray(plane).save(held, "TIFF")
        planes.append((f"slides/{PATIENT}_z{k:03d}.tif", held.getvalue()))
    item = client.hand_in(planes)
    assert client.wait(item, "failed")["asks"] == "spacing_um"
    spacing = {"spacing_um": [0.5, 0.25, 2.0]}
    assert client.ask("PUT", f"/items/{item}/choices", spacing)[0] == 202
    found = understood(client, item)
    assert found["spacing_um"] == [0.5, 0.25, 2.0]
    assert found["size_voxels"] == list(f_phantom(2).shape[::-1])
    assert PATIENT not in json.dumps(found)


def test_ome_zarr_is_understood_in_one_file_and_as_a_folder(
    client: InboxClient, tmp_path: Path
) -> None:
    folder = write_ome_zarr(tmp_path / "f.ome.zarr", [f_phantom(2)], channels=[{"label": "CD31"}])
    files = files_below(folder)
    packed = client.hand_in([(f"{PATIENT}.ozx", zipped(files))])
    dropped = client.hand_in([(f"{PATIENT}.ome.zarr/{name}", data) for name, data in files])
    for item in (packed, dropped):
        found = understood(client, item)
        assert found["format"] == "OME-Zarr"
        assert [one["name"] for one in found["channels"]] == ["CD31"]


def test_an_upload_that_breaks_off_twice_goes_on_where_it_was(
    client: InboxClient, tmp_path: Path
) -> None:
    name, data = nifti(tmp_path, "twice.nii.gz")
    item, offset = client.announce([(name, data)]), 0
    for _ in range(2):
        seen, end_s = offset, time.monotonic() + PATIENCE_S
        with socket.create_connection(("127.0.0.1", client.port), timeout=PATIENCE_S) as stream:
            head = (
                f"PATCH /items/{item}/bytes HTTP/1.1\r\nHost: localhost\r\nUpload-Offset: {offset}"
                f"\r\nContent-Length: {len(data) - offset}\r\n\r\n"
            )
            stream.sendall(head.encode() + data[offset : offset + len(data) // 4])
            while offset == seen and time.monotonic() < end_s:
                assert client.announce([(name, data)]) == item  # as a page does after a reload
                _, _, headers = client.ask("HEAD", f"/items/{item}/bytes")
                offset = int(headers["Upload-Offset"])
        assert offset == seen + len(data) // 4
    assert client.ask("PATCH", f"/items/{item}/bytes", b"x", {"Upload-Offset": "1"})[0] == 409
    client.send(item, data[offset:], offset)
    understood(client, item)


def test_files_of_another_patient_by_the_same_names_are_an_upload_of_their_own(
    client: InboxClient,
) -> None:
    def announce(mark: str) -> tuple[int, str]:
        body = {"files": [["scan/01.dcm", 4], ["scan/02.dcm", 4]], "mark": mark}
        status, content, _ = client.ask("POST", "/items", body)
        return status, str(content.get("id", content.get("line")))

    (first, one), (second, other) = announce("a" * 64), announce("b" * 64)
    assert (first, second) == (201, 201)
    assert one != other
    assert announce("a" * 64) == (200, one)
    assert announce("A" * 64) == (400, "mark: expected 64 hexadecimal digits in lower case")


def test_changed_choices_are_read_again_and_a_wrong_one_gives_a_line(
    client: InboxClient, tmp_path: Path
) -> None:
    item = client.hand_in([nifti(tmp_path, "again.nii.gz")])
    understood(client, item)
    path = f"/items/{item}/choices"
    assert client.ask("PUT", path, {"preset": "none", "title": "Left knee"})[0] == 202
    found = understood(client, item)
    assert (found["title"], found["choices"]["preset"]["value"]) == ("Left knee", "none")
    assert client.ask("PUT", path, {"channels": ["7"]})[0] == 202
    state = client.wait(item, "failed")
    assert "7" in state["line"]
    assert "\n" not in state["line"]
    assert client.ask("PUT", path, {"channels": []})[0] == 202
    assert understood(client, item)["title"] == "Left knee"


def test_damaged_files_become_a_line_without_the_name(client: InboxClient) -> None:
    item = client.hand_in([(f"{PATIENT}.nii", b"\x5c\x01\0\0" + bytes(600))])
    line = client.wait(item, "failed")["line"]
    assert line.startswith("specimen.nii")
    assert PATIENT not in line
    assert client.ask("POST", f"/items/{item}/build", {})[0] == 409
    assert client.ask("POST", f"/items/{item}/look")[0] == 409


@pytest.mark.slow
def test_a_patients_scan_is_built_and_only_the_upload_held_their_name(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    files = dicom(tmp_path)
    with serving_inbox(tmp_path, make_inbox_build, is_near=False) as server:
        client, answers = InboxClient(server.port), []
        item = client.hand_in(files)
        answers.append(understood(client, item))
        upload = tmp_path / "box" / item / "upload"
        assert any(PATIENT.encode() in path.read_bytes() for path in upload.rglob("*.*"))
        page = client.command(item, "look")["page"]
        assert client.ask("GET", f"/{page}")[1] == b"<!doctype html>"
        assert client.ask("GET", f"/{page}manifest.json")[1]["specimen"]["name"] == "MR volume"
        client.command(item, "build", {"keep_upload": False})
        state = client.wait(item, "built", "failed")
        assert (state["doing"], state["has_upload"]) == ("built", False)
        assert not upload.exists()
        status, manifest, headers = client.ask("GET", f"/{page}manifest.json")
        assert status == 200
        assert manifest["channels"][0]["tileset"] is not None
        assert headers["Stereocell-Bricks"] == "version=1"
        answers += [manifest, client.state()]
    assert find(tmp_path / "box", [PATIENT, "4711"], {"answers": json.dumps(answers)}) == []
    assert capfd.readouterr() == ("", "")
    assert caplog.text == ""


def test_the_limits_equal_those_that_the_page_receives(client: InboxClient) -> None:
    limits = client.state()["limits"]
    assert limits["bytes"] == LIMITS.bytes
    assert limits["files"] == LIMITS.files
    assert limits["free_bytes"] > 0
    assert client.ask("POST", "/items", {"files": [["a.nii", LIMITS.bytes + 1]]})[0] == 413
    many = [[f"{k}.dcm", 1] for k in range(LIMITS.files + 1)]
    assert client.ask("POST", "/items", {"files": many})[0] == 413


def test_a_websocket_stays_open_without_news_and_a_silent_sender_is_cut_off(
    client: InboxClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(InboxHttp, "body_stall_s", 0.3)
    item = client.announce([("slow.nii", bytes(1000))])
    with connect(f"ws://localhost:{client.port}/events") as events:
        events.recv()
        with socket.create_connection(("127.0.0.1", client.port), timeout=PATIENCE_S) as stream:
            head = f"PATCH /items/{item}/bytes HTTP/1.1\r\nHost: localhost\r\nUpload-Offset: 0\r\n"
            stream.sendall(f"{head}Content-Length: 1000\r\n\r\n".encode() + bytes(400))
            assert stream.recv(100) == b""
        assert client.ask("HEAD", f"/items/{item}/bytes")[2]["Upload-Offset"] == "400"
        assert client.ask("DELETE", f"/items/{item}")[0] == 204
        ids: list[str] = [item]
        while item in ids:  # a message arrives, so the websocket is still open
            ids = [one["id"] for one in json.loads(events.recv(timeout=PATIENCE_S))["items"]]


def test_one_dataset_of_a_file_is_read_and_the_others_can_be_chosen(
    tmp_path: Path,
) -> None:
    path = tmp_path / "several.h5"
    with h5py.File(path, "w") as file:
        for name, values in {"label": f_phantom(1) // 7000, "raw": f_phantom(1)}.items():
            dataset = file.create_dataset(f"volumes/{name}", data=values.astype(np.uint16))
            dataset.attrs["element_size_um"] = (1.0, 0.5, 0.5)
    make = FakeBuilds()
    with serving_inbox(tmp_path, make) as server:
        client = InboxClient(server.port)
        item = client.hand_in([("several.h5", path.read_bytes())])
        assert client.wait(item, "understood", "failed")["line"] == ""
        understood = client.ask("GET", f"/items/{item}/understood")[1]
        series = understood["choices"]["series"]
        assert series["value"] == "2"
        assert [one["text"].split()[0] for one in series["options"]] == [
            "/volumes/label",
            "/volumes/raw",
        ]
        assert understood["channels"][0]["has_surface"]
        assert client.ask("PUT", f"/items/{item}/choices", {"series": "3"})[0] == 202
        assert client.wait(item, "failed")["line"] == "series: found 3, expected 1 to 2"
        assert client.ask("PUT", f"/items/{item}/choices", {"series": "2"})[0] == 202
        client.wait(item, "understood")
        client.command(item, "build")
        end_build(server, item)
        client.wait(item, "built")
    ((source, choices, _),) = make.asked
    assert source.endswith("specimen.h5:/volumes/raw")
    assert choices.series == ""


@pytest.mark.parametrize(
    ("name", "is_shown"),
    [
        ("mri.zip", True),
        ("CT_head_2.nii", True),
        ("Smith.zip", False),
        ("mri_smith.nii", False),
        ("Möller.nii", False),
        ("2015-01-30.nii", False),
        ("max.nii", False),
    ],
)
def test_a_name_is_left_out_of_lines_unless_it_is_words_of_the_program(
    tmp_path: Path, name: str, *, is_shown: bool
) -> None:
    item = Item("0" * 16, tmp_path, 0.0, is_local=True)
    item.upload = Upload.create(tmp_path / "upload", Announced((name,), (1,)))
    stem = name.partition(".")[0]
    shown = stem if is_shown else "..."
    assert without_identity(item, f"{stem}: preset mri") == f"{shown}: preset mri"


def test_an_item_that_waits_for_the_one_before_it_says_so(tmp_path: Path) -> None:
    with serving_inbox(tmp_path) as server:
        client = InboxClient(server.port)
        path = tmp_path / "a.nii"
        write_nifti(path, np.eye(4), f_phantom(1).astype(np.int16))
        with server.inbox.reader._busy:  # the first one is being read as long as this lasts
            first, second = (
                client.hand_in([(name, path.read_bytes())]) for name in ("a.nii", "b.nii")
            )
            end_s = time.monotonic() + PATIENCE_S
            while not client.item(second)["waits"] or client.item(first)["waits"]:
                assert time.monotonic() < end_s
                time.sleep(0.02)
        assert client.wait(second, "understood")["waits"] is False


def test_an_address_is_left_out_of_lines_and_the_forms_that_are_expected_stay(
    tmp_path: Path,
) -> None:
    item = Item("0" * 16, tmp_path, 0.0, is_local=True)
    host = "https://images.example/webclient/"
    item.upload = Upload.create(tmp_path / "upload", Announced(address=f"{host}?show=51"))
    line = f"{host}?show=51: another form, expected {host}?show=image-ID or {host}img/ID/"
    expected = f"the address: another form, expected {host}?show=image-ID or {host}img/ID/"
    assert without_identity(item, line) == expected
    assert without_identity(item, f"{host}0/.zarray: missing") == "the address/0/.zarray: missing"
