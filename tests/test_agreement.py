"""Neighbours' iso-values are drawn together within their summits, and no further."""

from typing import Any

import numpy as np
import pytest

from stereocell.agreement import SUMMIT, agree
from stereocell.tiling import Box, cut

TILES = cut(Box((0, 0, 0), (4, 20, 30)), (4, 10, 10))  # 3 columns x 2 rows
LEVELS = np.linspace(0, 1000, 101)


def _found(value: float, width: float) -> dict[str, Any]:
    score = np.clip(1 - ((LEVELS - value) / width) ** 2, 0, 1)
    return {"value": value, "levels": LEVELS.tolist(), "score": score.tolist()}


def test_a_jump_without_evidence_is_drawn_to_the_neighbours() -> None:
    found = {tile.id: _found(400, 300) for tile in TILES} | {"r0_c1": _found(420, 300)}
    drawn = agree(TILES, found)
    assert drawn["r0_c1"] == pytest.approx(410)
    assert drawn["r1_c0"] == pytest.approx(400)
    assert drawn["r0_c0"] == pytest.approx(405)  # its neighbours are 420 and 400


def test_two_neighbours_meet_and_do_not_change_places() -> None:
    pair = cut(Box((0, 0, 0), (4, 10, 20)), (4, 10, 10))
    drawn = agree(pair, {"r0_c0": _found(400, 300), "r0_c1": _found(420, 300)})
    assert drawn == pytest.approx({"r0_c0": 410, "r0_c1": 410})


def test_a_jump_with_evidence_stays_but_for_its_summit() -> None:
    found = {tile.id: _found(400, 300) for tile in TILES} | {"r0_c1": _found(800, 100)}
    drawn = agree(TILES, found)
    reach = 100 * np.sqrt(1 - SUMMIT)
    assert drawn["r0_c1"] == pytest.approx(800 - reach, abs=10)
    assert drawn["r1_c0"] == pytest.approx(400)


def test_tiles_without_a_value_have_no_say_and_get_none() -> None:
    nothing = {"value": None}
    found = {tile.id: nothing for tile in TILES} | {"r0_c0": _found(500, 100)}
    drawn = agree(TILES, found)
    assert drawn == {tile.id: None for tile in TILES} | {"r0_c0": 500}
