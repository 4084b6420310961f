"""Bricks of a source before it is built equal those of its build, if the window is the same."""

from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.cli.__main__ import main
from stereocell.live import coarse_channel, fine_tiles, first_view
from stereocell.live.build_process import BuildProcess
from stereocell.live.fine_tiles import FineTiles
from stereocell.live.partial_view import PartialView
from stereocell.live.reading import Reading
from stereocell.live.show_source import Live
from stereocell.model.errors import SourceError
from stereocell.planning.input_files import as_asked
from stereocell.planning.preset_choice import load_for
from stereocell.planning.settle import settle
from stereocell.serve.brick_library import BrickLibrary
from stereocell.serve.live_bricks import LiveBricks
from stereocell.serve.server import BundleServer
from stereocell.serve.tree_files import BrickFile
from stereocell.steps.open_source import open_source
from stereocell.transfer.joint_histogram import to_eight_bits
from support.phantoms import f_phantom, write_ome_tiff, write_ome_zarr
from support.server.brick_client import reconstruct
from support.server.requests import ask
from support.server.running import running
from support.server.sent_bricks import sent

TILES = (32, 48, 72)
SPACING = (1.0, 0.5, 0.5)


@pytest.fixture(autouse=True)
def _coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """A first view of far fewer voxels than the sources of these tests have."""
    monkeypatch.setattr(first_view, "VOXELS", 10_000)


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """The letter F of 32 x 96 x 72 voxels, (z, y, x), in two tiles, one above the other."""
    return write_ome_tiff(tmp_path / "f.ome.tif", f_phantom(2), spacing=SPACING)


def fine_tiles_of(source: Path, **flags: Any) -> FineTiles:
    settings, choice = load_for(source, None, None, flags={"plan": {"tile_size": TILES}} | flags)
    plan = settle(str(source), settings, choice)
    return FineTiles(plan, open_source(as_asked(plan.source, plan.settings.plan)))


def write_first_view(fine: FineTiles, root: Path) -> BrickLibrary:
    """Write a first view into a folder, and return its library."""
    read = first_view.read_channels(fine.plan, fine.dataset)
    first_view.write_first_view(fine.plan, read, root, fine.sizes())
    return LiveBricks(fine, root.parent, None).library(root, {})


def voxels_of(file: BrickFile) -> NDArray[np.float32]:
    """Return the voxels (z, y, x) of a tree, all of its bricks there."""
    stored = np.flatnonzero(file.table.nodes["length"]).tolist()
    return reconstruct(file.table, dict(zip(stored, file.read(stored), strict=True)))


def test_bricks_of_a_first_view_are_the_sources_voxels_in_its_window(
    source: Path, tmp_path: Path
) -> None:
    fine = fine_tiles_of(source)
    library = write_first_view(fine, tmp_path / "view")
    assert main(["check", str(tmp_path / "view")]) == 0
    for tile in fine.plan.tiles:
        file = library.open(tile.id, fine.plan.channels[0].id)
        # the tile, the plane that it shares with the next one, and a voxel beyond on every side
        own = tile.lattice(fine.plan.region)
        padded = np.pad(f_phantom(2), 1, mode="edge")
        cut = padded[tuple(slice(a, b + 2) for a, b in zip(own.start, own.stop, strict=True))]
        expected = to_eight_bits(cut, file.volume.window).astype(float)
        found = voxels_of(file)
        assert list(found.shape[::-1]) == file.volume.entry["finer_size"]
        assert found.size > 4 * np.prod(file.volume.entry["size"])
        # an invisible brick is left out, and its parent shows the mean of its box
        shown = expected > file.table.threshold
        assert shown.any()
        np.testing.assert_array_equal(found[shown], expected[shown])


