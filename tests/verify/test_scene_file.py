"""`stereocell check scene.html`: a sound scene passes, and each damage is named in one line."""

import base64
import gzip
import hashlib
import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from stereocell.bundle.scene_blocks import FILE, block
from stereocell.cli.__main__ import main
from stereocell.engine.run import Engine
from stereocell.export.scene import write_scene
from support.bundles import write_bundle, write_tiles
from support.small_viewer import use_small_viewer

LUT = "luts/CD31.ktx2"
VIEW = "#v=1&c=CD31&eye=0,0,1.8,0,0,0"
HOST = "https://host.example/"


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The document of a scene."""
    folder = tmp_path_factory.mktemp("scene")
    stage = write_tiles(folder / "stage")
    write_bundle(stage, folder / "bundle", None, engine=Engine(0))
    with pytest.MonkeyPatch.context() as patch:
        use_small_viewer(folder / "dist", patch)
        write_scene(folder / "bundle", folder / "s.html", view=VIEW)
    return (folder / "s.html").read_text("utf-8")


def failures(document: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Return the lines of the checks that fail, and check the exit code."""
    file = folder / "s.html"
    file.write_text(document, "utf-8")
    code = main(["check", str(file)])
    lines = capsys.readouterr().out.splitlines()
    failed = [line for line in lines if line.startswith("FAIL")]
    assert code == (1 if failed else 0)
    assert lines
    return failed


def with_block(scene: str, path: str, name: str, data: bytes, is_packed: bool = False) -> str:
    """Return a scene in which another block replaces a file's, or none if `name` is empty.

    A block is a script element of the page; it holds one file of the bundle.
    """
    found = re.search(rf' *<script [^>]*data-file="{re.escape(path)}".*?</script>\n', scene)
    assert found
    return scene.replace(found[0], block(FILE, name, data, is_packed) if name else "")


def flip(scene: str, opening: str) -> str:
    """Return a scene with another character behind an element's opening."""
    at = scene.index(">", scene.index(opening)) + 5
    return f"{scene[:at]}{'A' if scene[at] != 'A' else 'B'}{scene[at + 1 :]}"


def test_a_scene_passes_by_the_checks_of_its_page_and_of_its_bundle(
    scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "s.html").write_text(scene, "utf-8")
    assert main(["check", str(tmp_path / "s.html"), "--json"]) == 0
    checks = json.loads(capsys.readouterr().out)["checks"]
    names = {check["name"] for check in checks if check["ok"]}
    assert {"scene page", "scene blocks", "manifest", "hashes", "tilesets", "volume lists"} <= names
    assert {"glTF validator", "KTX2 textures"} <= names


DAMAGES: dict[str, tuple[Callable[[str], str], str]] = {
    "a part is missing": (lambda s: s[: len(s) // 2], r"ends before </html>"),
    "a file of the bundle": (lambda s: flip(s, f'data-file="{LUT}"'), rf"{LUT}: found SHA-256"),
    "a file of the viewer": (lambda s: flip(s, "data-page="), r"index-1\.css: found SHA-256"),
    "a block of another form": (
        lambda s: s.replace(f'data-file="{LUT}"', f'data-file="{LUT}" ', 1),
        r"found a block that `stereocell export` does not write",
    ),
    "another size": (lambda s: s.replace('data-bytes="', 'data-bytes="1', 1), r"bytes, expected 1"),
    "another script": (
        lambda s: s.replace("startViewer(page,", "startViewer(pages,", 1),
        r"found a script that the policy does not allow",
    ),
    "a policy that names a host": (
        lambda s: s.replace("connect-src data:", f"connect-src {HOST} data:", 1),
        rf"found {HOST} in connect-src of the policy, expected nothing",
    ),
    "no policy": (
        lambda s: re.sub(r"<meta http-equiv=[^>]*>", "", s, count=1),
        r"found 0 policies",
    ),
    "a picture of a host": (
        lambda s: s.replace('<div id="app">', f'<img src="{HOST}"><div id="app">', 1),
        r"found an element <img>, expected none",
    ),
    "a style of a host": (
        lambda s: s.replace('href="data:,"', f'href="{HOST}"', 1),
        rf"found the address {HOST} in <link>, expected none",
    ),
    "a way to another page": (
        lambda s: s.replace(
            "</title>", f'</title><meta http-equiv="refresh" content="0;url={HOST}">', 1
        ),
        r"found <meta http-equiv=refresh>, expected only the policy",
    ),
    "a view that is an address": (lambda s: s.replace(VIEW, HOST, 1), r"its view is https"),
    "a file that is missing": (lambda s: with_block(s, LUT, "", b""), rf"{LUT}: missing"),
    "a file twice": (
        lambda s: s.replace("</body>", block(FILE, LUT, b"", False) + "</body>", 1),
        rf"{LUT}: found two blocks",
    ),
    "a file of other bytes": (
        lambda s: with_block(s, LUT, LUT, b"x"),
        rf"{LUT}: its size or hash differs",
    ),
    "a path outside": (
        lambda s: with_block(s, LUT, "../outside", b"x"),
        r"\.\./outside: found a path outside of the bundle, expected one within it",
    ),
    "a block that grows without end": (
        lambda s: with_block(s, LUT, LUT, gzip.compress(bytes(100 * len(s))), True),
        rf"{LUT}: found cut-off data, or more than",
    ),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_scene_is_named_in_one_line(
    damage: str, scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change, expected = DAMAGES[damage]
    damaged = change(scene)
    assert damaged != scene
    failed = failures(damaged, tmp_path, capsys)
    assert failed
    assert re.search(expected, failed[0]), failed
    assert "stereocell export" in failed[0]
    assert not any("/tmp/" in line.replace(str(tmp_path), "") for line in failed)
    assert not (tmp_path.parent / "outside").exists()
    if "scene" in failed[0].split(":")[0]:
        assert len(failed) == 1


def test_a_deep_check_of_a_scene_names_what_it_needs(
    scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "s.html").write_text(scene, "utf-8")
    assert main(["check", str(tmp_path / "s.html"), "--deep"]) == 1
    assert "found a scene in one file, expected OUT with its plan.json" in capsys.readouterr().err


def test_each_block_has_the_hash_of_its_bytes(scene: str) -> None:
    blocks = re.findall(r'data-sha256="(\w+)"[^>]*>([^<]*)</script>', scene)
    assert len(blocks) > 10
    for digest, text in blocks:
        assert hashlib.sha256(base64.b64decode(text)).hexdigest() == digest
