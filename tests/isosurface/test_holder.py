"""A CT scan's table and head holder are found and left out, and every part of the body stays."""

import json

import cc3d
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.isosurface.find_holder import find_holder
from stereocell.isosurface.holder import Holder
from stereocell.model.tiling import Box

SPACING = (3000.0, 1500.0, 1500.0)  # um
SHAPE = (60, 130, 130)
WHOLE = Box((0, 0, 0), SHAPE)


def _places() -> list[NDArray[np.float64]]:
    """Return the voxels' positions from the middle of the volume, in mm."""
    middle = [(n - 1) / 2 for n in SHAPE]
    grid = np.indices(SHAPE)
    return [(g - m) * s / 1000 for g, m, s in zip(grid, middle, SPACING, strict=True)]


def _head(noise: float = 15.0) -> tuple[NDArray[np.int16], NDArray[np.bool_]]:
    """Return a head with ears that the volume's end cuts off, and the mask of the head."""
    z, y, x = _places()
    head = (y / 75) ** 2 + (x / 62) ** 2 < 1
    ears = (abs(abs(x) - 66) < 5) & (abs(y) < 8) & (abs(z) < 25)
    body = head | ears
    hu = np.where(body, 40.0, -1000.0) + np.random.default_rng(0).normal(0, noise, SHAPE)
    return hu.round().astype(np.int16), body


def _with(hu: NDArray[np.int16], piece: NDArray[np.bool_]) -> NDArray[np.int16]:
    return np.where(piece, np.int16(-100), hu)


def _cradle(gap_mm: float) -> NDArray[np.bool_]:
    """Return a shell of 6 mm under the head, as long as the volume and wider than the head."""
    _, y, x = _places()
    away = np.hypot(y + 25 - gap_mm, x)
    return (away > 99) & (away < 105) & (y > 35)


@pytest.mark.slow
@pytest.mark.parametrize("gap_mm", [8.0, 0.0])
def test_a_cradle_is_left_out_whether_or_not_it_touches_the_head(gap_mm: float) -> None:
    hu, body = _head()
    cradle = _cradle(gap_mm) & ~body
    holder = find_holder(_with(hu, cradle), SPACING, WHOLE)
    assert holder is not None
    out = holder.at(WHOLE)
    assert (out & cradle).sum() > 0.7 * cradle.sum()
    assert not (out & body).any()
    assert len(holder.pieces) in (1, 2)  # two if the cradle touches the head in the middle
    assert "mm" in holder.pieces[0]


def test_a_body_without_a_holder_is_kept_whole() -> None:
    assert find_holder(_head()[0], SPACING, WHOLE) is None


def test_an_arm_beside_the_body_stays() -> None:
    hu, _ = _head()
    _, y, x = _places()
    hu = hu.copy()
    hu[:] = np.where(np.hypot(y / 55, (x + 30) / 40) < 1, 40, -1000)
    arm = np.hypot(y, x - 70) < 22
    assert find_holder(np.where(arm, np.int16(40), hu), SPACING, WHOLE) is None


def test_values_other_than_hounsfield_units_have_no_holder() -> None:
    hu, body = _head()
    cradle = _cradle(8.0) & ~body
    raw = (_with(hu, cradle) + 1024).clip(0).astype(np.uint16)
    assert find_holder(raw, SPACING, WHOLE) is None
    assert find_holder(np.full(SHAPE, -1000, np.int16), SPACING, WHOLE) is None


@pytest.mark.slow
def test_the_mask_is_the_same_for_a_part_and_after_saving() -> None:
    hu, body = _head()
    holder = find_holder(_with(hu, _cradle(8.0) & ~body), SPACING, WHOLE)
    assert holder is not None
    again = Holder.from_json(json.loads(json.dumps(holder.to_json())))
    np.testing.assert_array_equal(again.at(WHOLE), holder.at(WHOLE))
    part = Box((10, 60, 20), (40, 130, 90))
    np.testing.assert_array_equal(again.at(part), holder.at(WHOLE)[part.slices])
    assert holder.around(Box((0, 0, 0), (60, 30, 130))) is None


