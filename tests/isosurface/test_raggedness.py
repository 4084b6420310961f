"""How much of a surface smoothing takes: little of a body's, much of noise's."""

import numpy as np
import pytest
from scipy import ndimage

from stereocell.isosurface.raggedness import find_raggedness
from support.phantoms import blurred_ball

SPACING = (0.28, 0.14, 0.14)
SHAPE = (40, 72, 72)


def _ball(radius: float) -> np.ndarray:
    return blurred_ball(SHAPE, SPACING, (5.6, 5.0, 5.0), radius, 0.2)


def test_smooth_body_loses_hardly_any() -> None:
    assert find_raggedness(_ball(3.0), 0.5, SPACING) < 0.02


def test_white_noise_loses_nearly_all() -> None:
    noise = np.random.default_rng(0).normal(size=SHAPE).astype(np.float32)
    assert find_raggedness(noise, 3.0, SPACING) > 0.98


def test_noise_on_a_body_frays_it() -> None:
    noise = ndimage.gaussian_filter(np.random.default_rng(0).normal(size=SHAPE), (0.5, 1, 1))
    frayed = _ball(3.0) + 2.0 * noise.astype(np.float32)
    assert find_raggedness(frayed, 0.5, SPACING) > 10 * find_raggedness(_ball(3.0), 0.5, SPACING)


def test_gain_and_offset_change_nothing() -> None:
    noise = np.random.default_rng(1).normal(size=SHAPE).astype(np.float32)
    plain = find_raggedness(noise, 1.0, SPACING)
    moved = find_raggedness(np.float32(3) * noise + np.float32(50), 53.0, SPACING)
    assert moved == pytest.approx(plain, abs=1e-4)


def test_level_that_nothing_reaches_is_all_ragged() -> None:
    assert find_raggedness(_ball(3.0), 2.0, SPACING) == 1


def test_one_plane_and_one_voxel_are_measured_too() -> None:
    plane = _ball(3.0)[20:21]
    assert find_raggedness(plane, 0.5, SPACING) < 0.05
    assert find_raggedness(np.ones((1, 1, 1), np.float32), 0.5, SPACING) == 1
