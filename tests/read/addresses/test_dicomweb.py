"""DICOMweb: QIDO-RS and WADO-RS of a small server.

The answers follow DICOM PS3.18 (10.4 retrieve, 10.6 search) and PS3.18 F (the JSON model); none was
recorded. pydicom writes the instances.
"""

import json
import logging
import os
import stat
import subprocess
import sys
from pathlib import Path

import pydicom
import pytest

from stereocell import api, read
from stereocell.cli.__main__ import main
from stereocell.model.errors import SourceError, StereoCellError, UsageError
from stereocell.planning.settings import Settings
from stereocell.planning.settle import settle
from stereocell.read.addresses import dicomweb
from stereocell.read.addresses.resolve import resolve
from support.dicom_series import grid, write_series
from support.identity_search import find
from support.recorded_service import Answer, Service

STUDY, SERIES = "1.2.840.99.1", "1.2.840.99.1.7"
SECRET = "s3cr3t-t0ken.with-dots_~+/=="
EDGE = "f3b1e6d0-edge"
NAME = "Doe^Jane"


def row(uid: str = SERIES, modality: str = "MR", count: object = 8) -> dict[str, object]:
    return {
        "00080060": {"vr": "CS", "Value": [modality]},
        "0020000D": {"vr": "UI", "Value": [STUDY]},
        "0020000E": {"vr": "UI", "Value": [uid]},
        "00201209": {"vr": "IS", "Value": [count]},
        "00100010": {"vr": "PN", "Value": [{"Alphabetic": NAME}]},
    }


def multipart(parts: list[bytes], header: str = "Content-Type: application/dicom") -> bytes:
    heads = (f"\r\n--{EDGE}\r\n{header}\r\n\r\n".encode() + part for part in parts)
    return b"".join(heads) + f"\r\n--{EDGE}--\r\n".encode()


TYPE = f'multipart/related; type="application/dicom"; boundary="{EDGE}"'


@pytest.fixture
def instances(tmp_path: Path) -> list[bytes]:
    """Eight slices with a name in their headers."""

    def named(ds: pydicom.Dataset) -> None:
        ds.PatientName, ds.PatientID, ds.StudyInstanceUID = NAME, "MRN-4711", STUDY

    folder = tmp_path / "written"
    folder.mkdir()
    paths = write_series(
        folder, grid("axial", (8, 20, 24)), (8, 20, 24), series=SERIES, change=named
    )
    return [path.read_bytes() for path in paths]


@pytest.fixture
def pacs(service: Service, instances: list[bytes]) -> Service:
    """A server that has one series."""
    service.json(f"/web/studies/{STUDY}/series", [row()])
    series = f"/web/studies/{STUDY}/series/{SERIES}"
    service.answers[series] = Answer(multipart(instances), headers={"Content-Type": TYPE})
    return service


def address(pacs: Service, *, series: str | None = SERIES) -> str:
    return f"{pacs.url}/web/studies/{STUDY}" + (f"/series/{series}" if series else "")


def test_a_series_is_read_like_its_files(pacs: Service, tmp_path: Path) -> None:
    dataset, files = api.open_volume(address(pacs)), read.open(tmp_path / "written")
    assert dataset.fingerprint == files.fingerprint
    assert dataset.levels == files.levels
    accepts = [one.headers["Accept"] for one in pacs.asked]
    assert accepts[0] == "application/dicom+json"
    assert accepts[1].startswith('multipart/related; type="application/dicom"')


def test_a_plan_reports_the_source_and_nothing_about_the_patient(pacs: Service) -> None:
    plan = settle(address(pacs), Settings())
    (note,) = [note for note in plan.notes if note.startswith("DICOMweb")]
    assert "one series (MR, 8 instances)" in note
    assert "removed at the end" in note
    for word in (STUDY, "Doe", "4711", pacs.url):
        assert word not in str(plan)


def test_the_folder_is_private_and_its_files_have_plain_names(pacs: Service) -> None:
    folder = Path(resolve(address(pacs)).source)
    assert (
        stat.S_IMODE(folder.stat().st_mode) == stat.S_IMODE(folder.parent.stat().st_mode) == 0o700
    )
    assert sorted(os.listdir(folder)) == [f"{n:06d}.dcm" for n in range(1, 9)]
    assert STUDY not in str(folder)


def test_a_series_is_fetched_once(pacs: Service) -> None:
    assert resolve(address(pacs)) == resolve(address(pacs))
    assert len(pacs.asked) == 2


