"""A page that is published again: only for the same specimen; files that somebody edited stay."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from stereocell.publish.targets import FolderTarget
from stereocell.verify.formats import check
from support.plain_bundle import FILES, below, write

LIST = "stereocell-published.json"
Run = Callable[..., tuple[int, dict[str, Any], str]]


@pytest.fixture
def bundle(out: Path, tmp_path: Path) -> Path:
    """A copy of the bundle outside of the build that made it."""
    return shutil.copytree(out / "bundle", tmp_path / "a bundle")


@pytest.fixture
def site(bundle: Path, run: Run, tmp_path: Path) -> Path:
    """The folder into which the bundle has been published."""
    assert run(bundle, tmp_path / "site")[0] == 0
    return tmp_path / "site"


@pytest.mark.parametrize(
    ("fingerprint", "words"), [("fedc" * 16, "(fedcfedcfedc)"), ("", "(its source is not known)")]
)
def test_bundle_of_another_source_does_not_replace_a_page_of_the_same_name(
    bundle: Path, site: Path, run: Run, tmp_path: Path, fingerprint: str, words: str
) -> None:
    write(tmp_path / "other", FILES, fingerprint=fingerprint)
    other, there = tmp_path / "other" / "bundle", below(site)
    code, _, printed = run(other, site)
    assert code == 1
    assert "holds a published page of 'bbb" in printed
    assert "(0123456789ab), expected one of 'bbb" in printed
    assert f"{words}: choose another place, or --force replaces it" in printed
    assert below(site) == there
    assert run(other, site, "--force")[0] == 0
    code, _, printed = run(
        bundle, site
    )  # the page is now of the other source, or of an unknown one
    assert (code, words in printed) == (1, True)


@pytest.mark.parametrize("content", [b"mine", FILES["index.html"].replace(b"html", b"HTML")])
@pytest.mark.parametrize("has_new_bundle", [True, False])
def test_file_of_a_page_that_was_edited_stays_without_force(
    out: Path, site: Path, run: Run, content: bytes, has_new_bundle: bool
) -> None:
    (site / "index.html").write_bytes(
        content
    )  # the first content has another size, the second the same
    if has_new_bundle:
        write(out, {"index.html": b"<!doctype html>new"})
    there = below(site)
    for _ in range(2):  # a refused run does not change the outcome of a later one
        code, _, printed = run(out / "bundle", site)
        assert code == 1
        assert "index.html: " in printed
        assert "changed since it was published" in printed
        assert "elsewhere and remove it there, or --force replaces it" in printed
        assert below(site) == there
    assert run(out / "bundle", site, "--force")[0] == 0
    assert (site / "index.html").read_bytes() == (out / "bundle/index.html").read_bytes()
    assert run(out / "bundle", site)[1]["uploaded"] == 0


def test_edited_file_that_the_new_bundle_lacks_is_not_removed_without_force(
    out: Path, site: Path, run: Run
) -> None:
    (site / "sw.js").write_bytes(b"mine")
    (out / "bundle/sw.js").unlink()
    write(out, {})
    code, _, printed = run(out / "bundle", site)
    assert (code, "sw.js: changed since it was published" in printed) == (1, True)
    assert (site / "sw.js").read_bytes() == b"mine"
    assert run(out / "bundle", site, "--force")[0] == 0
    assert not (site / "sw.js").exists()


def test_a_file_that_is_damaged_on_its_way_is_uploaded_again(
    out: Path, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put = FolderTarget.write

    def spoils(self: FolderTarget, path: str, content: bytes) -> None:
        put(self, path, b"S" + content[1:] if path == "sw.js" else content)

    with monkeypatch.context() as patch:
        patch.setattr(FolderTarget, "write", spoils)
        code, _, printed = run(out, tmp_path / "site")
    assert (code, "run the same command to upload it again" in printed) == (1, True)
    assert run(out, tmp_path / "site")[1]["uploaded"] == 1


def _raise_bounds(place: Path) -> None:
    """Change one digit of a number in the manifest, which its schema can't notice."""
    file = place / "manifest.json"
    text = file.read_text("utf-8")
    file.write_text(text.replace('"max": [\n    1', '"max": [\n    9'))
    assert file.read_text("utf-8") != text


def test_manifest_that_was_edited_is_named_wherever_the_bundle_lies(
    bundle: Path, site: Path, run: Run, tmp_path: Path
) -> None:
    for place in (bundle, site):
        _raise_bounds(place)
        code, _, printed = run(place, tmp_path / "copy")
        assert code == 1
        assert (
            f"{place / 'manifest.json'}: damaged or changed by hand: its content has SHA" in printed
        )
        assert "run `stereocell bundle " in printed
        (fault,) = [line.detail for line in check(place) if line.name == "manifest"]
        assert "manifest.json: damaged or changed by hand" in fault
    assert not (tmp_path / "copy").exists()


def test_manifest_of_an_earlier_version_or_of_another_list_is_not_published(
    bundle: Path, out: Path, run: Run, tmp_path: Path
) -> None:
    file = bundle / "manifest.json"
    content = json.loads(file.read_text("utf-8"))
    del content["sha256"]
    file.write_text(json.dumps(content))
    assert "manifest.json: found no hash of its content" in run(bundle, tmp_path / "site")[2]
    write(out, {"sw.js": b"other;"})
    shutil.copy(out / "bundle/manifest.json", file)
    printed = run(bundle, tmp_path / "site")[2]
    assert "manifest.json: damaged, names another files.json: run `stereocell bundle " in printed
    file.unlink()
    assert "manifest.json is missing" in run(bundle, tmp_path / "site")[2]
    assert not (tmp_path / "site").exists()
