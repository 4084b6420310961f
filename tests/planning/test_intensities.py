"""A label map is not built as an image unless the user says that it is one."""

from pathlib import Path

import numpy as np
import pytest
import tifffile

from stereocell.cli.__main__ import main
from support.exhaustive import sweep


@pytest.fixture
def labels(tmp_path: Path) -> Path:
    z, y, x = np.mgrid[:24, :64, :64] // 8
    numbers = np.random.default_rng(0).permutation(1000)[: 3 * 8 * 8].astype(np.uint16) + 1
    path = tmp_path / "cells of mine.ome.tif"
    sizes = {f"PhysicalSize{axis}": 0.5 for axis in "ZYX"}
    voxels = numbers[(z * 8 + y) * 8 + x]
    tifffile.imwrite(path, voxels, metadata={"axes": "ZYX", **sizes}, ome=True)
    return path


def test_a_label_map_ends_the_plan_with_a_line_that_names_both_flags(
    labels: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    for command in (["plan"], ["build", "--workers", "0"]):
        assert main([command[0], str(labels), "-o", str(out), *command[1:]]) == 2
        output = capsys.readouterr().err.strip()
        assert output.count("\n") == 0
        assert (
            f"{labels}: channel 'Channel0' looks like a label map of 192 objects: found" in output
        )
        assert "--as intensity" in output
        assert not out.exists() or not list(out.iterdir())


def test_a_label_map_whose_objects_are_built_is_not_built_as_an_image(
    labels: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    words = ["plan", str(labels), "-o", str(out), "--labels", "."]
    assert main([*words, "--channels", "0"]) == 2
    assert "looks like a label map of 192 objects" in capsys.readouterr().err
    assert main(words) == 0
    output = capsys.readouterr().err
    assert "level 0 (the finest, because only label maps are built)" in output
    assert "looks like" not in output


def test_an_image_that_is_taken_for_labels_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "i.ome.tif"
    voxels = np.random.default_rng(0).poisson(400, (12, 30, 40)).astype(np.uint16)
    sizes = {f"PhysicalSize{axis}": 0.5 for axis in "ZYX"}
    tifffile.imwrite(path, voxels, metadata={"axes": "ZYX", **sizes}, ome=True)
    assert main(["plan", str(path), "-o", str(tmp_path / "out"), "--labels", "cells=."]) == 0
    assert "cells: looks like intensities: " in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("objects", sweep([2, 4], kept=[2]))
@pytest.mark.parametrize("kind", ["uint8", "float32", "float64"])
def test_few_objects_far_from_each_other_are_recognised(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str, objects: int
) -> None:
    """Each block that is read holds at most one object."""
    voxels = np.zeros((40, 400, 400), kind)
    for number, (y, x) in enumerate([(60, 60), (60, 300), (300, 60), (300, 300)][:objects], 1):
        voxels[5:30, y : y + 50, x : x + 50] = number
    path = tmp_path / "few of mine.ome.tif"
    sizes = {f"PhysicalSize{axis}": 0.5 for axis in "ZYX"}
    tifffile.imwrite(path, voxels, metadata={"axes": "ZYX", **sizes}, ome=True)
    assert main(["plan", str(path), "-o", str(tmp_path / "out")]) == 2
    assert f"looks like a label map of {objects} objects" in capsys.readouterr().err


@pytest.mark.parametrize("kind", ["uint8", "float32"])
def test_a_mask_and_an_image_of_whole_numbers_are_not_label_maps(tmp_path: Path, kind: str) -> None:
    rng = np.random.default_rng(0)
    mask = np.zeros((20, 64, 64), kind)
    mask[5:15, 10:50, 10:50] = 1
    for name, voxels in (("mask", mask), ("image", rng.poisson(40, mask.shape).astype(kind))):
        path = tmp_path / f"{name}.ome.tif"
        sizes = {f"PhysicalSize{axis}": 0.5 for axis in "ZYX"}
        tifffile.imwrite(path, voxels, metadata={"axes": "ZYX", **sizes}, ome=True)
        assert main(["plan", str(path), "-o", str(tmp_path / name)]) == 0


def test_a_label_map_is_built_as_an_image_if_the_user_says_so(labels: Path, tmp_path: Path) -> None:
    assert main(["plan", str(labels), "-o", str(tmp_path / "out"), "--as", "intensity"]) == 0


def test_the_flag_as_accepts_no_other_words(
    labels: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", str(labels), "-o", str(tmp_path / "out"), "--as", "labels"]) == 2
    assert "--as is 'labels', expected intensity" in capsys.readouterr().err


@pytest.mark.parametrize("kind", ["uint32", "int32"])
@pytest.mark.parametrize("objects", [1, 192])
def test_wide_integers_that_number_objects_end_the_plan(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str, objects: int
) -> None:
    z, y, x = np.mgrid[:24, :64, :64] // 8
    number = (z * 8 + y) * 8 + x + 16_777_216  # neighbouring numbers differ in float32's last bit
    voxels = np.where(number - 16_777_216 < objects, number, 0).astype(kind)
    path = tmp_path / "wide.ome.tif"
    sizes = {f"PhysicalSize{axis}": 0.5 for axis in "ZYX"}
    tifffile.imwrite(path, voxels, metadata={"axes": "ZYX", **sizes}, ome=True)
    assert main(["plan", str(path), "-o", str(tmp_path / "out")]) == 2
    assert "--as intensity" in capsys.readouterr().err
    assert main(["plan", str(path), "-o", str(tmp_path / "out"), "--as", "intensity"]) == 0
    output = " ".join("".join(capsys.readouterr()).split())
    assert f"voxels are {kind}: read as float32, which keeps 24 of 32 bits" in output


@pytest.mark.slow
@pytest.mark.parametrize("place", sweep([4, 11], kept=[11]))
def test_a_label_map_among_many_channels_is_recognised(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], place: int
) -> None:
    rng = np.random.default_rng(0)
    z, y, x = np.mgrid[:24, :96, :96] // 12
    voxels = rng.poisson(40, (12, *z.shape)).astype(np.uint16)
    voxels[place] = rng.permutation(1000)[(z * 8 + y) * 8 + x] + 1
    path = tmp_path / "many of mine.ome.tif"
    sizes = {f"PhysicalSize{axis}": 0.5 for axis in "ZYX"}
    tifffile.imwrite(path, voxels, metadata={"axes": "CZYX", **sizes}, ome=True)
    assert main(["plan", str(path), "-o", str(tmp_path / "out")]) == 2
    assert f"channel 'Channel{place}' looks like a label map of" in capsys.readouterr().err
    others = ",".join(str(channel) for channel in range(12) if channel != place)
    assert main(["plan", str(path), "-o", str(tmp_path / "out"), "--channels", others]) == 0


def test_labels_stored_as_floats_with_nan_around_are_recognised(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    z, y, x = np.mgrid[:24, :64, :64] // 8
    voxels = ((z * 8 + y) * 8 + x + 1).astype(np.float32)
    voxels[:, :8] = np.nan
    path = tmp_path / "floats of mine.ome.tif"
    sizes = {f"PhysicalSize{axis}": 0.5 for axis in "ZYX"}
    tifffile.imwrite(path, voxels, metadata={"axes": "ZYX", **sizes}, ome=True)
    assert main(["plan", str(path), "-o", str(tmp_path / "out")]) == 2
    assert "looks like a label map" in capsys.readouterr().err


@pytest.mark.slow
def test_objects_off_the_middle_and_in_a_region_are_recognised(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    z, y, x = np.mgrid[:24, :400, :400] // 8
    voxels = ((z * 50 + y) * 50 + x + 1).astype(np.uint16)
    voxels[:, 100:300, 100:300] = 0
    path = tmp_path / "rim.ome.tif"
    sizes = {f"PhysicalSize{axis}": 0.5 for axis in "ZYX"}
    tifffile.imwrite(path, voxels, metadata={"axes": "ZYX", **sizes}, ome=True)
    for more in ([], ["--region", ":,0:90,0:90"]):
        assert main(["plan", str(path), "-o", str(tmp_path / "out"), *more]) == 2
        assert "looks like a label map" in capsys.readouterr().err
