"""The choice of the iso-value of a channel's surface, and the reasons to call it unsure."""

import json
from pathlib import Path

import numpy as np
import pytest

from corpus.real import data_folder
from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.cli.__main__ import main
from stereocell.planning.level_choice import choose_apart
from stereocell.planning.survey import Survey
from support import phantoms

ComponentSums = dict[str, dict[str, int]]


def _sums(*tiles: tuple[int, int, int], kept_share: float = 1.0) -> ComponentSums:
    """Return the sums over a level's components, by tile.

    tiles       (voxels, largest, count) of each: voxels above the level, voxels of the largest
                component, and number of components
    kept_share  share of the components that are not specks
    """
    names = ("voxels", "largest", "count", "kept")
    return {
        f"r0_c{i}": dict(zip(names, (*tile, round(kept_share * tile[2])), strict=True))
        for i, tile in enumerate(tiles)
    }


TISSUE = _sums((1000, 1000, 1), (900, 890, 4))
CELLS = _sums((100, 10, 40), (90, 9, 50))
TOUCHING = _sums((100, 60, 40), (90, 20, 50))  # the largest components hold .42 of the voxels
# A level that shows the brightest cortex of a whole mouse brain at 25 um
BRIGHT_PARTS = _sums((249778, 89062, 159), (98724, 94128, 32), kept_share=0.05)
SPECKS = _sums((4, 2, 2), (5, 2, 3))


@pytest.mark.parametrize(
    ("by_level", "chosen"),
    [
        ([TISSUE, CELLS], 1),
        ([TISSUE, TOUCHING, CELLS], 2),
        ([TISSUE, TOUCHING], 1),
        ([TISSUE, SPECKS], 0),  # a few specks are not cells
        ([TISSUE, BRIGHT_PARTS], 0),  # specks beside a few large pieces are not cells
        ([TISSUE, _sums((100, 99, 60), (90, 80, 50))], 0),
        ([TISSUE, _sums((0, 0, 0), (0, 0, 0))], 0),
        ([CELLS, TISSUE], 0),
    ],
)
def test_the_level_with_most_components_is_chosen_if_it_parts_cells(
    by_level: list[ComponentSums], chosen: int
) -> None:
    assert choose_apart(by_level) == chosen