@pytest.mark.slow
def test_the_folder_is_removed_at_the_end(pacs: Service) -> None:
    code = (
        "import sys; from stereocell.read.addresses.resolve import resolve;"
        "print(resolve(sys.argv[1]).source)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, address(pacs)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip().endswith("dicom")
    assert not Path(done.stdout.strip()).parent.exists()


def test_a_series_that_fails_leaves_no_files(
    pacs: Service, instances: list[bytes], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "scratch"))
    (tmp_path / "scratch").mkdir()
    path = f"/web/studies/{STUDY}/series/{SERIES}"
    pacs.answers[path] = Answer(multipart(instances)[:-2000], headers={"Content-Type": TYPE})
    with pytest.raises(SourceError, match="ends within a part"):
        resolve(address(pacs))
    assert os.listdir(tmp_path / "scratch") == []


def test_the_largest_series_of_images_in_a_study_is_read(pacs: Service) -> None:
    rows = [row("1.9", "SR", 900), row("1.8", "MR", 3), row(), row("1.7", "SEG", 50)]
    pacs.json(f"/web/studies/{STUDY}/series", rows)
    found = resolve(address(pacs, series=None))
    assert len(os.listdir(found.source)) == 8
    assert "2 series of images (MR 3, MR 8 instances)" in found.notes[1]
    assert "1.8" not in str(found.notes)


def test_a_count_that_differs_is_noted(pacs: Service) -> None:
    pacs.json(f"/web/studies/{STUDY}/series", [row(count="9")])
    assert "counts 9 instances in the series and has sent 8" in resolve(address(pacs)).notes[1]


