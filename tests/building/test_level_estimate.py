"""The plan names levels that are near one another: exactly for small volumes, else by blocks."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.building.level_estimate import BLOCK, estimate_level
from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.cli.__main__ import main
from stereocell.transfer.joint_histogram import sample_boxes
from support import phantoms


def _cells(shape: tuple[int, int, int], core: float) -> NDArray[np.uint16]:
    """Return cells 400 high at random places, one in 32 x 32 x 32 voxels, each with a core."""
    rng, unit = np.random.default_rng(3), (1.0, 1.0, 1.0)
    field = np.zeros(shape)
    for _ in range(math.prod(shape) >> 15):
        block = tuple(slice(start, start + 32) for start in rng.integers(0, np.subtract(shape, 31)))
        cell = 400 * phantoms.blurred_ball((32, 32, 32), unit, (15.5, 15.5, 15.5), 10.0, 1.5)
        cell += core * phantoms.blurred_ball((32, 32, 32), unit, (15.5, 15.5, 15.5), 5.0, 1.5)
        field[block] = np.maximum(field[block], cell)
    return (200 + field + rng.normal(0, 20, shape)).round().clip(0).astype(np.uint16)


def _planned(tmp_path: Path, voxels: NDArray[np.uint16], *flags: str) -> Path:
    """Write voxels of 1 um, make a plan, and return the output folder."""
    scales = [dict(zip("zyx", (1.0, 1.0, 1.0), strict=True))]
    source = phantoms.write_ome_zarr(tmp_path / "one.ome.zarr", [voxels], scales=scales)
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), *flags]) == 0
    return tmp_path / "out"


def _level_notes(out: Path) -> list[str]:
    """Return the notes of a plan on its only channel."""
    return [note for note in OutFolder(out).plan().notes if note.startswith("Channel0: ")]


def test_the_plan_names_the_near_levels_of_a_small_volume_as_a_build_finds_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = _planned(tmp_path, _cells((32, 64, 64), core=1200))
    (note,) = _level_notes(out)
    assert f"plan: {note}" in capsys.readouterr().err
    assert note in json.loads((out / "provenance.json").read_text("utf-8"))["notes"]
    assert main(["units", str(out), "--workers", "0"]) == 0
    (channel,) = read_survey(OutFolder(out)).values()
    level = channel.appearance.level
    assert level is not None
    assert channel.near_levels
    assert f"level {level.iso:.5g} (" in note
    assert note.endswith(f"near levels: {channel.near_levels}")


@pytest.mark.parametrize("flags", [("--iso-value", "0=400"), ("--preset", "em")])
def test_the_plan_names_no_levels_where_none_is_to_be_found(
    tmp_path: Path, flags: tuple[str, str]
) -> None:
    out = _planned(tmp_path, _cells((32, 64, 64), core=1200), *flags)
    assert not _level_notes(out)


def test_a_lone_clear_level_is_not_mentioned(tmp_path: Path) -> None:
    assert not _level_notes(_planned(tmp_path, _cells((32, 64, 64), core=0)))


def test_blocks_find_nearly_the_levels_of_all_voxels(tmp_path: Path) -> None:
    plan = OutFolder(_planned(tmp_path, _cells((96, 128, 128), core=1200))).plan()
    boxes = sample_boxes(plan.region, 400_000, BLOCK)
    assert len(boxes) > 8
    whole, blocks = (
        estimate_level(plan, plan.channels[0], each).levels for each in ([plan.region], boxes)
    )
    assert whole is not None
    assert blocks is not None
    assert len(whole.clear) == len(blocks.clear) > 1
    for level, estimate in zip(whole.clear, blocks.clear, strict=True):
        assert estimate.value == pytest.approx(level.value, rel=0.05)
        assert 0.5 < estimate.share / level.share < 2  # by chance: there are 48 cells


def test_estimated_levels_are_told_with_three_digits(tmp_path: Path) -> None:
    out = _planned(tmp_path, _cells((96, 160, 160), core=1200))
    (note,) = _level_notes(out)
    assert "level about" in note
    values = [word for word in note.split() if word.isdigit()]
    assert values == [f"{float(f'{float(value):.3g}'):g}" for value in values]
    assert max(map(float, values)) > 100