def _surveyed(tmp_path: Path, voxels: np.ndarray, *flags: str) -> Survey:
    """Build one channel and return its survey. Without flags the defaults are used."""
    source = phantoms.write_ome_zarr(
        tmp_path / "one.ome.zarr", [voxels], scales=[dict(zip("zyx", (5.0, 2.0, 2.0), strict=True))]
    )
    out = tmp_path / "out"
    flags = flags or ("--preset", "none")
    assert main(["plan", str(source), "-o", str(out), *flags]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    return read_survey(OutFolder(out))


def _bodies(radius_um: float) -> np.ndarray:
    """Return four bright balls, each within a tile of 20 x 20, on a dim, noisy background."""
    shape, rng = (16, 80, 80), np.random.default_rng(2)
    field = np.zeros(shape)
    for y, x in ((20, 20), (60, 100), (140, 60), (100, 140)):
        field += phantoms.blurred_ball(shape, (5.0, 2.0, 2.0), (40.0, y, x), radius_um, 2.0)
    return (100 + 1500 * field + rng.normal(0, 6, shape)).round().astype(np.uint16)


def test_a_level_above_the_display_window_is_unsure(tmp_path: Path) -> None:
    voxels = _bodies(12.0)
    flags = ("--window", "Channel0=50:300")
    (clear,) = _surveyed(tmp_path / "a", voxels).values()
    (unsure,) = _surveyed(tmp_path / "b", voxels, *flags).values()
    assert clear.appearance.surface == "clear"
    assert unsure.appearance.surface == "unsure"
    assert "lies above the display window, which ends at" in unsure.appearance.surface_reason


def test_a_level_is_unsure_if_no_tile_alone_is_sure_of_it(tmp_path: Path) -> None:
    """The whole volume has a level, but no tile has enough bright voxels."""
    voxels = _bodies(7.6)
    (channel,) = _surveyed(tmp_path, voxels, "--grid", "4x4").values()
    assert all(tile.confidence is None for tile in channel.iso.values())
    assert channel.appearance.surface == "unsure"


def test_a_haze_around_far_brighter_structures_is_unsure_and_their_level_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Stain in the cytoplasm around a nucleus looks like this in confocal images."""
    shape, spacing, rng = (16, 80, 80), (5.0, 2.0, 2.0), np.random.default_rng(4)
    cell = phantoms.blurred_ball(shape, spacing, (40.0, 80.0, 80.0), 30.0, 2.0)
    nucleus = phantoms.blurred_ball(shape, spacing, (40.0, 80.0, 80.0), 16.0, 2.0)
    noise = rng.normal(0, 8, shape)
    voxels = (50 + 400 * cell + 20_000 * nucleus + noise).round().clip(0).astype(np.uint16)
    (channel,) = _surveyed(tmp_path, voxels).values()
    assert channel.appearance.surface == "unsure"
    assert "may enclose a haze around brighter structures" in channel.appearance.surface_reason
    inner = channel.levels[1].value
    assert inner == pytest.approx(10_000, rel=0.3)
    assert f"{inner:.5g} (" in channel.near_levels
    output = capsys.readouterr().err
    assert output.count(f"{inner:.5g} (") >= 2  # printed by plan and by units


def test_a_tile_is_never_more_confident_of_a_level_than_its_channel(tmp_path: Path) -> None:
    """A bright core makes one tile confident of the skin around it, but not the whole channel."""
    shape, spacing, rng = (24, 64, 64), (5.0, 2.0, 2.0), np.random.default_rng(0)
    middle = (60.0, 64.0, 64.0)
    skin = phantoms.blurred_ball(shape, spacing, middle, 50.0, 2.0)
    core = phantoms.blurred_ball(shape, spacing, middle, 28.0, 2.0)
    voxels = 100 + 350 * skin + 2500 * core + rng.normal(0, 90, shape)
    (channel,) = _surveyed(tmp_path, voxels.round().clip(0).astype(np.uint16)).values()
    (tile,) = channel.iso.values()
    assert channel.appearance.iso_confidence == channel.levels[0].confidence
    assert tile.confidence == pytest.approx(channel.appearance.iso_confidence)


def test_preset_lightsheet_outlines_the_tissue_if_voxels_are_wider_than_cells(
    tmp_path: Path,
) -> None:
    """At 5 um a voxel, bright structures in tissue are cells, at 25 um parts of a brain."""
    shape, rng = (24, 80, 80), np.random.default_rng(3)
    tissue = phantoms.blurred_ball(shape, (1.0, 1.0, 1.0), (12.0, 40.0, 40.0), 34.0, 1.0)
    bodies = np.zeros(shape)
    for y in range(20, 64, 10):
        for x in range(20, 64, 10):
            for z in (6, 17):
                bodies += phantoms.blurred_ball(shape, (1.0, 1.0, 1.0), (z, y, x), 3.5, 0.5)
    voxels = 50 + 300 * tissue + 1500 * bodies + rng.normal(0, 12, shape)
    taken = []
    for um in (5.0, 25.0):
        flags = ("--preset", "lightsheet", "--spacing-um", f"{um},{um},{um}")
        kept = voxels.round().clip(0).astype(np.uint16)
        (channel,) = _surveyed(tmp_path / f"{um}", kept, *flags).values()
        assert channel.appearance.level is not None
        taken.append(channel.appearance.level)
    assert taken[0].iso > 500
    assert taken[1].background is None
    assert 100 < taken[1].iso < 320


DATA = data_folder()
SHEET = None if DATA is None else next(DATA.glob("brain_cells_2ch/*.tif"), None)


@pytest.mark.slow
@pytest.mark.skipif(not SHEET, reason="needs brain_cells_2ch in STEREOCELL_DATA")
def test_preset_lightsheet_shows_cells_in_dim_and_in_bright_tissue(tmp_path: Path) -> None:
    """No single value parts cells from tissue: the bright layer equals the cells beside it."""
    out = tmp_path / "out"
    flags = ["--preset", "lightsheet", "--channels", "0", "--region", "8:22,100:420,0:320"]
    assert main(["plan", str(SHEET), "-o", str(out), *flags]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    (channel,) = read_survey(OutFolder(out)).values()
    level = channel.appearance.level
    assert level is not None
    assert level.background is not None
    assert channel.appearance.surface == "clear"
    (tile,) = channel.iso.values()
    path = out / tile.files["components"]
    components = json.loads(path.read_text("utf-8"))["components"]
    assert components["count"] > 60
    assert components["largest"] < 0.5 * components["voxels"]


def _lit(least: float) -> np.ndarray:
    """Return balls on a background, both in light that decreases along x from 1 to `least`."""
    shape, rng = (32, 96, 96), np.random.default_rng(6)
    field = np.zeros(shape)
    for place in rng.uniform((20, 12, 12), (140, 180, 180), (30, 3)):
        middle = (float(place[0]), float(place[1]), float(place[2]))
        ball = phantoms.blurred_ball(shape, (5.0, 2.0, 2.0), middle, 7.0, 1.5)
        field = np.maximum(field, ball)
    light = np.linspace(1.0, least, shape[2])
    return (light * (600 + 1000 * field) + rng.normal(0, 12, shape)).round().astype(np.uint16)


def test_one_level_in_uneven_light_is_unsure_and_the_plan_says_the_same(tmp_path: Path) -> None:
    (even,) = _surveyed(tmp_path / "a", _lit(1.0)).values()
    assert even.appearance.surface == "clear"
    (uneven,) = _surveyed(tmp_path / "b", _lit(0.5)).values()
    level = uneven.appearance.level
    assert level is not None
    assert level.background is None
    assert uneven.appearance.surface == "unsure"
    assert "uneven light" in uneven.appearance.surface_reason
    (note,) = [
        note for note in OutFolder(tmp_path / "b" / "out").plan().notes if "iso-value" in note
    ]
    assert f"unsure iso-value {level.iso:.5g} (" in note
