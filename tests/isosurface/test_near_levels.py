"""Levels that are listed beside the level of a channel's surface."""

from dataclasses import replace

from stereocell.isosurface.near_levels import find_near_levels, words_of
from support.levels import CLEAR

CORES = replace(CLEAR, value=300.0, share=0.017)
NEARLY = replace(CLEAR, value=60.0, separation=0.67, share=0.7)
NOISE = replace(CLEAR, value=55.0, separation=0.5, sharpness=0.01, share=0.9)


def test_clear_and_nearly_clear_levels_are_listed_without_the_surface_s_own() -> None:
    assert find_near_levels([NOISE, NEARLY, CLEAR, CORES], 101.0, is_unsure=False) == (
        NEARLY,
        CORES,
    )


def test_a_likely_level_is_listed_only_beside_an_unsure_surface() -> None:
    likely = replace(NOISE, value=200.0)
    assert likely.confidence > 0.5
    assert find_near_levels([CLEAR, likely], 100.0, is_unsure=False) == ()
    assert find_near_levels([CLEAR, likely], 100.0, is_unsure=True) == (likely,)


def test_an_empty_channel_has_no_near_levels() -> None:
    assert find_near_levels([CLEAR, CORES], None, is_unsure=False) == ()
    assert find_near_levels([NOISE, NEARLY], None, is_unsure=False) == (NEARLY,)


def test_levels_are_printed_with_the_share_of_the_voxels_inside() -> None:
    assert words_of([CLEAR, CORES]) == "100 (30% of the voxels), 300 (1.7%)"
    tiny = replace(CORES, value=1234.6, share=0.00018)
    assert words_of([tiny], "+b", 3) == "1230+b (0.018% of the voxels)"
