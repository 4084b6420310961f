"""The iso-value between tile centres."""

import numpy as np

from stereocell.isofield import make_iso_field
from stereocell.tiling import Box, cut

REGION = Box((0, 0, 0), (10, 40, 100))
TILES = cut(REGION, (10, 20, 20))


def _found() -> dict[str, float | None]:
    rng = np.random.default_rng(0)
    return {tile.id: float(rng.uniform(100, 900)) for tile in TILES}


def test_each_centre_has_its_own_value_and_between_it_is_linear() -> None:
    found = _found()
    field = make_iso_field(TILES, found)
    assert field is not None
    values = field.at(REGION)
    # centres lie at 9.5 + 20 k: half-way between two voxels
    left, right = found["r0_c1"], found["r0_c2"]
    assert left is not None
    assert right is not None
    middle = values[0, 5, 39:41].astype(float)
    np.testing.assert_allclose(middle.mean(), (left + right) / 2, rtol=1e-5)
    np.testing.assert_allclose(values[0, 0, 29:31].mean(), left, rtol=0.05)
    slope = np.diff(values[0, 0, 31:49].astype(float))
    np.testing.assert_allclose(slope, (right - left) / 20, rtol=1e-2)


def test_neighbours_agree_bit_by_bit_from_their_own_parts() -> None:
    field = make_iso_field(TILES, _found())
    assert field is not None
    whole = field.at(REGION)
    for tile in TILES:
        for halo in ((0, 0, 0), (2, 8, 8), (9, 70, 70)):  # the last: larger than its neighbours
            window = tile.box.grown(halo, REGION)
            np.testing.assert_array_equal(field.around(window).at(window), whole[window.slices])


def test_tile_without_a_value_takes_the_others_mean() -> None:
    found = dict.fromkeys((tile.id for tile in TILES), 500.0) | {"r0_c0": None}
    field = make_iso_field(TILES, found)
    assert field is not None
    np.testing.assert_array_equal(field.at(REGION), 500)


def test_channel_without_any_value_has_no_field() -> None:
    assert make_iso_field(TILES, {tile.id: None for tile in TILES}) is None
