"""A channel's levels on volumes with a known truth and on empty volumes, in any cut into tiles."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from corpus import all_cases
from corpus.case import Case
from corpus.level_search import LevelSearch, search_levels
from corpus.made import CAMERAS, FAULTS, empty_cases, made_cases, nested_cases
from stereocell.isosurface.channel_level import find_levels
from stereocell.isosurface.level_evidence import Counting, find_padding
from support.exhaustive import sweep

MADE = {case.name: case for case in made_cases()}
NESTED = {case.name: case for case in nested_cases()}
EMPTY = {case.name: case for case in empty_cases()}
# Least Dice that a person would call a good fit. Volumes that are not listed are hard.
EASY = {
    "one blob": 0.9,
    "steep background": 0.85,
    "tissue": 0.95,
    "dim tissue": 0.95,
    "shells": 0.8,
    "eight bit": 0.9,
}


def dice(search: LevelSearch, level: int = 0) -> float:
    inside = search.values > search.found.clear[level].value
    return float(2 * (inside & search.truth).sum() / (inside.sum() + search.truth.sum()))


@pytest.mark.slow
@pytest.mark.parametrize("name", sweep(EASY, kept=[name for name in EASY if name != "dim tissue"]))
def test_the_first_level_finds_the_bodies(name: str) -> None:
    assert dice(search_levels(MADE[name])) > EASY[name]


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    sweep(
        list(EMPTY),
        kept=[f"empty, {c}, {f}" for c, f in zip(CAMERAS, FAULTS[1::2], strict=True)]
        + ["empty, emccd, ramp x 3", "inside tissue, scmos, 2"]
        + [
            "empty, scmos, depth x 10",
            "empty, detector, tissue x 4",
            "empty, counted photons, 0.05",
            "empty, clipped at 10",
        ],
    ),
)
def test_an_empty_volume_has_no_clear_level(name: str) -> None:
    assert search_levels(EMPTY[name]).found.clear == ()


@pytest.mark.slow
def test_the_reason_for_no_surface_names_uneven_light() -> None:
    found = search_levels(EMPTY["empty, emccd, depth x 10"]).found
    assert found.light > 0.95
    assert "lies along the axes alone and in no valley, as with uneven light" in found.why_unclear


@pytest.mark.slow
@pytest.mark.parametrize("name", ["slab", "bodies in depth", "edge at 5 degrees"])
def test_bodies_are_found_in_uneven_light_and_so_are_sections_and_edges(name: str) -> None:
    assert dice(search_levels(MADE[name])) > 0.85


@pytest.mark.slow
def test_levels_do_not_depend_on_the_cut_into_tiles() -> None:
    case = MADE["tissue"]
    cuts = [search_levels(replace(case, grid=grid)).found for grid in ((1, 1), (3, 2), (1, 5))]
    whole = [level.value for level in cuts[0].all_levels]
    assert len(whole) >= 3
    for found in cuts[1:]:
        assert [level.value for level in found.all_levels] == whole
        assert found.noise == cuts[0].noise
        for a, b in zip(found.all_levels, cuts[0].all_levels, strict=True):
            assert a.sharpness == pytest.approx(b.sharpness, rel=1e-9)


@pytest.mark.slow
def test_a_tile_with_voxels_on_one_side_alone_has_no_level() -> None:
    search = search_levels(replace(MADE["tissue"], grid=(1, 8)))
    level = search.found.clear[0]
    judged = [search.found.judge_tile(level, evidence) for _, evidence in search.tiles]
    assert judged[0] is None
    assert judged[-1] is None
    at_rim = [found for found in judged if found is not None]
    assert at_rim
    assert max(found.confidence for found in at_rim) > 0.7


def test_no_background_is_subtracted_from_ct_and_bone_lies_within_skin() -> None:
    rng = np.random.default_rng(3)
    z, y, x = np.mgrid[:40, :96, :96]
    away = np.sqrt((2 * (z - 20.3)) ** 2 + (y - 47.7) ** 2 + (x - 48.1) ** 2)
    hu = np.select([away < 22, away < 27, away < 38], [40.0, 900.0, 60.0], -1000.0)
    hu = ndimage.gaussian_filter(hu, (0.4, 0.8, 0.8))
    voxels = (hu + rng.normal(0, 12, hu.shape)).round().astype(np.int16)
    case = Case("ct", "made", (1000.0, 500.0, 500.0), lambda: (voxels, away < 38), kind="CT")
    search = search_levels(case)
    assert not search.found.subtracts
    outer, inner = search.found.clear[:2]
    assert -900 < outer.value < 0 < 200 < inner.value < 850
    assert dice(search) > 0.96


@pytest.mark.parametrize("ghost", [0.0, 12.0])
def test_the_outer_level_of_mr_keeps_skin_that_is_dimmer_than_the_brain(ghost: float) -> None:
    """Like FLAIR: skin has every brightness up to the brain's, and only the brain has a peak.

    ghost  brightness that half of the air has more than the other half, as a valley of its own
    """
    rng = np.random.default_rng(4)
    z, y, x = np.mgrid[:30, :96, :96]
    away = np.sqrt((3 * (z - 15)) ** 2 + (y - 48) ** 2 + (x - 48) ** 2)
    turn = (np.arctan2(y - 48, x - 48) * 3 / np.pi) % 2 / 2
    signal = np.select([away < 36, away < 38, away < 44], [210.0, 10.0, 30 + 120 * turn**0.7], 0.0)
    signal = ndimage.gaussian_filter(signal, (0.3, 0.7, 0.7))
    signal = np.maximum(signal, np.where(y > 48, ghost, 0))
    noise = rng.normal(0, 1 if ghost else 2, (2, *signal.shape))
    voxels = np.hypot(signal + noise[0], noise[1])
    case = Case("flair", "made", (3000.0, 1000.0, 1000.0), lambda: (voxels, away < 44), kind="MR")
    search = search_levels(case)
    inside = ndimage.binary_fill_holes(search.values > search.found.clear[0].value)
    assert 2 * (inside & search.truth).sum() / (inside.sum() + search.truth.sum()) > 0.95


@pytest.mark.slow
@pytest.mark.parametrize("name", ["nested, 40 photons, x 1.5", "nested, 160 photons, x 5"])
def test_nuclei_in_cells_have_a_level_of_their_own(name: str) -> None:
    search = search_levels(NESTED[name])
    assert len(search.found.clear) == 2
    assert dice(search, 1) > 0.9


def test_equal_bodies_have_no_second_level() -> None:
    """A further level would lie on the inner flank of the same blurred edge."""
    rng = np.random.default_rng(6)
    z, y, x = np.ogrid[:48, :96, :96]
    ball = (z - 24) ** 2 + (y - 48) ** 2 + (x - 40) ** 2 < 18**2
    voxels = rng.poisson(10 + 90 * ball).astype(np.uint16)
    search = search_levels(Case("ball", "made", (1.0, 1.0, 1.0), lambda: (voxels, ball)))
    assert len(search.found.all_levels) == 1
    assert dice(search) > 0.97


def test_equal_voxels_have_no_level() -> None:
    case = Case(
        "flat", "empty", (1.0, 1.0, 1.0), lambda: (np.full((8, 32, 32), 9, np.uint16), None)
    )
    assert search_levels(case).found.clear == ()


def test_padding_is_runs_of_the_darkest_value_and_not_dark_noise() -> None:
    rng = np.random.default_rng(5)
    noisy = rng.poisson(0.7, (6, 64, 64)).astype(np.uint8)
    assert not find_padding(noisy, 0.0, (2, 4, 4)).any()
    padded = noisy + 3
    padded[:, :20] = 0
    found = find_padding(padded, 0.0, (2, 4, 4))
    assert found[:, :20].all()
    assert not found[:, 25:].any()


def test_padding_at_the_end_of_a_row_needs_a_run_of_half_the_length() -> None:
    voxels = np.ones((1, 12, 30))
    # Four of a window of nine; the five beyond the row's end repeat the first voxel
    voxels[0, :, :4] = 0
    assert not find_padding(voxels, 0.0, (2, 4, 4)).any()
    voxels[0, :, 4] = 0
    assert find_padding(voxels, 0.0, (2, 4, 4))[0, :, :9].all()
    narrow = np.zeros((1, 12, 6))  # narrower than the required run
    assert find_padding(narrow, 0.0, (2, 4, 4)).all()


def test_held_out_cases_include_empty_volumes_and_all_names_differ() -> None:
    names = [case.name for case in all_cases()]
    assert len(names) == len(set(names))
    assert {case.group for case in all_cases() if case.held_out} >= {"made", "empty"}


@pytest.mark.slow
def test_tiles_without_voxels_have_no_level() -> None:
    search = search_levels(EMPTY["empty, scmos, plain"])
    bare = [replace(tile, plain=_none(tile.plain), padding=_none(tile.padding), above=None)
            for _, tile in search.tiles]  # fmt: skip
    found = find_levels(bare, counting=Counting(search.counting.scale, None, 0.0), finest_um=1.0)
    assert found.all_levels == ()
    assert found.clear == ()


def _none(sums):  # type: ignore[no-untyped-def]
    return replace(
        sums, **{name: 0 * getattr(sums, name) for name in ("counts", "slopes", "squares")}
    )
