"""Labels that mean the background, and labels that a file's data type can't distinguish."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray

from stereocell.cli.__main__ import main
from stereocell.objects.options import ObjectOptions

BALLS = [(7, 8, 9), (7, 24, 10), (8, 12, 30)]
SHAPE = (16, 32, 40)


def numbered(*, background: float, first: int = 1, dtype: Any = np.uint16) -> NDArray[Any]:
    """Return three balls numbered from `first` on a background."""
    voxels = np.full(SHAPE, background, np.float64)
    places = np.indices(SHAPE)
    for number, centre in enumerate(BALLS, start=first):
        far = sum((p - c) ** 2 for p, c in zip(places, centre, strict=True))
        voxels[far < 36] = number
    return voxels.astype(dtype)


def planned(
    tmp_path: Path, voxels: NDArray[Any], capsys: pytest.CaptureFixture[str], *flags: object
) -> str:
    """Return the output of `plan` for a label map."""
    tifffile.imwrite(tmp_path / "l.tif", voxels, metadata={"axes": "ZYX"})
    given = ("plan", tmp_path / "l.tif", "-o", tmp_path / "o", "--labels", ".", "--force")
    arguments = [*given, "--spacing-um", "1,1,1", *flags]
    assert main([str(argument) for argument in arguments]) == 0
    return " ".join("".join(capsys.readouterr()).split())


@pytest.mark.parametrize(("background", "dtype"), [(65535, np.uint16), (255, np.uint8), (1, "<i4")])
def test_a_background_that_is_not_0_is_reported_and_left_out_on_request(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], background: int, dtype: Any
) -> None:
    voxels = numbered(background=background, first=2, dtype=dtype)
    printed = planned(tmp_path, voxels, capsys)
    assert "4 objects" in printed
    share = f"{(voxels == background).mean():.1%}"
    assert f"object {background}, the largest, has {share} of the voxels and touches" in printed
    assert f"--background {background} leaves it out" in printed
    printed = planned(tmp_path, voxels, capsys, "--background", background)
    assert "3 objects" in printed
    assert "background;" not in printed
    assert json.loads((tmp_path / "o/plan.json").read_text("utf-8"))["labels"][0]["background"]


def test_a_background_below_0_is_left_out_on_request(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    voxels = numbered(background=-2, dtype=np.int32)
    assert "3 objects" in planned(tmp_path, voxels, capsys, "--background", -2)
    plan = json.loads((tmp_path / "o/plan.json").read_text("utf-8"))
    assert plan["labels"][0]["background"] == -2


@pytest.mark.parametrize(("covered", "is_reported"), [(1, True), (8, False)])
def test_a_background_that_misses_a_side_is_reported_if_it_has_most_voxels(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], covered: int, is_reported: bool
) -> None:
    voxels = numbered(background=65535)
    voxels[:covered] = 9  # an object covers the first planes
    printed = planned(tmp_path, voxels, capsys)
    assert ("touches 5 of six sides: it is probably the background" in printed) is is_reported


def test_a_background_of_0_is_not_mentioned(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    voxels = numbered(background=0)
    assert "background" not in planned(tmp_path, voxels, capsys)
    assert (
        "background" not in json.loads((tmp_path / "o/plan.json").read_text("utf-8"))["labels"][0]
    )
    # a label that no voxel has, such as the largest number of another data type
    assert "3 objects" in planned(tmp_path, voxels, capsys, "--background", 70000)


def test_a_build_without_the_background_has_only_the_objects(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    planned(tmp_path, numbered(background=65535), capsys, "--background", 65535)
    assert main(["units", str(tmp_path / "o"), "--workers", "0"]) == 0
    assert "l: 3 objects" in "".join(capsys.readouterr())


@pytest.mark.parametrize(("dtype", "exact"), [(np.float32, 2**24), (np.float16, 2**11)])
def test_labels_that_a_float_rounds_are_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], dtype: Any, exact: int
) -> None:
    printed = planned(tmp_path, numbered(background=0, first=exact, dtype=dtype), capsys)
    assert "2 objects" in printed  # exact + 1 is rounded to exact
    assert f"rounds whole numbers beyond {exact:,}" in printed
    assert "rounds" not in planned(tmp_path, numbered(background=0, first=9, dtype=dtype), capsys)


def test_labels_that_use_up_their_data_type_are_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    voxels = np.zeros((8, 64, 64), np.uint8)
    for number in range(255):
        y, x = divmod(number, 16)
        voxels[2:5, 4 * y : 4 * y + 3, 4 * x : 4 * x + 3] = number + 1
    assert "all 255 numbers of uint8 are in use" in planned(tmp_path, voxels, capsys)
    voxels[voxels == 17] = 0
    assert "in use" not in planned(tmp_path, voxels, capsys)


def test_a_background_needs_labels(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tifffile.imwrite(tmp_path / "l.tif", numbered(background=0), metadata={"axes": "ZYX"})
    arguments = ["plan", str(tmp_path / "l.tif"), "-o", str(tmp_path / "o"), "--background", "7"]
    assert main([*arguments, "--spacing-um", "1,1,1"]) == 2
    assert "--background is '7', expected --labels with it" in capsys.readouterr().err
    assert ObjectOptions().background == 0