def test_a_coarser_copy_of_the_region_gives_the_same_voxels() -> None:
    hu, body = _head()
    cradle = _cradle(8.0) & ~body
    thinned = _with(hu, cradle)[::2]
    holder = find_holder(thinned, (6000.0, *SPACING[1:]), WHOLE)
    assert holder is not None
    out = holder.at(WHOLE)
    assert (out & cradle).sum() > 0.7 * cradle.sum()
    assert not (out & body).any()


def _left_out(hu: NDArray[np.int16]) -> NDArray[np.bool_]:
    holder = find_holder(hu, SPACING, WHOLE)
    return np.zeros(SHAPE, bool) if holder is None else holder.at(WHOLE)


def _skull() -> NDArray[np.bool_]:
    """Return a shell of 6 mm that is open at the volume's end, like the neck of a dry skull."""
    z, y, x = _places()
    outer = (z / 120) ** 2 + (y / 75) ** 2 + (x / 62) ** 2
    inner = (z / 114) ** 2 + (y / 69) ** 2 + (x / 56) ** 2
    return (outer < 1) & (inner > 1)


@pytest.mark.slow
def test_a_dry_skull_with_a_thick_core_stays_and_its_cradle_is_left_out() -> None:
    z, y, x = _places()
    skull, cradle = _skull(), _cradle(8.0)
    core = np.hypot(y, x - 10) < 20
    rod = (np.hypot(y - 30, x + 20) < 9) & (abs(z) < 60)  # long and thin, and inside the skull
    hu = np.where(skull, 700, np.where(core | rod, 90, -1000)).astype(np.int16)
    out = _left_out(_with(hu, cradle & ~skull))
    assert not (out & (skull | core | rod)).any()
    assert (out & cradle).sum() > 0.7 * cradle.sum()


@pytest.mark.slow
def test_an_animal_s_ears_and_tail_stay() -> None:
    z, y, x = _places()
    body = (z / 70) ** 2 + (y / 45) ** 2 + (x / 40) ** 2 < 1
    ears = (abs(abs(x) - 30) < 3) & (y < -35) & (y > -95) & (abs(z) < 25)
    tail = (np.hypot(y - 20, x) < 6) & (z > 50)
    vertebrae = (np.hypot(y - 20, x) < 3) & (z > 50)
    for part in (ears, tail):
        hu = np.where(body | part, 40, -1000).astype(np.int16)
        out = _left_out(np.where(vertebrae & part, np.int16(800), hu))
        assert not out.any()


def _chest(
    table_hu: int, table_mm: tuple[float, float], gap_mm: float
) -> tuple[NDArray[np.int16], NDArray[np.bool_], NDArray[np.bool_]]:
    """Return a chest with lungs, ribs and a spine on a table, the mask of the table, and the bones.

    table_mm  thickness and width of the table
    gap_mm    distance between the body and the table; 0: they touch
    """
    z, y, x = _places()
    body = (y / 55) ** 2 + (x / 80) ** 2 < 1
    lungs = (y / 35) ** 2 + ((abs(x) - 38) / 26) ** 2 < 1
    shell = abs(np.hypot(y / 48, x / 73) - 1) < 0.06
    bones = (shell & (np.mod(z, 24) < 9)) | (np.hypot(y - 38, x) < 11)
    thickness, width = table_mm
    table = (y > 55 + gap_mm) & (y < 55 + gap_mm + thickness) & (abs(x) < width / 2)
    hu = np.where(body, 40.0, -1000.0)
    hu[lungs], hu[bones], hu[table & ~body] = -850.0, 450.0, float(table_hu)
    blurred = ndimage.gaussian_filter(hu, 0.5)
    noisy = blurred + np.random.default_rng(1).normal(0, 15, SHAPE)
    return noisy.round().astype(np.int16), table & ~body, bones


