"""Iso-values against bodies whose boundary intensity is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from phantoms import blurred_ball
from stereocell.errors import NoSurfaceError, UsageError
from stereocell.isovalue import CRITERIA, IsoValueOptions, find_iso_value, gradient_magnitude

SPACING = (0.28, 0.14, 0.14)
SHAPE = (40, 72, 72)
CENTER = (5.6, 5.0, 5.0)


def _ball(noise: float = 0.0) -> np.ndarray:
    field = 200 + 1000 * blurred_ball(SHAPE, SPACING, CENTER, 3.0, 0.25)
    return (field + np.random.default_rng(0).normal(0, 1, SHAPE) * noise).astype(np.float32)


@pytest.mark.parametrize("criterion", ["compromise", "mean"])
def test_blurred_ball_is_cut_at_half_its_height(criterion: str) -> None:
    found = find_iso_value(_ball(), SPACING, IsoValueOptions(criterion=criterion))
    assert found.value == pytest.approx(700, abs=0.15 * 700)


def test_noise_does_not_move_the_default_iso_value_far() -> None:
    found = find_iso_value(_ball(noise=30), SPACING, IsoValueOptions())
    assert found.value == pytest.approx(700, abs=0.15 * 700)


@settings(max_examples=10, deadline=None)
@given(gain=st.floats(0.01, 50), offset=st.floats(-500, 500))
def test_gain_and_offset_carry_the_iso_value_along(gain: float, offset: float) -> None:
    ball = blurred_ball((20, 36, 36), (0.5, 0.3, 0.3), (5.0, 5.2, 5.2), 3.0, 0.5)
    options = IsoValueOptions()
    plain = find_iso_value(ball, (0.5, 0.3, 0.3), options).value
    moved = find_iso_value((gain * ball + offset).astype(np.float32), (0.5, 0.3, 0.3), options)
    assert moved.value == pytest.approx(gain * plain + offset, abs=0.02 * gain + 1e-3 * abs(offset))


@pytest.mark.parametrize("criterion", CRITERIA)
def test_the_curve_is_recorded_and_peaks_at_the_value(criterion: str) -> None:
    found = find_iso_value(_ball(noise=10), SPACING, IsoValueOptions(criterion=criterion))
    assert found.score.max() == 1.0
    step = found.levels[1] - found.levels[0]
    assert abs(found.levels[found.score.argmax()] - found.value) <= step
    assert 0 <= found.confidence <= 1


@pytest.mark.parametrize("seed", range(3))
def test_noise_alone_has_no_clear_surface_and_a_dim_ball_in_it_has(seed: int) -> None:
    _, y, _ = np.indices(SHAPE)
    rng = np.random.default_rng(seed)
    noise = ndimage.gaussian_filter(rng.normal(200, 20, SHAPE) + y / 2, (0.5, 1, 1))
    empty = find_iso_value(noise.astype(np.float32), SPACING, IsoValueOptions())
    assert not empty.is_clear
    ball = noise + 400 * blurred_ball(SHAPE, SPACING, CENTER, 2.0, 0.3)
    assert find_iso_value(ball.astype(np.float32), SPACING, IsoValueOptions()).is_clear


def test_constant_tile_has_no_surface() -> None:
    with pytest.raises(NoSurfaceError, match="every voxel is 7"):
        find_iso_value(np.full((4, 5, 6), 7, np.float32), SPACING, IsoValueOptions())


def test_unknown_criterion_is_wrong_usage() -> None:
    with pytest.raises(UsageError, match=r"'best', expected one of compromise"):
        IsoValueOptions(criterion="best")


def test_gradient_of_a_ramp_is_its_slope_in_um() -> None:
    z, _, x = np.indices((5, 6, 7), dtype=np.float32)
    ramp = (3 * z * 0.28 + 4 * x * 0.14).astype(np.float32)
    np.testing.assert_allclose(gradient_magnitude(ramp, SPACING), 5, rtol=1e-4)
