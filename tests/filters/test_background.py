"""The background is found under bodies, at its true height, and is the same in all tiles."""

import numpy as np
import pytest

from stereocell.filters import background
from stereocell.filters.background import find_background
from stereocell.model.tiling import Box
from support.phantoms import blurred_ball

SPACING = (0.28, 0.14, 0.14)
REGION = Box((10, 200, 300), (58, 328, 428))


def _ramp() -> np.ndarray:
    z, y, x = np.indices(REGION.shape)
    return (100 + 2 * z + 0.5 * y + 1.0 * x).astype(np.float32)


@pytest.mark.slow
def test_a_ramp_under_noise_and_bodies_is_found() -> None:
    rng = np.random.default_rng(0)
    ball = blurred_ball(REGION.shape, SPACING, (6.7, 9.0, 9.0), 2.0, 0.3)
    counts = (_ramp() + 500 * ball + rng.normal(0, 5, REGION.shape)).astype(np.float32)
    found = find_background(counts, REGION, spacing_um=SPACING, block_um=4.5).at(REGION)
    inner = (slice(12, 36), slice(24, 104), slice(24, 104))
    # A low percentile of a ramp lies below its middle by a constant, which no threshold notices.
    error = found[inner] - _ramp()[inner]
    assert np.ptp(np.percentile(error, [2, 98])) < 25  # for a ramp that rises by 280
    assert abs(np.median(error)) < 35


def test_a_ground_that_falls_towards_the_rim_is_found_up_to_the_rim() -> None:
    """Vignetting of a lens leaves a parabola, which is steepest at the ends of the region."""
    z, y, x = np.indices(REGION.shape)
    ground = 500 - 300 * ((x - 64) / 64) ** 2 + 0 * y + 0 * z
    found = find_background(ground.astype(np.float32), REGION, spacing_um=SPACING, block_um=4.5)
    error = found.at(REGION) - ground
    assert np.ptp(np.percentile(error, [1, 99])) < 60  # for a drop of 300


@pytest.mark.slow
def test_coarser_voxels_give_the_same_background() -> None:
    fine = find_background(_ramp(), REGION, spacing_um=SPACING, block_um=4.5)
    coarse = find_background(_ramp()[:, ::2, ::2], REGION, spacing_um=SPACING, block_um=4.5)
    for found, expected in zip(coarse.centres, fine.centres, strict=True):
        assert found == pytest.approx(expected)
    np.testing.assert_allclose(coarse.at(REGION), fine.at(REGION), atol=3)


def test_a_block_larger_than_the_region_gives_a_constant() -> None:
    found = find_background(_ramp(), REGION, spacing_um=SPACING, block_um=1e6)
    assert found.values.shape == (1, 1, 1)
    assert found.at(REGION).shape == (1, 1, 1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "block_um"), [((64, 256, 260), 9.0), ((1, 2000, 2100), 70.0), ((2100, 1, 2000), 70.0)]
)
def test_a_sample_of_the_voxels_gives_the_background_of_all(
    monkeypatch: pytest.MonkeyPatch, shape: tuple[int, int, int], block_um: float
) -> None:
    noise = 20.0
    z, y, x = np.indices(shape)
    body = np.sin(z / 5) * np.sin(y / 9) * np.sin(x / 9) > 0.4
    values = 300 + 0.5 * x + 400 * body + np.random.default_rng(0).normal(0, noise, shape)
    values[..., 1::2] += noise  # a scanner may record every second line differently
    region = Box((0, 0, 0), shape)

    def found() -> np.ndarray:
        field = values.astype(np.float32)
        return find_background(field, region, spacing_um=SPACING, block_um=block_um).at(region)

    assert values.size >= background.SMALL
    sampled = found()
    monkeypatch.setattr(background, "SMALL", np.inf)
    assert 0 < np.abs(sampled - found()).max() < 0.1 * noise
