"""Which rung of a ladder has the surface where that of many components is asked for."""

import pytest

from stereocell.building.level_choice import choose_rung

Rung = dict[str, dict[str, int]]


def _rung(*tiles: tuple[int, int, int]) -> Rung:
    """Return a rung's sums by tile, of (voxels, largest, count)."""
    names = ("voxels", "largest", "count")
    return {f"r0_c{i}": dict(zip(names, tile, strict=True)) for i, tile in enumerate(tiles)}


TISSUE = _rung((1000, 1000, 1), (900, 890, 4))
CELLS = _rung((100, 10, 40), (90, 9, 50))
TOUCHING = _rung((100, 60, 40), (90, 20, 50))  # the largest hold .42
SPECKS = _rung((4, 2, 2), (5, 2, 3))


@pytest.mark.parametrize(
    ("rungs", "chosen"),
    [
        ([TISSUE, CELLS], 1),
        ([TISSUE, TOUCHING, CELLS], 2),
        ([TISSUE, TOUCHING], 1),
        ([TISSUE, SPECKS], 0),  # a few specks are no cells
        ([TISSUE, _rung((100, 99, 60), (90, 80, 50))], 0),
        ([TISSUE, _rung((0, 0, 0), (0, 0, 0))], 0),
        ([CELLS, TISSUE], 0),
    ],
)
def test_the_first_rung_of_many_else_that_of_many_that_touch_else_the_outer(
    rungs: list[Rung], chosen: int
) -> None:
    assert choose_rung(rungs) == chosen
