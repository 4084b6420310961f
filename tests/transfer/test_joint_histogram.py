"""Gradient magnitudes, compared with theory and with the samples of a shader."""

import numpy as np
import pytest
from scipy import ndimage
from scipy.special import erfinv
from scipy.stats import norm

from stereocell.model.sample_boxes import sample_boxes
from stereocell.model.tiling import Box
from stereocell.transfer.joint_histogram import (
    COLUMNS,
    FINE_ROWS,
    ROWS,
    STEEPEST,
    choose_gradient_max,
    count_joint,
    find_steps,
    log_scaled,
    rebin,
    to_eight_bits,
)

SPACING = (2.0, 1.0, 1.25)  # um, (z, y, x)


def coordinates(shape: tuple[int, int, int]) -> list[np.ndarray]:
    """Return z, y, x of the voxels in um."""
    return [i * h for i, h in zip(np.indices(shape), SPACING, strict=True)]


@pytest.mark.parametrize(
    "slope", [(0.006, 0, 0), (0, 0.008, 0), (0, 0, 0.01), (0.006, 0.008, 0.01)]
)
def test_a_ramp_has_its_slope_over_two_finest_voxels(slope: tuple[float, float, float]) -> None:
    field = sum(g * c for g, c in zip(slope, coordinates((12, 14, 16)), strict=True))
    steps = find_steps(to_eight_bits(np.asarray(field), (0, 1)), SPACING)
    # Both samples of a difference are rounded to half a step. The axes add up as in a length.
    within = np.sqrt(sum((1 / h) ** 2 for h, g in zip(SPACING, slope, strict=True) if g))
    assert steps.shape == (10, 12, 14)
    assert np.abs(steps - 255 * 2 * np.linalg.norm(slope)).max() <= within + 1e-3


def test_the_step_equals_that_of_trilinear_samples_one_finest_voxel_to_each_side() -> None:
    voxels = np.random.default_rng(1).integers(0, 256, (6, 7, 8)).astype(np.uint8)
    centres = np.indices(voxels.shape)[:, 1:-1, 1:-1, 1:-1].astype(float)
    squares = 0
    for axis, spacing in enumerate(SPACING):
        samples = []
        for side in (1, -1):
            places = centres.copy()
            places[axis] += side * min(SPACING) / spacing
            samples.append(ndimage.map_coordinates(voxels.astype(float), places, order=1))
        squares += (samples[0] - samples[1]) ** 2
    assert find_steps(voxels, SPACING) == pytest.approx(np.sqrt(squares), abs=1e-3)


@pytest.mark.parametrize("sigma", [0.8, 1.5, 4.0])
def test_a_blurred_edge_is_an_arc(sigma: float) -> None:
    """Kindlmann & Durkin 1998, with central differences in place of the derivative."""
    low, high = 0.2, 0.8
    x = np.linspace(-6, 6, 1201)[:, np.newaxis] + np.arange(-1, 2)  # voxels at many phases
    field = low + (high - low) * norm.cdf(x / sigma)
    voxels = to_eight_bits(np.broadcast_to(field, (3, *field.shape)), (0, 1))
    # Only differences along x in the middle plane count. y runs over the phases.
    middle = voxels[1, :, 1] / 255
    steps = (voxels[1, :, 2].astype(float) - voxels[1, :, 0]) / 255
    seen = (middle > 0.25) & (middle < 0.75)
    z = np.sqrt(2) * erfinv(2 * (middle[seen] - low) / (high - low) - 1)
    exact = (high - low) * (norm.cdf(z + 1 / sigma) - norm.cdf(z - 1 / sigma))
    assert np.abs(steps[seen] - exact).max() <= 2.5 / 255
    if sigma == 4.0:  # the arc of the derivative, which a wide edge approaches
        smooth = 2 * (high - low) / (sigma * np.sqrt(2 * np.pi)) * np.exp(-((z / np.sqrt(2)) ** 2))
        assert np.abs(steps[seen] - smooth).max() <= 3 / 255
    one = np.repeat(voxels[:1, 600:601], 3, axis=1).repeat(3, axis=0)
    assert find_steps(one, (1, 1, 1))[0, 0, 0] / 255 == pytest.approx(steps[600], abs=1e-6)


def test_each_inner_voxel_is_counted_at_its_value_and_gradient() -> None:
    voxels = np.full((5, 6, 7), 40, np.uint8)
    counts = count_joint(voxels, (1, 1, 1), gradient_max=0.5)
    assert counts.shape == (ROWS, COLUMNS)
    assert counts.sum() == counts[0, 40] == 3 * 4 * 5
    ramp = np.broadcast_to(np.arange(0, 70, 10, dtype=np.uint8), (5, 6, 7))
    counts = count_joint(np.ascontiguousarray(ramp), (1, 1, 1), gradient_max=0.5)
    row = round(20 / 255 / 0.5 * (ROWS - 1))
    assert {tuple(cell) for cell in np.argwhere(counts)} == {(row, v) for v in (10, 20, 30, 40, 50)}
    assert (counts[counts > 0] == 12).all()
    assert count_joint(np.ascontiguousarray(ramp), (1, 1, 1), gradient_max=0.01)[-1].sum() == 60
    assert count_joint(np.ascontiguousarray(ramp), (1, 1, 1), gradient_max=0.5, every=2).sum() == 40