def test_a_build_rests_while_bricks_are_made_that_someone_waits_for(
    source: Path, tmp_path: Path
) -> None:
    class Build(BuildProcess):
        def __init__(self) -> None:
            super().__init__(lambda _: "", tmp_path / "out")
            self.rests: list[str] = []

        @contextmanager
        def while_someone_waits(self) -> Iterator[None]:
            self.rests.append("begun")
            yield
            self.rests.append("ended")

    build, fine = Build(), fine_tiles_of(source)
    write_first_view(fine, tmp_path / "view")
    library = LiveBricks(fine, tmp_path, build).library(tmp_path / "view", {})
    tile, channel = fine.plan.tiles[0].id, fine.plan.channels[0].id
    for _ in range(2):  # it is made once
        library.open(tile, channel)
        assert build.rests == ["begun", "ended"]


@pytest.mark.slow
def test_bricks_of_a_build_s_view_equal_those_of_its_bundle(source: Path, tmp_path: Path) -> None:
    out, scratch = tmp_path / "out", tmp_path / "scratch"
    words = ["build", str(source), "-o", str(out), "--workers", "0", "--tile-size", "32,48,72"]
    assert main(words) == 0
    fine = fine_tiles_of(source)
    read = first_view.read_channels(fine.plan, fine.dataset)
    view = PartialView(fine.plan, read, out, scratch, sizes=fine.sizes(), rest=0)
    folder = view.add(None)
    assert folder is not None
    live = LiveBricks(fine, scratch, None).library(folder, view.holders)
    built = BrickLibrary(out / "bundle", out / "bricks")
    assert live.volumes().keys() == built.volumes().keys()
    for name, volume in live.volumes().items():
        assert volume.window == built.volumes()[name].window
        mine, its = live.open(*name), built.open(*name)
        assert "finer_size" in volume.entry
        np.testing.assert_array_equal(mine.table.nodes, its.table.nodes)  # the bricks' hashes, too
        nodes = np.flatnonzero(mine.table.nodes["length"]).tolist()
        assert mine.read(nodes) == its.read(nodes)


def test_a_coarse_view_that_is_as_fine_as_the_source_announces_nothing(
    source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(first_view, "VOXELS", 4_000_000)
    library = write_first_view(fine_tiles_of(source), tmp_path / "view")
    assert not any("finer_size" in volume.entry for volume in library.volumes().values())
    name = next(iter(library.volumes()))
    size = library.volumes()[name].entry["size"]
    assert list(library.open(*name).table.size[::-1]) == size  # of the file itself
    with serving(fine_tiles_of(source), tmp_path / "view") as port:
        assert "Stereocell-Bricks" not in ask(port, "/manifest.json")[0].headers


def test_a_large_tile_is_read_as_finely_as_there_is_room_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fine_tiles, "PLANNED_VOXELS", 50_000)
    monkeypatch.setattr(fine_tiles, "COARSER_VOXELS", 30_000)
    monkeypatch.setattr(coarse_channel, "READ_VOXELS", 40_000)
    coarse = np.full((16, 48, 36), 7777, np.uint16)  # its value shows which level was read
    coarse[::2] = 7000
    source = write_ome_zarr(
        tmp_path / "large.ome.zarr",
        [f_phantom(2), coarse],
        scales=[dict.fromkeys("zyx", 1.0), dict.fromkeys("zyx", 2.0)],
        translations=[None, dict.fromkeys("zyx", 0.5)],
    )
    fine = fine_tiles_of(source)
    library = write_first_view(fine, tmp_path / "view")
    for name, volume in library.volumes().items():
        file = library.open(*name)
        assert file.table.size[::-1] == tuple(volume.entry["finer_size"])
        assert np.prod(file.table.size) < 50_000
        assert np.prod(file.table.size) > np.prod(volume.entry["size"])
        read = fine.read(volume.tile, volume.channel, (7000.0, 7777.0), None)
        assert read.max() > read.min()
        assert set(np.unique(read[1:-1:2])) != {0}


