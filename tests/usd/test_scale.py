"""A stage of 22 x 11 tiles and 70 channels, 16 940 units, opens with its payloads unloaded.

One tile is written; the others are copies of its layer. Unloaded tiles are not read.
"""

from typing import Any

import pytest

from support.many_tiles import CHANNELS, COLUMNS, EDGE, ROWS, open_unloaded, write_many

OPENS_S = 10.0
GROWTH_MIB = 300  # growth of a process's memory when it opens the stage


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return open_unloaded(write_many(tmp_path_factory.mktemp("many")))


@pytest.mark.slow
def test_242_tiles_are_known_without_their_payloads(seen: dict[str, Any]) -> None:
    assert (seen["tiles"], seen["loaded"]) == (COLUMNS * ROWS, 0)
    assert seen["lods"] == ["lod1"]
    assert seen["width_um"] == COLUMNS * EDGE
    assert seen["appearances"] == CHANNELS


@pytest.mark.slow
def test_242_tiles_open_in_little_memory(seen: dict[str, Any]) -> None:
    if seen["growth_kib"] is None:
        pytest.skip("the peak of a process's memory is read from /proc")
    assert seen["growth_kib"] < GROWTH_MIB * 1024


@pytest.mark.slow
def test_16_940_units_open_in_seconds(seen: dict[str, Any]) -> None:
    assert seen["seconds"] < OPENS_S
