"""The samples have the properties that their documentation states, measured on their voxels."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from numpy.typing import NDArray
from scipy import ndimage

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.model.errors import OutputError, UsageError
from stereocell.model.tiling import Box
from stereocell.samples import microscope, write_brain_cells, write_cycif
from stereocell.samples.bodies import Nucleus, Tube, rotation_of
from stereocell.samples.cycif_geometry import NUCLEUS_GAP_UM, Tissue, grow_tissue
from stereocell.samples.microscope import BLUR_UM, SPACING_UM, STAINS
from support.digests import digests_of

SMALL: dict[str, Any] = {
    "grid": (2, 1),
    "tile_size": (24, 96, 96),
    "seed": 3,
    "brightness_spread": 1.0,
}


@pytest.fixture(scope="module")
def cycif(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sample") / "block.ome.zarr"
    write_cycif(path, **SMALL)
    return path


def truth_of(path: Path) -> Any:
    name = path.name.removesuffix(".ome.zarr") + ".truth.json"
    return json.loads((path.parent / name).read_text("utf-8"))


@pytest.mark.slow
def test_cycif_is_an_ome_zarr_with_names_colours_and_a_pyramid(cycif: Path) -> None:
    assert zarr.open_group(cycif, mode="r").metadata.zarr_format == 3
    dataset = read.open(cycif)
    assert dataset.name == "block"
    assert [channel.name for channel in dataset.channels] == ["Hoechst", "MART1", "CD31"]
    assert all(channel.color is not None for channel in dataset.channels)
    assert dataset.dtype == np.uint16
    assert [level.shape for level in dataset.levels] == [(24, 96, 192), (24, 48, 96), (24, 24, 48)]
    assert dataset.levels[0].spacing_um == pytest.approx((0.28, 0.14, 0.14))
    assert dataset.levels[2].spacing_um == pytest.approx((0.28, 0.56, 0.56))
    assert dataset.levels[2].origin_um == pytest.approx((0.0, 0.21, 0.21))


@pytest.mark.slow
def test_coarser_levels_are_means_of_blocks(cycif: Path) -> None:
    dataset = read.open(cycif)
    fine = dataset.read(2, dataset.levels[0].box).voxels.astype(np.float64)
    coarse = dataset.read(2, dataset.levels[1].box, level=1).voxels
    means = fine.reshape(24, 48, 2, 96, 2).mean(axis=(2, 4))
    assert np.abs(coarse - means).max() <= 0.5


@pytest.mark.slow
def test_cycif_repeats_to_the_byte(cycif: Path, tmp_path: Path) -> None:
    write_cycif(tmp_path / "block.ome.zarr", **SMALL)
    assert digests_of(tmp_path) == digests_of(cycif.parent)
    write_cycif(tmp_path / "other.ome.zarr", **{**SMALL, "seed": 4})
    assert digests_of(tmp_path / "other.ome.zarr") != digests_of(cycif)


def test_cycif_written_twice_changes_nothing_and_other_files_stay(
    cycif: Path, tmp_path: Path
) -> None:
    before = digests_of(cycif.parent)
    times = {file: file.stat().st_mtime_ns for file in cycif.parent.rglob("*")}
    write_cycif(cycif, **SMALL)
    assert {file: file.stat().st_mtime_ns for file in cycif.parent.rglob("*")} == times
    with pytest.raises(OutputError, match=r"something else.*: choose another place$"):
        write_cycif(cycif, **{**SMALL, "seed": 4})
    assert digests_of(cycif.parent) == before
    (tmp_path / "mine.ome.zarr").mkdir()
    (tmp_path / "mine.ome.zarr" / "thesis.tex").write_text("years of work")
    with pytest.raises(OutputError, match="expected nothing or the same sample"):
        write_cycif(tmp_path / "mine.ome.zarr", **SMALL)


def test_cycif_interrupted_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*args: object, **options: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(microscope, "record", full)
    with pytest.raises(OutputError, match=r"block\.ome\.zarr: can't be written: No space left"):
        write_cycif(tmp_path / "block.ome.zarr", **SMALL)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_cycif_stopped_between_two_files_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    write, written = Path.write_bytes, []

    def stopping(path: Path, content: bytes) -> int:
        written.append(path)
        if len(written) > 9:
            raise error
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", stopping)
    with pytest.raises((OutputError, KeyboardInterrupt)):
        write_cycif(tmp_path / "block.ome.zarr", **SMALL)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_cycif_on_a_full_disk_is_one_line_and_leaves_nothing(
    small_disk: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    size = ["--grid", "2x1", "--tile-size", "24,96,96"]
    assert main(["sample", "cycif", str(small_disk / "block.ome.zarr"), *size]) == 1
    assert main(["sample", "brain-cells", str(small_disk / "brain.ome.tif")]) == 1
    lines = capfd.readouterr().err.splitlines()
    assert len(lines) == 2
    assert all("can't be written: No space left on device" in line for line in lines)
    assert list(small_disk.iterdir()) == []


@pytest.mark.slow
def test_sample_with_missing_chunks_is_made_again_and_a_damaged_one_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "block.ome.zarr"
    command = ["sample", "cycif", str(path), "--grid", "1x1", "--tile-size", "8,96,96"]
    assert main(command) == 0
    chunk = max((path / "0" / "c").rglob("*"), key=lambda file: file.is_file())
    content = chunk.read_bytes()
    chunk.unlink()
    assert main(command) == 0
    assert chunk.read_bytes() == content
    (path / "zarr.json").write_text("{")
    capsys.readouterr()
    assert main(command) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "expected nothing or the same sample" in line


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"grid": (0, 1)}, "--grid is 0x1"),
        ({"tile_size": (4, 96, 96)}, "--tile-size is 4,96,96"),
        ({"seed": -1}, "--seed is -1"),
        ({"brightness_spread": -0.5}, "--brightness-spread is -0.5"),
        ({"brightness_spread": math.nan}, "--brightness-spread is nan"),
    ],
)
def test_wrong_arguments_are_named(tmp_path: Path, change: Any, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        write_cycif(tmp_path / "block.ome.zarr", **{**SMALL, **change})
    with pytest.raises(UsageError, match=r"NAME\.ome\.zarr"):
        write_cycif(tmp_path / "block.tif", **SMALL)


# Comparisons of the truth with the voxels


@pytest.mark.slow
def test_voxels_have_the_boundary_intensity_at_the_surface_of_nuclei() -> None:
    box = Box((0, 0, 0), (64, 200, 360))
    size_um = tuple(n * h for n, h in zip(box.shape, SPACING_UM, strict=True))
    tissue = grow_tissue((size_um[0], size_um[1], size_um[2]), seed=1, brightness_spread=0.0)
    voxels = microscope.record(tissue, 0, box=box, seed=1).astype(np.float64)
    waves = microscope.waves_of(0, tissue.size_um, seed=1)
    directions = np.random.default_rng(0).normal(size=(400, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    errors = []
    for nucleus in tissue.nuclei:
        assert nucleus.brightness == 1.0
        center, margin = np.array(nucleus.center_um), nucleus.reach_um + 0.5
        if np.any(center < margin) or np.any(center > np.array(size_um) - margin):
            continue  # the block's faces cut this nucleus
        surface = center + (directions * nucleus.semi_axes_um) @ nucleus.rotation.T
        found = ndimage.map_coordinates(voxels, (surface / SPACING_UM).T, order=1)
        z, y, x = surface.T
        expected = microscope.background(STAINS[0], waves, (z, y, x)) + STAINS[0].amplitude / 2
        errors.append(found.mean() / expected.mean() - 1.0)
    assert len(errors) >= 8
    # After blurring, the edge of a convex object is slightly dimmer than half of its inside.
    assert -0.08 < np.mean(errors) < 0.01
    assert np.abs(errors).max() < 0.15


def test_the_truth_lists_the_nuclei_and_vessels_that_were_drawn(cycif: Path) -> None:
    truth = truth_of(cycif)
    size_um = tuple(n * h for n, h in zip(truth["shape"], truth["spacing_um"], strict=True))
    tissue = grow_tissue((size_um[0], size_um[1], size_um[2]), seed=3, brightness_spread=1.0)
    assert len(truth["nuclei"]) == len(tissue.nuclei) > 0
    assert len(truth["vessels"]) == len(tissue.vessels) > 0
    assert truth["nuclei"][0]["center_um"] == list(tissue.nuclei[0].center_um)
    waves = microscope.waves_of(0, tissue.size_um, seed=3)
    z, y, x = np.array([nucleus["center_um"] for nucleus in truth["nuclei"]]).T
    background = microscope.background(STAINS[0], waves, (z, y, x))
    written = [n["boundary_intensity"] - 500.0 * n["brightness"] for n in truth["nuclei"]]
    np.testing.assert_allclose(written, background)


def test_nuclei_keep_their_gap(cycif: Path) -> None:
    nuclei = truth_of(cycif)["nuclei"]
    centers = np.array([nucleus["center_um"] for nucleus in nuclei])
    reach = np.array([max(nucleus["semi_axes_um"]) for nucleus in nuclei])
    gaps = np.linalg.norm(centers[:, None] - centers[None], axis=-1) - reach[:, None] - reach
    assert len(nuclei) > 10
    assert gaps[~np.eye(len(nuclei), dtype=bool)].min() >= NUCLEUS_GAP_UM - 1e-9


@pytest.mark.slow
def test_brightness_fills_its_range() -> None:
    tissue = grow_tissue((20.0, 45.0, 90.0), seed=5, brightness_spread=1.5)
    brightness = np.array([nucleus.brightness for nucleus in tissue.nuclei])
    assert 1.0 <= brightness.min() < 1.1
    assert 2.3 < brightness.max() <= 2.5
    # Brightness is log-uniform, so its median is the geometric mean of the ends.
    assert np.median(brightness) == pytest.approx(math.sqrt(2.5), rel=0.1)


@pytest.mark.slow
def test_tumour_cells_are_denser_on_their_side_and_vessels_fork() -> None:
    tissue = grow_tissue((18.0, 45.0, 112.0), seed=0, brightness_spread=1.0)
    x = np.array([nucleus.center_um[2] for nucleus in tissue.nuclei])
    assert (x < 56.0).sum() > 3 * (x > 80.0).sum() > 0
    assert all(nucleus.center_um[2] < 90.0 for nucleus in tissue.nuclei if nucleus.cell_um > 0.0)
    starts = [tube.start_um for tube in tissue.vessels]
    assert len(set(starts)) < len(starts)  # two branches start at one point
    assert len({tube.radius_um for tube in tissue.vessels}) >= 3


def disc_means(voxels: NDArray[np.uint16], at_um: tuple[float, float, float]) -> float:
    z, y, x = (round(p / h) for p, h in zip(at_um, SPACING_UM, strict=True))
    return float(voxels[z - 1 : z + 2, y - 2 : y + 3, x - 2 : x + 3].mean())


def test_each_dye_is_where_its_body_is() -> None:
    nucleus = Nucleus((5.0, 6.0, 6.0), (3.0, 3.0, 3.0), np.eye(3), 1.0, 4.4)
    tube = Tube((5.0, -4.0, 16.0), (5.0, 16.0, 16.0), 3.0)
    tissue = Tissue((10.08, 11.2, 22.4), (nucleus,), (tube,))
    box = Box((0, 0, 0), (36, 80, 160))
    hoechst, mart1, cd31 = (microscope.record(tissue, stain, box=box, seed=0) for stain in range(3))
    background = [100.0 + stain.background for stain in STAINS]
    assert disc_means(hoechst, (5.0, 6.0, 6.0)) == pytest.approx(background[0] + 1000.0, rel=0.15)
    assert disc_means(hoechst, (5.0, 6.0, 16.0)) == pytest.approx(background[0], rel=0.4)
    assert disc_means(mart1, (5.0, 6.0, 6.0)) < background[1] * 1.5  # no dye in the nucleus
    assert disc_means(mart1, (5.0, 6.0, 6.0 + 4.4 - 0.25)) > background[1] + 500.0  # the membrane
    assert disc_means(mart1, (5.0, 6.0, 6.0 + 3.5)) < background[1] + 500.0  # the cytoplasm
    assert disc_means(cd31, (5.0, 6.0, 16.0)) < background[2] * 1.5  # the lumen
    assert disc_means(cd31, (5.0, 6.0, 16.0 + 3.0 - 0.35)) > background[2] + 500.0  # the wall


def test_blur_is_wider_along_z() -> None:
    """The steepest slope at the edge of a large ball gives the sigma of the blur."""
    nucleus = Nucleus((8.0, 8.0, 8.0), (6.0, 6.0, 6.0), np.eye(3), 1.0, 0.0)
    tissue = Tissue((16.0, 16.0, 16.0), (nucleus,), ())
    box = Box((0, 0, 0), (58, 115, 115))
    voxels = microscope.record(tissue, 0, box=box, seed=0).astype(np.float64)
    z = voxels[:29, 55:60, 55:60].mean(axis=(1, 2))
    x = voxels[28:31, 55:60, :57].mean(axis=(0, 1))
    slope_z = np.diff(z).max() / SPACING_UM[0]
    slope_x = np.diff(x).max() / SPACING_UM[2]
    # The steepest slope of a blurred step is amplitude / (sigma sqrt(2 pi)). Sampling widens sigma.
    for slope, sigma, step in ((slope_z, BLUR_UM[0], 0.28), (slope_x, BLUR_UM[2], 0.14)):
        wider = math.sqrt(sigma**2 + step**2 / 6.0)
        assert slope == pytest.approx(1000.0 / (wider * math.sqrt(2.0 * math.pi)), rel=0.15)


def test_a_box_repeats_the_dye_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(microscope, "READ_NOISE", 0.0)
    monkeypatch.setattr(microscope, "GAIN", 1e-3)  # many electrons, so almost no Poisson noise
    tissue = grow_tissue((6.72, 13.44, 13.44), seed=2, brightness_spread=1.0)
    whole = microscope.record(tissue, 1, box=Box((0, 0, 0), (24, 96, 96)), seed=2)
    part = Box((3, 20, 40), (20, 70, 96))
    alone = microscope.record(tissue, 1, box=part, seed=2)
    assert np.abs(alone.astype(int) - whole[part.slices]).max() <= 10


def test_noise_has_the_stated_variance() -> None:
    tissue = Tissue((10.0, 10.0, 10.0), (), ())
    voxels = microscope.record(tissue, 0, box=Box((0, 0, 0), (16, 64, 64)), seed=0)
    difference = np.diff(voxels.astype(np.float64), axis=2) / math.sqrt(2.0)
    photons = (voxels.mean() - microscope.OFFSET) / microscope.GAIN
    variance = microscope.GAIN**2 * photons + microscope.READ_NOISE**2
    assert difference.var() == pytest.approx(variance, rel=0.05)


def test_bodies_measure_distances() -> None:
    rng = np.random.default_rng(0)
    rotation = rotation_of(rng.normal(size=4))
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    nucleus = Nucleus((1.0, 2.0, 3.0), (3.0, 2.5, 2.0), rotation, 1.0, 4.0)
    directions = rng.normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    surface = np.array(nucleus.center_um) + (directions * nucleus.semi_axes_um) @ rotation.T
    normals = (directions / nucleus.semi_axes_um) @ rotation.T
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    for offset in (-0.2, 0.0, 0.2):
        z, y, x = (surface + offset * normals).T
        np.testing.assert_allclose(nucleus.distance((z, y, x)), offset, atol=0.02)
    tube = Tube((0.0, 0.0, 0.0), (0.0, 0.0, 10.0), 1.0)
    at = tuple(np.array([value]) for value in (0.0, 3.0, 5.0))
    assert tube.distance((at[0], at[1], at[2])) == pytest.approx(2.0)
    beyond = tuple(np.array([value]) for value in (0.0, 0.0, 13.0))
    assert tube.distance((beyond[0], beyond[1], beyond[2])) == pytest.approx(2.0)


# The real stack


def test_brain_cells_is_a_small_real_stack_with_its_licence(tmp_path: Path) -> None:
    path = tmp_path / "brain.ome.tif"
    write_brain_cells(path)
    write_brain_cells(path)  # the second call changes nothing
    assert path.stat().st_size <= 2_000_000
    assert "BSD 3-Clause" in (tmp_path / "brain.LICENSE").read_text("utf-8")
    dataset = read.open(path)
    assert [channel.name for channel in dataset.channels] == ["Cells", "Autofluorescence"]
    assert all(channel.color is not None for channel in dataset.channels)
    assert dataset.levels[0].shape == (30, 128, 160)
    assert dataset.levels[0].spacing_um == (5.0, 2.0, 2.0)
    cells = dataset.read(0, dataset.levels[0].box).voxels
    assert np.percentile(cells, 99.9) > 4 * np.median(cells)


def test_brain_cells_overwrites_nothing(tmp_path: Path) -> None:
    path = tmp_path / "brain.ome.tif"
    path.write_text("mine")
    with pytest.raises(OutputError, match="expected nothing or the same sample"):
        write_brain_cells(path)
    assert path.read_text("utf-8") == "mine"
    with pytest.raises(UsageError, match=r"NAME\.ome\.tif"):
        write_brain_cells(tmp_path / "brain.ome.zarr")


def test_brain_cells_leaves_no_licence_without_its_stack(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = Path.write_bytes

    def full(path: Path, content: bytes) -> int:
        if len(content) > 100_000:
            raise OSError(28, "No space left on device")
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OutputError, match=r"brain\.ome\.tif: can't be written: No space left"):
        write_brain_cells(tmp_path / "brain.ome.tif")
    assert list(tmp_path.iterdir()) == []
