"""The levels that are named beside a channel's own."""

from dataclasses import replace

from stereocell.isosurface.near_levels import find_near_levels, words_of
from support.levels import CLEAR

CORES = replace(CLEAR, value=300.0, share=0.017)
NEARLY = replace(CLEAR, value=60.0, separation=0.67, share=0.7)
NOISE = replace(CLEAR, value=55.0, separation=0.5, sharpness=0.01, share=0.9)


def test_levels_that_are_clear_or_nearly_so_are_near_and_the_surface_itself_is_not() -> None:
    assert find_near_levels([NOISE, NEARLY, CLEAR, CORES], 101.0, is_unsure=False) == (
        NEARLY,
        CORES,
    )


def test_a_likely_level_is_named_beside_an_unsure_surface_alone() -> None:
    likely = replace(NOISE, value=200.0)
    assert likely.confidence > 0.5
    assert find_near_levels([CLEAR, likely], 100.0, is_unsure=False) == ()
    assert find_near_levels([CLEAR, likely], 100.0, is_unsure=True) == (likely,)


def test_a_channel_that_holds_nothing_has_no_near_levels() -> None:
    assert find_near_levels([CLEAR, CORES], None, is_unsure=False) == ()
    assert find_near_levels([NOISE, NEARLY], None, is_unsure=False) == (NEARLY,)


def test_levels_are_told_with_the_share_of_the_voxels_inside() -> None:
    assert words_of([CLEAR, CORES]) == "100 (30% of the voxels), 300 (1.7%)"
    tiny = replace(CORES, value=1234.6, share=0.00018)
    assert words_of([tiny], "+b", 3) == "1230+b (0.018% of the voxels)"
