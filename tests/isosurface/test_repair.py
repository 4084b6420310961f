"""Repair of fragments, gaps and cavities that are smaller and larger than the limits."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.isosurface.repair import repair
from stereocell.isosurface.repair_options import RepairOptions

SPACING = (1.0, 1.0, 1.0)


def _boxes(*boxes: tuple[slice, slice, slice], shape: int = 40) -> NDArray[np.float32]:
    distance = np.full((shape,) * 3, -2.0, np.float32)
    for box in boxes:
        distance[box] = 2.0
    return distance


def test_small_fragment_is_dropped_and_large_solid_stays() -> None:
    small, large = np.s_[3:5, 3:5, 3:5], np.s_[15:30, 15:30, 15:30]
    result = repair(_boxes(small, large), SPACING, options=RepairOptions(0.0, 4.0, 0.0))
    assert result.fragments_dropped == 1
    assert (result.distance[small] < 0).all()
    assert (result.distance[large] > 0).all()


def test_fragment_at_the_window_s_end_is_never_dropped() -> None:
    cut = np.s_[0:2, 3:5, 3:5]
    result = repair(_boxes(cut), SPACING, options=RepairOptions(0.0, 4.0, 0.0))
    assert result.fragments_dropped == 0
    assert (result.distance[cut] > 0).all()


def test_cavity_up_to_the_limit_is_filled() -> None:
    distance = _boxes(np.s_[5:35, 5:35, 5:35])
    little, big = np.s_[10:12, 10:12, 10:12], np.s_[18:30, 18:30, 18:30]
    distance[little] = distance[big] = -2.0
    result = repair(distance, SPACING, options=RepairOptions(0.0, 0.0, 4.0))
    assert result.cavities_filled == 1
    assert (result.distance[little] > 0).all()
    assert (result.distance[big] < 0).all()


def test_slit_narrower_than_the_ball_closes_and_a_wider_one_stays() -> None:
    narrow, wide = np.s_[10:30, 19:21, 10:30], np.s_[10:30, 14:26, 10:30]
    for slit, closes in ((narrow, True), (wide, False)):
        distance = _boxes(np.s_[8:32, 8:32, 8:32])
        distance[slit] = -2.0
        distance[8:32, slit[1], 30:32] = -2.0  # open to one side
        result = repair(distance, SPACING, options=RepairOptions(3.0, 0.0, 0.0))
        middle = result.distance[20, 20, 20]
        assert (middle > 0) == closes


def test_closing_does_not_move_a_smooth_ball() -> None:
    z, y, x = np.indices((40, 40, 40)) - 20.0
    ball = np.clip(12 - np.sqrt(z**2 + y**2 + x**2), -2, 2).astype(np.float32)
    closed = repair(ball, SPACING, options=RepairOptions(3.0, 0.0, 0.0)).distance
    near = np.abs(ball) < 1
    np.testing.assert_allclose(closed[near], ball[near], atol=1e-6)


@pytest.mark.parametrize("spacing", [(1.0, 1.0, 1.0), (0.28, 0.14, 0.14), (2.0, 0.7, 1.3)])
@pytest.mark.parametrize("balls", [0.9, 1.0, 2.3])  # radius in coarsest spacings
def test_closing_equals_closing_by_exact_distances(
    spacing: tuple[float, float, float], balls: float
) -> None:
    """Our closing computes distances in a band only; SciPy computes those of the whole window."""
    noise = np.random.default_rng(1).normal(size=(20, 30, 41))
    h = max(spacing)
    distance = np.clip(ndimage.gaussian_filter(noise, 1.5) * 20 * h, -2 * h, 2 * h)
    distance = distance.astype(np.float32)
    alpha = balls * h
    margin = [int(np.ceil(alpha / step)) + 1 for step in spacing]
    free = np.pad(distance <= 0, [(m, m) for m in margin], constant_values=True)
    nowhere = ndimage.distance_transform_edt(free, spacing) < alpha * (1 - 1e-6)
    away = ndimage.distance_transform_edt(nowhere, spacing)
    away = away[tuple(slice(m, -m) for m in margin)]
    wanted = np.maximum(distance, np.clip(away - (alpha + h), -2 * h, h))
    found = repair(distance.copy(), spacing, options=RepairOptions(alpha, 0.0, 0.0)).distance
    np.testing.assert_allclose(found, wanted, atol=1e-5 * h)
    assert 0 < (distance > 0).sum() <= (found > 0).sum()
    assert balls < 2 or (found > 0).sum() > (distance > 0).sum()


def test_empty_and_full_windows_do_not_change() -> None:
    for value in (-2.0, 2.0):
        whole = np.full((7, 8, 9), value, np.float32)
        result = repair(whole.copy(), SPACING, options=RepairOptions(1.5, 3.0, 3.0))
        np.testing.assert_array_equal(result.distance, whole)
        assert (result.fragments_dropped, result.cavities_filled) == (0, 0)
