"""Neighbours' iso-values are drawn together within their plateaus; verdicts on surfaces."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from stereocell.isosurface.neighbour_consensus import (
    PLATEAU,
    Reconciled,
    find_neighbours,
    reconcile_iso_values,
)
from stereocell.model.tiling import Box, Tile, cut

TILES = cut(Box((0, 0, 0), (4, 20, 30)), (4, 10, 10))  # 3 columns x 2 rows
LEVELS = np.linspace(0, 1000, 101)
BOUND = 0.4


def _found(
    value: float, width: float, confidence: float = 0.9, strength: float = 1.0
) -> dict[str, Any]:
    score = np.clip(1 - ((LEVELS - value) / width) ** 2, 0, 1)
    return {
        "value": value,
        "confidence": confidence,
        "strength": strength,
        "levels": LEVELS.tolist(),
        "score": score.tolist(),
    }


def _reconcile(tiles: Sequence[Tile], found: dict[str, dict[str, Any]]) -> Reconciled:
    return reconcile_iso_values(find_neighbours(tiles), found, BOUND)


def test_a_jump_without_evidence_is_drawn_to_the_neighbours() -> None:
    found = {tile.id: _found(400, 300) for tile in TILES} | {"r0_c1": _found(420, 300)}
    pulled = _reconcile(TILES, found).values
    assert pulled["r0_c1"] == pytest.approx(410)
    assert pulled["r1_c0"] == pytest.approx(400)
    assert pulled["r0_c0"] == pytest.approx(405)  # its neighbours are 420 and 400


def test_two_neighbours_meet_and_do_not_change_places() -> None:
    pair = cut(Box((0, 0, 0), (4, 10, 20)), (4, 10, 10))
    pulled = _reconcile(pair, {"r0_c0": _found(400, 300), "r0_c1": _found(420, 300)}).values
    assert pulled == pytest.approx({"r0_c0": 410, "r0_c1": 410})


def test_a_jump_with_evidence_stays_but_for_its_summit() -> None:
    found = {tile.id: _found(400, 300) for tile in TILES} | {"r0_c1": _found(800, 100)}
    pulled = _reconcile(TILES, found).values
    reach = 100 * np.sqrt(1 - PLATEAU)
    assert pulled["r0_c1"] == pytest.approx(800 - reach, abs=10)
    assert pulled["r1_c0"] == pytest.approx(400)


def test_tiles_without_a_value_have_no_say_and_get_none() -> None:
    nothing = {"value": None}
    found = {tile.id: nothing for tile in TILES} | {"r0_c0": _found(500, 100)}
    reconciled = _reconcile(TILES, found)
    assert reconciled.values == {tile.id: None for tile in TILES} | {"r0_c0": 500}
    assert reconciled.surface_confidence == "clear"
    assert reconciled.confidence == 0.9


def test_channel_without_any_value_has_no_surface() -> None:
    reconciled = _reconcile(TILES, {tile.id: {"value": None} for tile in TILES})
    assert (reconciled.surface_confidence, reconciled.confidence) == ("none", 0)
    assert set(reconciled.values.values()) == {None}


def test_a_jump_weakens_weak_evidence_and_leaves_strong_evidence() -> None:
    found = {tile.id: _found(400, 100) for tile in TILES}
    alike = _reconcile(TILES, found).confidences["r0_c1"]
    assert alike == 0.9
    weak = _reconcile(TILES, found | {"r0_c1": _found(50, 20, 0.42)})
    assert weak.confidences["r0_c1"] == pytest.approx(0.42 ** (1 + 0.25 * 350 / 400))
    assert weak.values["r0_c1"] is None  # below the bound: the mean of the others
    strong = _reconcile(TILES, found | {"r0_c1": _found(50, 20, 0.9)})
    assert strong.confidences["r0_c1"] > 0.87
    assert strong.values["r0_c1"] is not None


def test_neighbours_that_are_not_sure_are_no_reason_for_doubt() -> None:
    found = {tile.id: _found(20, 10, 0.1, 0.001) for tile in TILES}
    reconciled = _reconcile(TILES, found | {"r0_c1": _found(400, 100, 0.5)})
    assert reconciled.confidences["r0_c1"] == 0.5
    assert reconciled.confidences["r0_c0"] < 0.1  # while it is one for them


def test_a_stain_in_few_tiles_is_clear_by_the_strength_of_its_edges() -> None:
    found = {tile.id: _found(20, 10, 0.1, 0.001) for tile in TILES}
    reconciled = _reconcile(TILES, found | {"r0_c1": _found(400, 100, 0.9)})
    assert reconciled.surface_confidence == "clear"
    assert reconciled.confidence == pytest.approx(0.9, abs=0.01)
    assert {tile for tile, value in reconciled.values.items() if value is not None} == {"r0_c1"}


def test_channel_of_doubtful_tiles_is_unclear_and_keeps_what_was_found() -> None:
    found = {tile.id: _found(100, 10, 0.1) for tile in TILES}
    reconciled = _reconcile(TILES, found | {"r0_c1": _found(100, 10, 0.41)})  # one by chance
    assert reconciled.surface_confidence == "unclear"
    assert set(reconciled.values.values()) == {100}


def test_channel_without_any_edge_is_judged_by_the_plain_mean() -> None:
    reconciled = _reconcile(TILES, {tile.id: _found(100, 10, 0.2, 0.0) for tile in TILES})
    assert reconciled.surface_confidence == "unclear"
    assert reconciled.confidence == pytest.approx(0.2)


def test_neighbours_share_a_face_and_not_only_an_edge() -> None:
    tiles = cut(Box((3, 5, 7), (11, 25, 37)), (4, 10, 10))  # 2 x 2 x 3
    neighbours = find_neighbours(tiles)
    for a in tiles:
        for b in tiles:
            touch = sum(
                a.box.stop[i] == b.box.start[i] or b.box.stop[i] == a.box.start[i] for i in range(3)
            )
            apart = any(
                a.box.stop[i] < b.box.start[i] or b.box.stop[i] < a.box.start[i] for i in range(3)
            )
            assert (b.id in neighbours[a.id]) == (touch == 1 and not apart)
    assert all(len(set(beside)) == len(beside) for beside in neighbours.values())