def test_a_source_that_changes_meanwhile_is_refused_and_others_go_on(
    source: Path, tmp_path: Path
) -> None:
    fine = fine_tiles_of(source)
    library = write_first_view(fine, tmp_path / "view")
    (first, second) = library.volumes()
    before = library.open(*first)
    write_ome_tiff(source, f_phantom(2)[::-1], spacing=SPACING)
    with pytest.raises(SourceError, match=r"f\.ome\.tif: changed since it was opened"):
        library.open(*second)
    assert library.open(*first) is before
    source.unlink()
    with pytest.raises(SourceError, match=r"f\.ome\.tif"):
        library.open(*second)


def test_a_channel_whose_values_are_all_the_same_is_one_node(tmp_path: Path) -> None:
    both = np.stack([f_phantom(2), np.full((32, 96, 72), 500, np.uint16)])
    source = write_ome_tiff(tmp_path / "two.ome.tif", both, "CZYX", SPACING)
    fine = fine_tiles_of(source)
    library = write_first_view(fine, tmp_path / "view")
    flat = fine.plan.channels[1].id
    for tile in fine.plan.tiles:
        file = library.open(tile.id, flat)
        assert len(np.unique(voxels_of(file))) == 1


@contextmanager
def serving(fine: FineTiles, root: Path) -> Iterator[int]:
    first = Future[None]()
    first.set_result(None)
    page = root.parent / "page"
    page.mkdir()
    (page / "index.html").write_text("<html>")
    build = BuildProcess(lambda _: "", root.parent / "out")
    if root.name != "view":
        build._views[root.name] = root
    live = Live(page, root, first, fine, build, Reading(lambda _: None))
    with running(BundleServer(live.bundle, 0, False, live=live)) as server:
        yield server.port


@pytest.mark.parametrize(
    ("view", "path", "header"),
    [("view", "", "version=1"), ("g1", "/g1", "version=1; folder=g1/")],
)
def test_bricks_come_over_the_websocket_of_a_view(
    source: Path, tmp_path: Path, view: str, path: str, header: str
) -> None:
    fine = fine_tiles_of(source)
    root = tmp_path / "scratch" / view
    library = write_first_view(fine, root)
    volumes = [{"tile": tile, "channel": channel} for tile, channel in library.volumes()]
    with serving(fine, root) as port:
        assert ask(port, f"{path}/manifest.json")[0].headers["Stereocell-Bricks"] == header
        client = sent(port, f"{path}/bricks", volumes)
    assert client.done[1]["reason"] == "complete"
    for tree, volume in zip(client.trees.values(), volumes, strict=True):
        expected = voxels_of(library.open(volume["tile"], volume["channel"]))
        np.testing.assert_array_equal(reconstruct(tree.table, tree.frames), expected)


def test_a_source_that_has_gone_is_one_error_for_each_volume(source: Path, tmp_path: Path) -> None:
    fine = fine_tiles_of(source)
    root = tmp_path / "scratch" / "view"
    names = list(write_first_view(fine, root).volumes())
    source.unlink()
    with serving(fine, root) as port:
        client = sent(port, "/bricks", [{"tile": tile, "channel": one} for tile, one in names])
    assert [one["code"] for one in client.messages if one["type"] == "error"] == ["damaged"] * 2


def test_trees_that_have_left_are_made_again_while_they_are_looked_at(
    source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both trees together exceed the bound, so that the first leaves when the second is made."""
    fine = fine_tiles_of(source)
    root = tmp_path / "scratch" / "view"
    library = write_first_view(fine, root)
    for name in library.volumes():
        library.open(*name)
    trees = sorted((root.parent / "bricks").iterdir())
    sizes = [path.stat().st_size for path in trees]
    for path in trees:
        path.unlink()
    monkeypatch.setattr("stereocell.serve.live_bricks.MOST_BYTES", max(sizes))
    first, second = ({"tile": tile, "channel": channel} for tile, channel in library.volumes())
    with serving(fine, root) as port:
        for volume in (first, second, first):
            client = sent(port, "/bricks", [volume])
            assert client.done[1]["reason"] == "complete"
            assert len(list((root.parent / "bricks").iterdir())) == 1