@pytest.mark.parametrize("gap_mm", [6.0, 0.0])
@pytest.mark.parametrize(("table_hu", "thickness_mm"), [(900, 8.0), (700, 30.0)])
def test_a_table_that_is_the_largest_piece_of_bone_in_a_chest_is_left_out(
    table_hu: int, thickness_mm: float, gap_mm: float
) -> None:
    hu, table, bones = _chest(table_hu, (thickness_mm, 180.0), gap_mm)
    sizes = np.bincount(cc3d.connected_components(hu > 300, connectivity=26).ravel())[1:]
    assert sizes.max() > 0.9 * np.count_nonzero(hu[table] > 300)  # the table is the largest piece
    out = _left_out(hu)
    assert (out & table).sum() > 0.7 * table.sum()
    assert not (out & bones).any()


def test_left_out_voxels_become_air_and_all_others_stay_as_measured() -> None:
    hu, table, _ = _chest(900, (8.0, 180.0), 6.0)
    holder = find_holder(hu, SPACING, WHOLE)
    assert holder is not None
    left = holder.left_out_of(hu, WHOLE)
    out = holder.at(WHOLE)
    assert left.dtype == hu.dtype
    assert (left[table & out] <= -1000).all()
    np.testing.assert_array_equal(left[~out], hu[~out])


def test_a_pad_as_faint_as_skin_is_left_out_completely() -> None:
    z, y, x = _places()
    body = (y / 55) ** 2 + (x / 80) ** 2 < 1
    away = np.hypot(y / 55, x / 80) * 55
    pad = (away > 57) & (away < 63) & (y > 25)
    fragment = np.mod(x + z, 30) < 20  # the part of the pad that a level of -300 keeps
    hu = np.where(body, 40.0, np.where(pad, np.where(fragment, -240.0, -360.0), -1000.0))
    table = (y > 66) & (y < 76) & (abs(x) < 85)
    hu[table] = 100
    hu += np.random.default_rng(2).normal(0, 12, SHAPE)
    out = _left_out(hu.round().astype(np.int16))
    assert (out & table).sum() > 0.9 * table.sum()
    assert (out & pad).sum() > 0.95 * pad.sum()
    assert not (out & body).any()


def test_all_cables_of_a_cardiogram_are_left_out_and_vessels_in_a_cut_lung_stay() -> None:
    z, y, x = _places()
    body = (y / 55) ** 2 + (x / 80) ** 2 < 1
    lung = (np.hypot(y, x - 62) < 25) & body
    vessel = (np.hypot(y, x - 62) < 3) & (abs(z) < 30)
    long_cable = (np.hypot(y + 62, x) < 2.5) & (z > -80)
    short_cable = (np.hypot(y + 58, x - 35) < 2.5) & (z > 60)
    clip = (np.hypot(y + 62, x - 5) < 5) & (abs(z) < 8)
    hu = np.where(lung, -850.0, np.where(body, 40.0, -1000.0))
    hu[vessel] = 600
    cables = long_cable | short_cable | clip
    hu[cables] = 2800
    out = _left_out(hu.round().astype(np.int16))
    assert (out & cables).sum() > 0.95 * cables.sum()
    assert not (out & body).any()


@pytest.mark.slow
def test_a_thin_ear_in_a_foam_rest_stays() -> None:
    hu, body = _head()
    _, y, x = _places()
    cradle = _cradle(8.0) & ~body
    foam = (abs(x) > 60) & (abs(x) < 90) & (abs(y) < 60) & ~body & ~cradle
    given = np.where(foam, np.int16(-600), _with(hu, cradle))
    out = _left_out(given)
    assert (out & cradle).sum() > 0.7 * cradle.sum()
    assert not (out & body).any()


def test_voxels_on_a_coarser_grid_are_left_out_at_their_places() -> None:
    mask = np.zeros((2, 2, 2), bool)
    mask[1, :, 0] = True
    holder = Holder(Box((0, 0, 0), (8, 8, 8)), mask, ())
    fine = np.full((8, 8, 8), 40.0, np.float32)
    coarse = np.full((4, 4, 4), 40.0, np.float32)
    places = [np.arange(0.5, 8, 2)] * 3  # each position lies between two voxels
    whole = holder.left_out_of(fine, Box((0, 0, 0), (8, 8, 8)))
    np.testing.assert_array_equal(holder.left_out_at(coarse, places), whole[::2, ::2, ::2])
