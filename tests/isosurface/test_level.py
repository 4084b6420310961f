"""The levels that may have a surface: the clear ones, and an outer one that is nearly clear."""

from dataclasses import replace
from math import inf

import pytest

from corpus.level_search import search_levels
from corpus.real import real_cases
from stereocell.isosurface.level import bodies_in_haze, shown_of
from support.levels import CLEAR

SPECKS = replace(CLEAR, value=900.0, share=0.002)
CORES = replace(CLEAR, value=300.0, share=0.1)


@pytest.mark.parametrize(
    "measures", [{"separation": 0.67}, {"separation": 0.69, "sharpness": 0.035}, {"snr": 2.5}]
)
def test_a_nearly_clear_level_is_put_before_specks(measures: dict[str, float]) -> None:
    outer = replace(CLEAR, **measures)
    assert not outer.is_clear
    assert shown_of([outer, SPECKS]) == (outer, SPECKS)


def test_a_nearly_clear_level_is_put_before_one_above_the_display_window() -> None:
    outer = replace(CLEAR, separation=0.67)
    assert shown_of([outer, CORES], highest=400.0) == (CORES,)
    assert shown_of([outer, CORES], highest=250.0) == (outer, CORES)


def test_a_nearly_clear_level_in_a_valley_is_put_before_any_other() -> None:
    outer = replace(CLEAR, snr=2.5, dip=0.5)
    assert shown_of([outer, CORES]) == (outer, CORES)


def test_levels_that_are_far_from_clear_are_skipped() -> None:
    # In a normal distribution .64 of the variance lies between the halves.
    for measures in ({"separation": 0.64}, {"snr": 2.0}, {"rise": 1.0}):
        assert shown_of([replace(CLEAR, **measures), SPECKS]) == (SPECKS,)


def test_without_a_clear_level_no_level_is_shown() -> None:
    assert shown_of([replace(CLEAR, separation=0.67)], highest=inf) == ()


TRUNK = next((case for case in real_cases() if case.name == "mr trunk"), None)


@pytest.mark.skipif(TRUNK is None, reason="needs level_corpus/mr_trunk.npz in STEREOCELL_DATA")
def test_a_coarse_mr_of_a_trunk_keeps_its_skin() -> None:
    """Air and tissue differ by 2.5 times the noise. The next level would keep only fat."""
    assert TRUNK is not None
    search = search_levels(TRUNK)
    outer = search.found.shown()[0]
    assert outer not in search.found.clear
    inside = search.values > outer.value
    assert 2 * (inside & search.truth).sum() / (inside.sum() + search.truth.sum()) > 0.95


@pytest.mark.parametrize(
    ("times", "dip", "is_haze"),
    [(30.0, 0.3, True), (9.0, 0.3, False), (30.0, 1.0, False)],
)
def test_a_level_around_far_brighter_bodies_may_be_a_haze(
    times: float, dip: float, is_haze: bool
) -> None:
    """Only bodies with a peak of their own count, and not a tail of bright voxels."""
    bodies = replace(CLEAR, value=2000.0, inside=50 + times * CLEAR.contrast, dip=dip)
    assert bodies_in_haze(CLEAR, [CLEAR, bodies]) == (bodies if is_haze else None)
    assert bodies_in_haze(bodies, [CLEAR, bodies]) is None