@pytest.mark.parametrize("command", ["plan", pytest.param("build", marks=pytest.mark.slow)])
def test_no_command_leaves_the_identity_behind(
    command: str,
    pacs: Service,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv(dicomweb.TOKEN, SECRET)
    caplog.set_level(logging.DEBUG)
    out = tmp_path / "out"
    assert main([command, address(pacs), "-o", str(out)]) == 0
    words = [NAME, "MRN-4711", STUDY, SECRET]
    assert find(out, words) == []
    printed = "".join(capsys.readouterr()) + caplog.text
    assert [word for word in words if word in printed] == []
    assert "DICOMweb: one series" in (out / "plan.json").read_text("utf-8")


def test_the_series_of_an_address_are_listed(
    pacs: Service, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", address(pacs), "-o", str(tmp_path / "out"), "--series", "list"]) == 0
    assert "MR" in capsys.readouterr().out


# The token


def test_the_token_of_the_environment_is_sent(
    pacs: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(dicomweb.TOKEN, f"{SECRET}\n")
    resolve(address(pacs))
    assert {one.headers["Authorization"] for one in pacs.asked} == {f"Bearer {SECRET}"}


def test_without_a_token_none_is_sent(pacs: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(dicomweb.TOKEN, raising=False)
    resolve(address(pacs))
    assert not any("Authorization" in one.headers for one in pacs.asked)


def test_the_token_does_not_follow_a_redirect(
    pacs: Service, other_service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(dicomweb.TOKEN, SECRET)
    monkeypatch.setattr(
        "stereocell.read.addresses.web_client.public_numbers_of", lambda a: ["127.0.0.1"]
    )
    pacs.redirect(f"/web/studies/{STUDY}/series", f"{other_service.url}/series")
    other_service.json("/series", [row()])
    resolve(address(pacs))
    assert len(other_service.asked) == 1
    assert SECRET not in str(other_service.asked)


@pytest.mark.parametrize("token", ["two words", "line\r\nX-Evil: 1", "ä", "a\0b"[:1] + "\x7f"])
def test_a_token_that_does_not_fit_a_header_is_refused_and_not_shown(
    pacs: Service, monkeypatch: pytest.MonkeyPatch, token: str
) -> None:
    monkeypatch.setenv(dicomweb.TOKEN, token)
    with pytest.raises(UsageError, match=dicomweb.TOKEN) as caught:
        resolve(address(pacs))
    assert token not in str(caught.value)
    assert pacs.asked == []


def test_a_token_is_not_sent_unencrypted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(dicomweb.TOKEN, SECRET)
    monkeypatch.setattr(dicomweb, "numbers_of", lambda address: ["10.1.2.3"])
    with pytest.raises(UsageError, match="expected https://") as caught:
        resolve(f"http://pacs.example/studies/{STUDY}/series/{SERIES}")
    assert SECRET not in str(caught.value)


@pytest.mark.parametrize("status", [401, 403])
def test_a_required_login_is_reported(
    pacs: Service, monkeypatch: pytest.MonkeyPatch, status: int
) -> None:
    monkeypatch.delenv(dicomweb.TOKEN, raising=False)
    pacs.json(f"/web/studies/{STUDY}/series", [], status=status)
    with pytest.raises(SourceError, match=f"HTTP {status}.*{dicomweb.TOKEN}"):
        resolve(address(pacs))
    monkeypatch.setenv(dicomweb.TOKEN, SECRET)
    with pytest.raises(SourceError, match="another token") as caught:
        resolve(address(pacs))
    assert SECRET not in str(caught.value)


# Bad answers


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (b"", "does not have the series"),
        (b"[]", "does not have the series"),
        (b'{"a": 1}', "found dict, expected a list"),
        (b'"series"', "found str"),
        (b"[1, 2]", "without a UID"),
        (b"[{}]", "without a UID"),
        (b'[{"0020000E": {"vr": "UI", "Value": ["../../etc"]}}]', "without a UID"),
        (b'[{"0020000E": {"Value": "1.2"}}]', "without a UID"),
        (b'[{"0020000E": []}]', "without a UID"),
        (json.dumps([row("1.2.3")]).encode(), "does not have the series"),
        (b"<html>log in</html>", "web page"),
        (b"[", "damaged JSON"),
    ],
)
def test_a_bad_search_is_refused_in_one_line(pacs: Service, answer: bytes, words: str) -> None:
    pacs.put(f"/web/studies/{STUDY}/series", answer)
    with pytest.raises(SourceError, match=words) as caught:
        resolve(address(pacs))
    assert STUDY not in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("body", "content_type", "words"),
    [
        (b"<html>log in</html>", "text/html", "found a web page"),
        (b"", "", "found 'no type'"),
        (b"", "application/dicom", "application/dicom"),
        (multipart([]), TYPE, "no instance|ends within"),
        (multipart([b"DICM"]), TYPE, "instance 1.*expected a DICOM file"),
        (multipart([b"<html>no</html>"]), TYPE, "instance 1.*a web page"),
        (multipart([bytes(128) + b"DICM"]), TYPE.replace(EDGE, "other"), "ends within a part"),
        (b"", 'multipart/related; type="application/dicom"', "without a boundary"),
    ],
)
def test_bad_instances_are_refused_in_one_line(
    pacs: Service, body: bytes, content_type: str, words: str
) -> None:
    path = f"/web/studies/{STUDY}/series/{SERIES}"
    pacs.answers[path] = Answer(body, headers={"Content-Type": content_type})
    with pytest.raises(SourceError, match=words) as caught:
        resolve(address(pacs))
    assert STUDY not in str(caught.value)


def test_a_series_that_is_too_large_is_refused(
    pacs: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dicomweb, "SERIES_BYTES", 3000)
    with pytest.raises(SourceError, match="a larger series"):
        resolve(address(pacs))
    monkeypatch.setattr(dicomweb, "SERIES_BYTES", 1 << 30)
    monkeypatch.setattr(dicomweb, "MAX_INSTANCES", 7)
    with pytest.raises(SourceError, match="at most 7 instances"):
        resolve(address(pacs))


def test_names_in_an_answer_are_not_used(pacs: Service, instances: list[bytes]) -> None:
    header = (
        "Content-Location: ../../../../tmp/evil.dcm\r\n"
        'Content-Disposition: attachment; filename="/etc/evil"'
    )
    body = multipart(instances, header)
    path = f"/web/studies/{STUDY}/series/{SERIES}"
    pacs.answers[path] = Answer(body, headers={"Content-Type": TYPE})
    folder = Path(resolve(address(pacs)).source)
    assert sorted(os.listdir(folder)) == [f"{n:06d}.dcm" for n in range(1, 9)]
    assert sorted(os.listdir(folder.parent)) == [".lock", "dicom"]


# Forms


@pytest.mark.parametrize(
    "tail",
    [
        f"/studies/{STUDY}/series/{SERIES}/instances/1.2.3",
        f"/studies/{STUDY}/series/{SERIES}/instances/1.2.3/frames/1",
        f"/studies/{STUDY}/series/{SERIES}/metadata",
        f"/studies/{STUDY}/rendered",
        f"/studies/{STUDY}?viewport=1,1",
        f"/series?StudyInstanceUID={STUDY}",
        f"/viewer?StudyInstanceUIDs={STUDY}",
    ],
)
def test_an_unknown_form_is_refused_with_the_known_ones(tail: str) -> None:
    with pytest.raises(UsageError, match=r"expected https://HOST/\.\.\./studies/UID") as caught:
        resolve(f"https://pacs.example/web{tail}")
    assert STUDY not in str(caught.value)


def test_a_uid_that_is_too_long_is_refused() -> None:
    with pytest.raises(StereoCellError, match="more than 64"):
        resolve(f"https://pacs.example/studies/1.{'2' * 63}")


@pytest.mark.parametrize(
    "other",
    [
        "https://host.example/studies/S-BIAD634/a.ome.zarr",
        f"https://host.example/studies/{STUDY}/image.ome.zarr",
        "https://host.example/my/studies/mouse/",
    ],
)
def test_other_addresses_are_not_changed(other: str) -> None:
    assert resolve(other).source == other
