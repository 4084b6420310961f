"""The plan states a channel's levels: exactly for small volumes, otherwise from blocks."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.cli.__main__ import main
from stereocell.model.sample_boxes import sample_boxes
from stereocell.planning.level_estimate import BLOCK, estimate_level
from stereocell.planning.plan_notes import words_of_spacing
from support import phantoms


def _cells(shape: tuple[int, int, int], core: float) -> NDArray[np.uint16]:
    """Return cells of 400 above the background, one in 32 x 32 x 32 voxels, each with a core."""
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
    return [note for note in OutFolder(out).plan().notes if note.startswith("Channel0")]


def test_the_plan_states_the_near_levels_of_a_small_volume_as_a_build_finds_them(
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
    assert f"iso-value {level.iso:.5g} (" in note
    assert note.endswith(f"near iso-values: {channel.near_levels}")


@pytest.mark.parametrize(
    ("flags", "expected"),
    [
        (("--iso-value", "0=400"), ["Channel0: iso-value 400, from the settings"]),
        (
            ("--iso-value", "0=150+b"),
            ["Channel0: iso-value 150+b (+b: above the background), from the settings"],
        ),
        (
            ("--preset", "em"),
            ["Channel0: no surface is built by default (--surfaces Channel0=outer builds one)"],
        ),
        (
            ("--surfaces", "0=900,inner"),
            [
                "Channel0 900: iso-value 900, from the settings",
                "Channel0 inner: the build finds the inner iso-value",
            ],
        ),
    ],
)
def test_the_plan_states_a_level_from_the_settings_without_reading_voxels(
    tmp_path: Path, flags: tuple[str, str], expected: list[str]
) -> None:
    assert _level_notes(_planned(tmp_path, _cells((32, 64, 64), core=1200), *flags)) == expected


def test_the_plan_states_a_single_clear_level_and_the_voxel_size(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = _planned(tmp_path, _cells((32, 64, 64), core=0))
    (note,) = _level_notes(out)
    assert re.fullmatch(r"Channel0: clear iso-value [0-9.]+ \([0-9.]+% of the voxels\)", note)
    printed = " ".join(capsys.readouterr().err.split())
    assert f"plan: {note}" in printed
    assert "32 x 64 x 64 voxels (z, y, x) of 1 x 1 x 1 um, 1 tile x 1 channel" in printed


def test_large_voxel_sizes_are_printed_in_millimetres() -> None:
    assert words_of_spacing((5000.0, 488.28125, 488.28125)) == "5 x 0.4883 x 0.4883 mm"
    assert words_of_spacing((200.0, 50.0, 50.0)) == "200 x 50 x 50 um"


def test_the_plan_says_that_noise_has_no_surface(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).poisson(200, (32, 64, 64)).astype(np.uint16)
    (note,) = _level_notes(_planned(tmp_path, noise))
    assert note.startswith("Channel0: no surface: neighbouring voxels are unrelated")


def test_the_plan_calls_a_level_unsure_if_no_tile_has_enough_voxels_above_it(
    tmp_path: Path,
) -> None:
    """A cube of 9 voxels a side holds less than .2 % of the volume."""
    lone = np.random.default_rng(0).normal(200, 10, (64, 96, 96))
    lone[20:29, 40:49, 40:49] += 2000
    out = _planned(tmp_path, lone.round().astype(np.uint16))
    (note,) = _level_notes(out)
    assert note.startswith("Channel0: unsure iso-value ")
    assert "no tile by itself has enough voxels on both sides of the iso-value" in note
    assert main(["units", str(out), "--workers", "0"]) == 0
    (channel,) = read_survey(OutFolder(out)).values()
    assert channel.appearance.surface == "unsure"
    assert "no tile by itself" in channel.appearance.surface_reason


def test_the_plan_explains_how_the_build_chooses_between_levels(tmp_path: Path) -> None:
    flags = ("--preset", "lightsheet", "--grid", "1x1")
    (note,) = _level_notes(_planned(tmp_path, _cells((32, 64, 64), core=1200), *flags))
    assert note.startswith("Channel0: the build takes one of ")
    assert ": the one with the most separate pieces" in note
    assert note.endswith(" (+b: above the background)") == ("+b (" in note)


def test_the_plan_counts_the_channels_whose_level_it_does_not_estimate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stereocell.planning.level_estimate.MAX_CHANNELS", 1)
    voxels, scales = _cells((32, 64, 64), core=0), [dict.fromkeys("zyx", 1.0)]
    source = phantoms.write_ome_zarr(
        tmp_path / "a.ome.zarr", [np.stack([voxels] * 3)], axes="czyx", scales=scales
    )
    assert main(["plan", str(source), "-o", str(tmp_path / "out")]) == 0
    notes = OutFolder(tmp_path / "out").plan().notes
    assert (
        "the plan does not estimate the iso-values of 2 other channels: the build finds them"
        in notes
    )
    monkeypatch.setattr("stereocell.planning.level_estimate.MOST_VOXELS", 1000)
    assert main(["plan", str(source), "-o", str(tmp_path / "out")]) == 0
    notes = OutFolder(tmp_path / "out").plan().notes
    assert (
        "the plan does not estimate the iso-values of the channels: the build finds them" in notes
    )


def test_blocks_give_nearly_the_same_levels_as_all_voxels(tmp_path: Path) -> None:
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
        assert (
            0.5 < estimate.share / level.share < 2
        )  # the number of cells in the blocks varies by chance; there are 48


def test_estimated_levels_are_printed_with_three_digits(tmp_path: Path) -> None:
    out = _planned(tmp_path, _cells((96, 160, 160), core=1200))
    (note,) = _level_notes(out)
    assert "iso-value about" in note
    values = [word for word in note.split() if word.isdigit()]
    assert values == [f"{float(f'{float(value):.3g}'):g}" for value in values]
    assert max(map(float, values)) > 100
