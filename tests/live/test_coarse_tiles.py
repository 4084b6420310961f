"""The volumes of any first view fit a limit of bytes, and keep their positions."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.formats.ktx2 import decode_finest
from stereocell.live import coarse_tiles, first_view
from stereocell.live.coarse_channel import CoarseChannel, CoarseGrid
from stereocell.live.fine_tiles import FineTiles
from stereocell.live.first_appearance import first_appearance
from stereocell.model.tiling import Box
from stereocell.planning.input_files import as_asked
from stereocell.planning.plan import Plan
from stereocell.planning.preset_choice import load_for
from stereocell.planning.settle import settle
from stereocell.steps.open_source import open_source
from stereocell.transfer.opacity import evaluate, invisible_below
from support.phantoms import f_phantom, write_ome_tiff


def write_view_of(source: Path, root: Path) -> Plan:
    settings, choice = load_for(source, None, None, flags={})
    plan = settle(str(source), settings, choice)
    dataset = open_source(as_asked(plan.source, plan.settings.plan))
    sizes = FineTiles(plan, dataset).sizes()
    first_view.write_first_view(plan, first_view.read_channels(plan, dataset), root, sizes)
    return plan


def bytes_of(root: Path) -> int:
    return sum(path.stat().st_size for path in root.rglob("*") if path.is_file())


def volumes_of(root: Path) -> list[dict[str, object]]:
    found = sorted(root.rglob("volumes.json"))
    return [entry for path in found for entry in json.loads(path.read_text())["volumes"]]


@pytest.fixture
def noise(tmp_path: Path) -> Path:
    """Two channels of noise, which no codec compresses, as 16-bit numbers."""
    voxels = np.random.default_rng(5).integers(0, 60_000, (2, 48, 200, 180), np.uint16)
    return write_ome_tiff(tmp_path / "noise.ome.tif", voxels, "CZYX", (1.0, 0.5, 0.5))


def test_a_view_of_noise_in_two_channels_has_at_most_a_megabyte(
    noise: Path, tmp_path: Path
) -> None:
    write_view_of(noise, tmp_path / "view")
    assert 700_000 < bytes_of(tmp_path / "view") <= coarse_tiles.BYTES
    entries = volumes_of(tmp_path / "view")
    assert len(entries) == 2
    for entry in entries:
        assert entry["finer_size"] == [182, 202, 50]
        size = entry["size"]
        assert isinstance(size, list)
        assert all(60 < n < 182 for n in size[:2])


def test_the_same_source_gives_the_same_bytes_again(noise: Path, tmp_path: Path) -> None:
    for name in "ab":
        write_view_of(noise, tmp_path / name)
    files = sorted(path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*.*"))
    assert len(files) > 8
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_a_volume_that_fits_has_all_of_its_voxels(tmp_path: Path) -> None:
    source = write_ome_tiff(tmp_path / "f.ome.tif", f_phantom(2), spacing=(1.0, 0.5, 0.5))
    write_view_of(source, tmp_path / "view")
    (entry,) = volumes_of(tmp_path / "view")
    assert entry["size"] == [74, 98, 34]
    assert "finer_size" not in entry


def test_fewer_bytes_show_the_same_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The letter F stays where it is, in voxels that lie 1.2 to 4 times as far apart."""
    solid = f_phantom(2)
    grain = np.random.default_rng(0).integers(0, 40, solid.shape, np.uint16)
    source = write_ome_tiff(
        tmp_path / "f.ome.tif", solid.astype(np.uint16) + grain, spacing=(1.0, 0.5, 0.5)
    )
    monkeypatch.setattr(coarse_tiles, "_OTHERS", 0)
    write_view_of(source, tmp_path / "whole")
    whole = shares(tmp_path / "whole")
    for most in (120_000, 40_000, 6_000):
        monkeypatch.setattr(coarse_tiles, "BYTES", most)
        root = tmp_path / f"{most}"
        write_view_of(source, root)
        (entry,) = volumes_of(root)
        volume = [path for path in root.rglob("*.ktx2") if "volumes" in path.parts]
        assert sum(path.stat().st_size for path in volume) <= most
        assert entry["finer_size"] == [74, 98, 34]
        assert np.allclose(shares(root), whole, atol=0.02)


def shares(root: Path) -> NDArray[np.float64]:
    """Return the centre of a volume's visible voxels, and its mean brightness, 0 to 1.

    The centre is (z, y, x), in shares of the volume's edges, 0 to 1.
    """
    (entry,) = volumes_of(root)
    file = entry["file"]
    assert isinstance(file, dict)
    voxels = decode_finest((root / file["path"]).read_bytes())[1:-1, 1:-1, 1:-1, 0] / 255
    voxels[voxels < 0.4] = 0
    along = [voxels.sum(axis=tuple({0, 1, 2} - {i})) for i in range(3)]
    middles = [float(one @ np.linspace(0, 1, len(one)) / one.sum()) for one in along]
    return np.array([*middles, float(voxels.mean())])


def test_visible_and_invisible_values_stay_so_with_fewer_greys(tmp_path: Path) -> None:
    """Each function shows the same texels; no value moves by more than half a step."""
    source = write_ome_tiff(tmp_path / "f.ome.tif", f_phantom(2), spacing=(1.0, 0.5, 0.5))
    settings, choice = load_for(source, None, None, flags={})
    plan = settle(str(source), settings, choice)
    dataset = open_source(as_asked(plan.source, plan.settings.plan))
    (channel,) = plan.channels
    coarse = first_view.read_channels(plan, dataset)[channel.voxels_id]
    appearance = first_view.composed(first_appearance(plan, channel, coarse)[0])
    every = np.arange(256, dtype=np.uint8).reshape(1, 16, 16)
    for name, points in appearance.transfer_functions.items():
        own = coarse_tiles._Source(channel, coarse, replace(appearance, chosen=name), None)
        opacities = np.rint(evaluate(points) * 255).astype(np.uint8)
        last = invisible_below(opacities)
        for shown, hidden in coarse_tiles._GREYS:
            found = own.rounded(every, (shown, hidden)).ravel().astype(int)
            assert ((found > last) == (np.arange(256) > last)).all()
            assert (np.diff(found) >= 0).all()
            moved = np.abs(found - np.arange(256))
            assert moved[last + 1 :].max() <= 255 / shown / 2 + 0.5
            assert moved[: last + 1].max(initial=0) <= 255 / hidden / 2 + 0.5
            assert found[-1] == 255


def test_means_of_blocks_lie_in_their_middles() -> None:
    z, y, x = np.meshgrid(np.arange(9.0), np.arange(8.0), np.arange(10.0), indexing="ij")
    grid = CoarseGrid(0, Box((0, 0, 0), (9, 8, 10)), (1, 1, 1), (5.0, 6.0, 7.0), (1.0, 2.0, 1.0))
    ramp = (100 * (z + 5) + 10 * (2 * y + 6) + (x + 7)).astype(np.float32)
    coarse = CoarseChannel(ramp, grid, ramp.ravel())
    assert coarse.averaged(1) is coarse
    for blocks in (2, 3):
        found = coarse.averaged(blocks)
        assert found.grid.step == (blocks, 2 * blocks, blocks)
        places = np.array([8.5, 10.0]), np.array([11.0, 13.5]), np.array([10.0, 12.25])
        expected = 100 * places[0][:, None, None] + 10 * places[1][:, None] + places[2]
        assert np.allclose(found.at(places), expected)
    flat = replace(coarse, voxels=ramp[:1])
    assert flat.averaged(4).grid.step == (1.0, 8.0, 4.0)