@pytest.mark.parametrize("shape", [(1, 5, 6), (1, 1, 1), (2, 2, 2)])
def test_thin_volumes_repeat_their_ends(shape: tuple[int, int, int]) -> None:
    counts = count_joint(np.full(shape, 9, np.uint8), (1, 1, 1), gradient_max=0.5)
    assert counts.sum() == counts[0, 9] > 0


def test_fine_rows_are_merged_into_those_of_the_scale() -> None:
    voxels = np.random.default_rng(2).integers(0, 120, (12, 20, 20)).astype(np.uint8)
    fine = count_joint(voxels, SPACING, gradient_max=STEEPEST, rows=FINE_ROWS)
    for gradient_max in (0.2, 0.55):
        direct, coarse = (
            count_joint(voxels, SPACING, gradient_max=gradient_max),
            rebin(fine, gradient_max),
        )
        assert (direct.sum(axis=0) == coarse.sum(axis=0)).all()
        # A fine row may lie across the border of two rows, but no further.
        below = [counts.cumsum(axis=0) for counts in (direct, coarse)]
        assert (below[0][:-1] <= below[1][1:]).all()
        assert (below[1][:-1] <= below[0][1:]).all()


def test_the_scale_ends_above_the_edges_and_ignores_a_hot_voxel() -> None:
    edge = np.zeros((80, 80, 80), np.uint8)
    edge[:, :, 40:] = 102  # 0.4 of the window
    fine = count_joint(edge, (1, 1, 1), gradient_max=STEEPEST, rows=FINE_ROWS)
    assert choose_gradient_max(fine) == pytest.approx(0.4, abs=2 / FINE_ROWS)
    edge[5, 5, 9] = 255
    fine = count_joint(edge, (1, 1, 1), gradient_max=STEEPEST, rows=FINE_ROWS)
    assert choose_gradient_max(fine) < 0.5


def test_a_constant_volume_has_a_scale() -> None:
    for voxels in (np.zeros((4, 4, 4), np.uint8), np.full((4, 4, 4), 255, np.uint8)):
        fine = count_joint(voxels, (1, 1, 1), gradient_max=STEEPEST, rows=FINE_ROWS)
        assert choose_gradient_max(fine) == 0.05
    assert choose_gradient_max(np.zeros((FINE_ROWS, COLUMNS), np.int64)) == 0.05


def test_the_image_is_logarithmic_and_shows_single_voxels() -> None:
    counts = np.array([[0, 1, 99, 10**9]])
    picture = log_scaled(counts)
    assert picture.tolist() == [[0, 9, 57, 255]]  # 255 ln 2 / ln 1e9 = 8.5, 255 ln 100 / ln 1e9
    assert log_scaled(np.array([[1, 10**300 // 10**285]]))[0, 0] >= 1
    assert not log_scaled(np.zeros((2, 2), np.int64)).any()


def test_sampled_boxes_lie_apart_in_the_region_and_hold_the_requested_voxels() -> None:
    region = Box((5, 10, 20), (105, 1010, 2020))
    boxes = sample_boxes(region, 8_000_000)
    mask = np.zeros((21, 1001, 2001), np.uint8)  # every fifth plane
    for box in boxes:
        assert box.grown((0, 0, 0), region) == box
        z, y, x = box.start
        mask[-(-(z - 5) // 5), y - 10 : box.stop[1] - 10, x - 20 : box.stop[2] - 20] += 1
    assert mask.max() == 1
    total = sum(np.prod(box.shape) for box in boxes)
    assert 4_000_000 < total <= 8_000_000
    assert sample_boxes(region, 10**9) == [region]


def test_voxels_are_converted_to_eight_bits_by_the_window() -> None:
    values = np.array([-5.0, 0, 9.99, 10, 20, 30, 110, 111], np.float32)
    assert to_eight_bits(values, (10, 110)).tolist() == [0, 0, 0, 0, 26, 51, 255, 255]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.int16])
@pytest.mark.parametrize("window", [(0.0, 255.0), (17.3, 201.9), (-90.0, 60000.0)])
def test_a_large_volume_of_whole_numbers_gets_the_bytes_of_its_values_as_floats(
    dtype: type, window: tuple[float, float]
) -> None:
    info = np.iinfo(dtype)
    voxels = np.random.default_rng(6).integers(info.min, info.max, (3, 150, 200), dtype)
    expected = to_eight_bits(voxels.astype(np.float32), window)
    np.testing.assert_array_equal(to_eight_bits(voxels, window), expected)
