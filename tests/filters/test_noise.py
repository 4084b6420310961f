"""The noise of a channel, compared with noise that was added with a known deviation."""

import numpy as np
import pytest
from scipy import ndimage

from stereocell.filters.noise import NoiseSample, find_max_shift
from support.thin_shells import ThinBody

SHAPE = (24, 96, 96)


def _deviation(voxels: np.ndarray, darkest: float | None = None) -> float:
    sample = NoiseSample()
    sample.add(voxels, darkest)
    return sample.deviation()


@pytest.mark.parametrize("deviation", [3.0, 40.0])
def test_noise_on_an_even_ground_is_measured(deviation: float) -> None:
    noise = np.random.default_rng(0).normal(1000.0, deviation, SHAPE).astype(np.float32)
    assert _deviation(noise) == pytest.approx(deviation, rel=0.05)
    assert _deviation(noise.round().astype(np.uint16)) == pytest.approx(deviation, rel=0.08)


def test_bodies_and_a_slope_do_not_count_as_noise() -> None:
    rng = np.random.default_rng(0)
    bodies = ndimage.gaussian_filter(rng.normal(size=SHAPE), 8) > 0.008
    scene = 200.0 + 800.0 * ndimage.gaussian_filter(bodies.astype(np.float64), 1)
    scene += np.linspace(0, 500, SHAPE[2])
    assert _deviation(scene + rng.normal(0, 20.0, SHAPE)) == pytest.approx(20.0, rel=0.25)


def test_photon_noise_is_that_of_the_bright_parts() -> None:
    photons = np.random.default_rng(0).poisson(np.where(np.arange(96) < 48, 10.0, 100.0), SHAPE)
    assert _deviation(photons) == pytest.approx(10.0, rel=0.1)


@pytest.mark.parametrize("thickness", [1, 3])
def test_a_thin_shell_does_not_count_as_noise(thickness: float) -> None:
    assert _deviation(ThinBody("sphere", thickness, 1, 0).voxels()) == 0.0


def test_padding_is_left_out_of_the_noise() -> None:
    voxels = np.random.default_rng(0).normal(500.0, 10.0, SHAPE)
    voxels[:, :, :80] = 0.0
    assert _deviation(voxels, 0.0) == pytest.approx(10.0, rel=0.1)


def test_cut_out_vessels_have_no_noise_and_a_cut_out_body_has_its_own() -> None:
    """Without the rule for even ground, each edge of a thin vessel would count as noise."""
    rng, (_, rows, columns) = np.random.default_rng(2), np.indices((64, 96, 96))
    seeds = np.zeros(rows.shape)
    for start, stop in rng.uniform(5, 90, (12, 2, 2)):
        for t in np.linspace(0, 1, 200):
            row, column = (start + t * (stop - start)).round().astype(int)
            seeds[int(63 * t), row, column] = 1.0
    vessels = np.minimum(ndimage.gaussian_filter(seeds, 1.2) * 4000, 1000).round()
    vessels[vessels < 40] = 0
    assert (vessels > 0).mean() < 0.1
    sample = NoiseSample()
    sample.add(vessels, 0.0)
    assert sample.deviation() < 15
    body = (rows - 48) ** 2 + (columns - 48) ** 2 < 20**2
    sample = NoiseSample()
    sample.add(np.where(body, 1000 + rng.normal(0, 30, rows.shape), 0.0), 0.0)
    assert sample.deviation() == pytest.approx(30, rel=0.15)


def test_blocks_add_up_and_a_volume_of_one_pixel_has_no_noise() -> None:
    noise = np.random.default_rng(0).normal(0.0, 5.0, SHAPE)
    sample = NoiseSample()
    for first in range(0, SHAPE[0], 8):
        sample.add(noise[first : first + 8])
    assert sample.deviation() == pytest.approx(5.0, rel=0.05)
    assert _deviation(np.ones((1, 1, 1))) == 0.0


def test_smoothing_keeps_a_mask_s_voxels_on_their_side_of_half_height() -> None:
    assert find_max_shift(3.0, 2.0, None) == 6.0
    assert find_max_shift(0.0, 2.0, (0.0, 255.0)) < 255.0 / 2
