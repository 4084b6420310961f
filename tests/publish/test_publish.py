"""A bundle at a host: files that are uploaded, removed or refused, and the host's answers."""

import hashlib
import http.server
import json
import threading
import urllib.request
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import pytest

from stereocell.cli.__main__ import main
from stereocell.engine.run import Engine
from stereocell.publish.targets import AGAIN, FOREVER, FolderTarget
from support.bundles import write_bundle, write_tiles
from support.object_store import ObjectStore, serving_bucket
from support.plain_bundle import FILES, below, write

LIST = "stereocell-published.json"
Run = Callable[..., tuple[int, dict[str, Any], str]]


@pytest.mark.slow
def test_a_folder_gets_the_bundle_and_later_only_the_changed_files(
    out: Path, run: Run, tmp_path: Path
) -> None:
    site = tmp_path / "a site"
    site.mkdir()
    (site / "CNAME").write_text("me.example")
    code, first, _ = run(out, site)
    assert code == 0
    there = below(site)
    assert {path: there[path] for path in FILES} == FILES
    assert {"files.json", "manifest.json", "manifest.json.gz", LIST, "CNAME"} < there.keys()
    assert (first["uploaded"], first["removed"]) == (len(there) - 2, 0)

    _, again, _ = run(out, site)
    assert (again["uploaded"], again["uploaded_bytes"], again["removed"]) == (0, 0, 0)
    assert below(site) == there

    (out / "bundle/channels/CD31/it's 1.glb").unlink()
    write(out, {"volumes/r0_c0.ktx2": b"other"})
    _, third, _ = run(out, site)
    after = below(site)
    assert third["removed"] == 1
    assert not (site / "channels").exists()
    assert {path for path in after if after[path] != there[path]} == {
        *("volumes/r0_c0.ktx2", "files.json", "files.json.gz", LIST),
        *("manifest.json", "manifest.json.gz"),
    }
    assert third["uploaded"] == 5
    assert after["CNAME"] == b"me.example"


