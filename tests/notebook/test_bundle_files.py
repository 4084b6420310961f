"""A page in a notebook gets files of the bundle, whole or in part, and no others."""

import base64
import hashlib
import re
import shutil

import pytest

from stereocell.model.errors import OutputError
from stereocell.notebook import page
from stereocell.notebook.bundle_files import NotebookBundle


@pytest.fixture
def files(bundle):
    return NotebookBundle(bundle)


def test_a_file_is_sent_whole_or_in_part_as_a_web_host_does(bundle, files):
    whole = (bundle / "manifest.json").read_bytes()
    assert files.answer("manifest.json") == (200, whole)
    assert files.answer("manifest.json", header="bytes=10-19") == (206, whole[10:20])
    assert files.answer("manifest.json", header="bytes=10-") == (206, whole[10:])
    assert files.answer("manifest.json", header=f"bytes={len(whole)}-") == (416, b"")
    assert files.answer("manifest.json", header="lines=1-2") == (200, whole)


@pytest.mark.parametrize(
    "path",
    [
        "../stage/stage.usda",
        "channels/../../stage/stage.usda",
        "/etc/passwd",
        "//etc/passwd",
        "",
        ".",
        "channels",
        "channels/CD31/../CD31/tileset.json",
        "manifest.json\0",
        "C:\\Windows\\win.ini",
        "x" * 5000,
        None,
        5,
        ["manifest.json"],
    ],
)
def test_paths_that_are_no_files_of_the_bundle_are_not_found(files, path):
    assert files.answer(path) == (404, b"")


def test_a_link_out_of_the_bundle_is_not_followed(bundle, tmp_path):
    shutil.copytree(bundle, tmp_path / "bundle")
    secret = tmp_path / "secret"
    secret.write_text("private")
    name = next((tmp_path / "bundle").rglob("*.glb"))
    name.unlink()
    name.symlink_to(secret)
    files = NotebookBundle(tmp_path / "bundle")
    assert files.answer(name.relative_to(tmp_path / "bundle").as_posix()) == (404, b"")
    gone = next((tmp_path / "bundle").rglob("*.ktx2"))
    gone.unlink()
    assert files.answer(gone.relative_to(tmp_path / "bundle").as_posix()) == (404, b"")


def test_lights_come_from_the_viewer_if_a_bundle_has_no_page(files, tmp_path, monkeypatch):
    (tmp_path / "environments").mkdir()
    (tmp_path / "environments" / "studio.hdr").write_bytes(b"light")
    monkeypatch.setattr("stereocell.notebook.bundle_files.find_page", lambda: tmp_path)
    assert files.answer("environments/studio.hdr") == (200, b"light")
    assert files.answer("environments/other.hdr") == (404, b"")


def test_a_folder_that_is_not_a_bundle_is_refused(bundle, tmp_path):
    with pytest.raises(OutputError, match=r"manifest\.json"):
        NotebookBundle(tmp_path)
    shutil.copytree(bundle, tmp_path / "bundle")
    (tmp_path / "bundle" / "files.json").write_text("{}")
    with pytest.raises(OutputError, match="damaged"):
        NotebookBundle(tmp_path / "bundle")


def test_the_document_runs_its_own_script_alone_and_reaches_no_host():
    text = page.document()
    (script,) = re.findall(r"<script>(.*)</script>", text, re.S)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)
    assert policy
    assert f"'sha256-{digest}'" in policy[1]
    assert "http" not in policy[1]
    assert "'self'" not in policy[1]
    assert "unsafe-inline" not in policy[1]
