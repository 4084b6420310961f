"""The field of iso-values between tile centres."""

import numpy as np

from stereocell.model.lattice_field import LatticeField, make_iso_field
from stereocell.model.tiling import Box, cut

REGION = Box((0, 0, 0), (10, 40, 100))
TILES = cut(REGION, (10, 20, 20))


def _found() -> dict[str, float | None]:
    rng = np.random.default_rng(0)
    return {tile.id: float(rng.uniform(100, 900)) for tile in TILES}


def test_each_centre_has_its_own_value_and_the_field_is_linear_in_between() -> None:
    found = _found()
    field = make_iso_field(TILES, found)
    assert field is not None
    values = field.at(REGION)
    # centres lie at 9.5 + 20 k, half-way between two voxels
    left, right = found["r0_c1"], found["r0_c2"]
    assert left is not None
    assert right is not None
    middle = values[0, 5, 39:41].astype(float)
    np.testing.assert_allclose(middle.mean(), (left + right) / 2, rtol=1e-5)
    np.testing.assert_allclose(values[0, 0, 29:31].mean(), left, rtol=0.05)
    slope = np.diff(values[0, 0, 31:49].astype(float))
    np.testing.assert_allclose(slope, (right - left) / 20, rtol=1e-2)


def test_neighbours_compute_identical_values_from_their_own_parts() -> None:
    field = make_iso_field(TILES, _found())
    assert field is not None
    whole = field.at(REGION)
    for tile in TILES:
        for halo in (
            (0, 0, 0),
            (2, 8, 8),
            (9, 70, 70),
        ):  # the last halo is larger than the neighbouring tiles
            window = tile.box.grown(halo, REGION)
            values = np.broadcast_to(whole, REGION.shape)[window.slices]
            seen = np.broadcast_to(field.at(window), window.shape)
            near = np.broadcast_to(field.around(window).at(window), window.shape)
            np.testing.assert_array_equal(seen, values)
            np.testing.assert_array_equal(near, values)


def test_the_field_has_one_voxel_along_axes_that_only_one_centre_influences() -> None:
    field = make_iso_field(TILES, _found())
    assert field is not None
    assert field.at(REGION).shape == (1, 40, 100)
    assert field.at(Box((2, 0, 0), (5, 9, 9))).shape == (1, 1, 1)  # before the first centres
    lone = make_iso_field(TILES[:1], {TILES[0].id: 7.0})
    assert lone is not None
    np.testing.assert_array_equal(lone.at(REGION), [[[7]]])


def test_tiles_of_all_three_axes_are_blended_linearly() -> None:
    region = Box((0, 0, 0), (12, 20, 30))
    tiles = cut(region, (6, 10, 10))
    centre = {t.id: (np.array(t.box.start) + np.array(t.box.stop) - 1) / 2 for t in tiles}
    field = make_iso_field(tiles, {tile: float(c @ (100, 10, 1)) for tile, c in centre.items()})
    assert field is not None
    inner = Box((3, 5, 5), (9, 15, 25))  # between the outermost centres
    z, y, x = np.meshgrid(*map(np.arange, inner.start, inner.stop), indexing="ij")
    np.testing.assert_allclose(field.at(inner), 100 * z + 10 * y + x, rtol=1e-6)


def test_a_tile_without_a_value_takes_the_mean_of_the_others() -> None:
    found = dict.fromkeys((tile.id for tile in TILES), 500.0) | {"r0_c0": None}
    field = make_iso_field(TILES, found)
    assert field is not None
    np.testing.assert_array_equal(field.at(REGION), 500)


def test_a_channel_without_any_value_has_no_field() -> None:
    assert make_iso_field(TILES, {tile.id: None for tile in TILES}) is None


def test_a_value_is_the_same_in_a_box_that_is_computed_in_parts() -> None:
    rng = np.random.default_rng(1)
    field = LatticeField(
        ((0.0, 3.0), (5.0, 400.0), (9.5, 100.0, 300.5)), rng.normal(size=(2, 2, 3))
    )
    whole = field.at(Box((0, 0, 0), (4, 300, 400)))
    for x in (0, 9, 10, 99, 100, 101, 300, 399):  # before, at and beyond the centres
        one = field.at(Box((1, 120, x), (3, 125, x + 1)))
        np.testing.assert_array_equal(np.broadcast_to(one, (2, 5, 1)), whole[1:3, 120:125, x, None])