@pytest.mark.slow
def test_every_file_of_a_bundle_is_published(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The manifest is not in the list of files, but no page opens without it."""
    viewer = tmp_path / "dist"
    viewer.mkdir()
    (viewer / "index.html").write_text("<!doctype html>")
    out, site = tmp_path / "out", tmp_path / "site"
    out.mkdir()
    write_bundle(write_tiles(tmp_path / "stage"), out / "bundle", viewer, engine=Engine(0))
    order: list[str] = []
    put = FolderTarget.write

    def writes(self: FolderTarget, path: str, content: bytes) -> None:
        order.append(path)
        put(self, path, content)

    monkeypatch.setattr(FolderTarget, "write", writes)
    assert run(out, site)[0] == 0
    made, there = below(out / "bundle"), below(site)
    assert {path: there.get(path) for path in made} == made
    assert order[-4:] == ["files.json", "manifest.json", "index.html", LIST]


def test_files_of_others_stay_and_end_the_run_before_it_writes(
    out: Path, run: Run, tmp_path: Path
) -> None:
    site = tmp_path / "site"
    site.mkdir()
    (site / "index.html").write_text("mine")
    code, _, printed = run(out, site)
    assert code == 1
    assert "site/index.html: this file exists and was not uploaded by this command" in printed
    assert below(site) == {"index.html": b"mine"}


def test_a_killed_run_goes_on(
    out: Path, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site = tmp_path / "site"
    put, count = FolderTarget.write, []

    def fails(self: FolderTarget, path: str, content: bytes) -> None:
        count.append(path)
        if len(count) > 4:
            raise KeyboardInterrupt
        put(self, path, content)

    with monkeypatch.context() as patch:
        patch.setattr(FolderTarget, "write", fails)
        assert main(["publish", str(out), str(site)]) == 130
    half = below(site)
    assert "index.html" not in half
    assert len(half) > 1
    assert run(out, site)[0] == 0
    there = below(site)
    assert {path: there[path] for path in FILES} == FILES


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"{", "damaged"),
        (b"[]", "damaged"),
        (b'{"format": "other", "version": 1, "files": {}}', "damaged"),
        (
            b'{"format": "stereocell-published", "version": 1, "files": {"../secret": null}}',
            "damaged",
        ),
        (
            b'{"format": "stereocell-published", "version": 1, "files": {"/etc/x": null}}',
            "damaged",
        ),
    ],
)
def test_a_damaged_list_of_published_files_removes_nothing(
    out: Path, run: Run, tmp_path: Path, content: bytes, words: str
) -> None:
    site = tmp_path / "site"
    site.mkdir()
    (tmp_path / "secret").write_text("kept")
    (site / LIST).write_bytes(content)
    code, _, printed = run(out, site)
    assert code == 1
    assert f"{LIST}: {words}" in printed
    assert (tmp_path / "secret").exists()
    assert below(site) == {LIST: content}


def test_links_in_the_target_are_not_followed(out: Path, run: Run, tmp_path: Path) -> None:
    site, other = tmp_path / "site", tmp_path / "other"
    site.mkdir()
    other.mkdir()
    (site / "assets").symlink_to(other)
    code, _, printed = run(out, site)
    assert code == 1
    assert "leads to" in printed
    assert not below(other)


def test_a_damaged_bundle_is_not_published(out: Path, run: Run, tmp_path: Path) -> None:
    (out / "bundle/sw.js").write_bytes(b"Self;")
    code, _, printed = run(out, tmp_path / "site")
    assert code == 1
    assert f"bundle/sw.js: damaged: run `stereocell bundle '{out}'` first" in printed
    assert not (tmp_path / "site").exists()
    assert run(tmp_path / "nothing", tmp_path / "site")[0] == 1


def test_a_target_inside_out_or_on_a_web_host_is_refused(out: Path, run: Run) -> None:
    assert "inside OUT" in run(out, out / "bundle" / "x")[2]
    assert "files can't be written over http" in run(out, "https://me.example/x")[2]
    assert run(out, "nowhere://x/y")[0] == 1
    code, _, printed = run(out, out.parent / "site", "--url", "file:///etc")
    assert (code, "expected an address such as https://" in printed) == (2, True)


@pytest.fixture
def host(tmp_path: Path) -> Iterator[str]:
    """A web server of the folder `site`."""
    (tmp_path / "site").mkdir()
    handler = partial(_Quiet, directory=str(tmp_path / "site"))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


class _Quiet(http.server.SimpleHTTPRequestHandler):
    extensions_map: ClassVar[dict[str, str]] = {
        **http.server.SimpleHTTPRequestHandler.extensions_map,
        ".js": "text/javascript",
    }

    def log_message(self, *_: Any) -> None:
        pass


@pytest.mark.slow
def test_every_file_is_fetched_as_browsers_do(
    out: Path, run: Run, host: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site = tmp_path / "site" / "my specimen"
    url = f"{host}/my%20specimen"
    code, done, printed = run(out, site, "--url", url)
    assert (code, done["address"]) == (0, f"{url}/"), printed
    (site / "volumes/r0_c0.ktx2").write_bytes(bytes(256 * 40))  # other bytes of the same number
    code, _, printed = run(out, site, "--url", url)
    assert code == 1
    assert f"{url}/volumes/r0_c0.ktx2: found different bytes" in printed
    assert "changed since it was published" in printed
    code, mended, _ = run(out, site, "--url", url, "--force")
    assert (code, mended["uploaded"]) == (0, 1)
    code, _, printed = run(out, site, "--url", f"{host}/elsewhere")
    assert code == 1
    assert "the host answered 404" in printed
    monkeypatch.setitem(_Quiet.extensions_map, ".js", "text/plain")
    code, _, printed = run(out, site, "--url", url)
    assert code == 1
    assert "found the type text/plain, which browsers don't accept as text/javascript" in printed


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ObjectStore]:
    with serving_bucket(tmp_path_factory.mktemp("objects")) as store:
        yield store


@pytest.mark.slow
def test_an_object_store_gets_types_and_a_second_run_nothing(
    out: Path, run: Run, store: ObjectStore
) -> None:
    files = store.files()
    files.pipe_file("bucket/mine/notes.txt", b"mine")
    code, _, printed = run(out, "s3://bucket/mine")
    assert code == 1
    assert "s3://bucket/mine: holds something else (notes.txt), expected nothing or a" in printed
    code, done, printed = run(out, "s3://bucket/mine", "--force")
    assert code == 0, printed
    # a folder of S3 has no page
    assert done["address"] == f"{store.endpoint}/bucket/mine/index.html"
    with urllib.request.urlopen(done["address"]) as page:
        assert page.read() == FILES["index.html"]
    for path, content in FILES.items():
        assert files.cat_file(f"bucket/mine/{path}") == content
    about = {
        path: files.call_s3("head_object", Bucket="bucket", Key=f"mine/{path}") for path in FILES
    }
    assert about["index.html"]["ContentType"] == "text/html; charset=utf-8"
    assert about["index.html"]["CacheControl"] == AGAIN
    assert about["assets/page-abc123.js"]["CacheControl"] == FOREVER
    assert about["volumes/r0_c0.ktx2"]["ContentType"] == "image/ktx2"

    _, again, _ = run(out, "s3://bucket/mine")
    assert (again["uploaded"], again["uploaded_bytes"], again["removed"]) == (0, 0, 0)

    (out / "bundle/channels/CD31/it's 1.glb").unlink()
    write(out, {"index.html": b"<!doctype html>other"})
    _, third, _ = run(out, "s3://bucket/mine")
    # and the list and the manifest, with their packed copies
    assert (third["uploaded"], third["removed"]) == (5, 1)
    assert not files.exists("bucket/mine/channels/CD31/it's 1.glb")
    assert files.cat_file("bucket/mine/notes.txt") == b"mine"
    listed = json.loads(files.cat_file(f"bucket/mine/{LIST}"))["files"]
    assert listed["index.html"]["sha256"] == hashlib.sha256(b"<!doctype html>other").hexdigest()


@pytest.mark.slow
def test_any_file_system_of_fsspec_will_do(out: Path, run: Run) -> None:
    import fsspec

    code, done, printed = run(out, "memory://a site")
    assert code == 0, printed
    assert done["address"] is None
    files = fsspec.filesystem("memory")
    assert files.cat_file("/a site/volumes/r0_c0.ktx2") == FILES["volumes/r0_c0.ktx2"]
    assert run(out, "memory://a site")[1]["uploaded"] == 0
