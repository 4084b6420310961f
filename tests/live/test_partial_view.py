"""While a source is built, each view is a bundle: finished tiles have their surfaces."""

import json
from pathlib import Path
from typing import Any

import pytest

from stereocell.cli.__main__ import _parser, main, run_to_line
from stereocell.live.first_view import NOT_BUILT, read_channels
from stereocell.live.partial_view import PartialView
from stereocell.planning.input_files import as_asked
from stereocell.planning.preset_choice import load_for
from stereocell.planning.settle import settle
from stereocell.steps.open_source import open_source
from support.digests import digests_of
from support.phantoms import f_phantom, write_ome_tiff

FLAGS = ["--tile-size", "32,48,72"]


def build(source: Path, out: Path, watch: Any = None) -> str:
    words = ["build", str(source), "-o", str(out), "--workers", "0", *FLAGS]
    options = _parser(words).parse_args(words)
    options.watch = watch
    return run_to_line(options)


def manifest_of(root: Path) -> dict[str, Any]:
    return dict(json.loads((root / "manifest.json").read_text()))


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """The letter F of 32 x 96 x 72 voxels in two tiles, one above the other."""
    return write_ome_tiff(tmp_path / "f.ome.tif", f_phantom(2), spacing=(1.0, 0.5, 0.5))


def view_of(source: Path, out: Path, scratch: Path) -> PartialView:
    settings, choice = load_for(source, None, None, flags={"plan": {"tile_size": (32, 48, 72)}})
    plan = settle(str(source), settings, choice)
    read = read_channels(plan, open_source(as_asked(plan.source, plan.settings.plan)))
    return PartialView(plan, read, out, scratch, rest=0)


@pytest.mark.slow
def test_each_finished_tile_brings_a_view_and_the_bundle_is_that_of_a_plain_build(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, scratch = tmp_path / "out", tmp_path / "scratch"
    view = view_of(source, out, scratch)
    views: list[tuple[int, Path]] = []

    def watch(label: str, done: int, total: int, name: str) -> None:
        assert 0 <= done <= total
        if label != "units":
            return
        folder = view.add(name.split("/")[0] if name else None)
        if folder is not None:
            views.append((view.finished, folder))

    assert build(source, out, watch) == ""
    assert [finished for finished, _ in views] == [1, 2]
    built = manifest_of(out / "bundle")
    for finished, folder in views:
        assert main(["check", str(folder)]) == 0, capsys.readouterr().out
        manifest = manifest_of(folder)
        unfinished = [tile["id"] for tile in manifest["tiles"] if tile.get("unfinished")]
        assert unfinished == ["r0_c0", "r1_c0"][finished:]
        (channel,), (last,) = manifest["channels"], built["channels"]
        for same in ("window", "iso_value", "color", "surface", "transfer_functions"):
            assert channel[same] == last[same], same
        lods = {path.name for path in (folder / "channels" / channel["id"]).glob("r*")}
        assert lods == {"r0_c0", "r1_c0"} - set(unfinished)
        coarse = json.loads((folder / channel["volumes"]["path"]).read_text())["volumes"]
        assert [one["tile"] for one in coarse] == ["r0_c0", "r1_c0"]
    for name in ("r0_c0", "r1_c0"):  # the meshes are those of the build, to the byte
        files = [f"channels/{channel['id']}/{name}/lod{level}.glb" for level in (0, 1)]
        for file in files:
            in_view, in_bundle = views[-1][1] / file, out / "bundle" / file
            assert in_view.exists() == in_bundle.exists()
            if in_view.exists():
                assert in_view.read_bytes() == in_bundle.read_bytes()
    assert build(source, tmp_path / "plain") == ""
    for part in ("stage", "bundle"):
        assert digests_of(out / part) == digests_of(tmp_path / "plain" / part)


@pytest.mark.slow
def test_units_of_an_earlier_build_show_at_once(source: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert build(source, out) == ""
    view = view_of(source, out, tmp_path / "scratch")
    folder = view.add(None)
    assert folder is not None
    assert view.finished == 2
    assert not any("unfinished" in tile for tile in manifest_of(folder)["tiles"])
    assert view.add("r0_c0") is None


@pytest.mark.slow
def test_a_view_waits_if_the_one_before_took_long_except_for_that_of_the_last_tile(
    source: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    assert build(source, out) == ""
    view = view_of(source, out, tmp_path / "scratch")
    view._rest = 1e6
    assert view.add("r0_c0") is not None
    assert view.add("r1_c0") is None
    assert view.finished == 2
    assert view.add(None) is not None
    assert view.add(None) is None


@pytest.mark.slow
def test_a_build_of_another_source_brings_no_views(source: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    view = view_of(source, out, tmp_path / "scratch")
    write_ome_tiff(source, f_phantom(2)[::-1], spacing=(1.0, 0.5, 0.5))
    assert build(source, out) == ""
    assert view.add(None) is None


def test_the_words_for_a_channel_without_a_surface_are_those_of_the_first_view() -> None:
    assert "not built yet" in NOT_BUILT
