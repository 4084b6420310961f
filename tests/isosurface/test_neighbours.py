"""Correlation of neighbours, against numpy's own, whatever the tiles; padding takes no part."""

import numpy as np
import pytest
from scipy import ndimage

from stereocell.isosurface.neighbours import MIN_KINSHIP, Neighbours, kinship

SHAPE = (6, 160, 200)
WIDE = (-1e9, 3.0, 1e9)
WHOLE = tuple(slice(0, n) for n in SHAPE)
RNG = np.random.default_rng(8)
NOISE = RNG.normal(5, 2, SHAPE)
BLURRED = ndimage.gaussian_filter(NOISE, (0, 1, 2))


def _by_numpy(voxels: np.ndarray) -> float:
    """Return the larger correlation of those along y and x."""
    along_y = np.corrcoef(voxels[:, 1:].ravel(), voxels[:, :-1].ravel())[0, 1]
    along_x = np.corrcoef(voxels[..., 1:].ravel(), voxels[..., :-1].ravel())[0, 1]
    return max(along_y, along_x)


@pytest.mark.parametrize("voxels", [NOISE, BLURRED], ids=["noise", "blurred"])
def test_correlation_is_numpy_s_and_the_same_in_tiles(voxels: np.ndarray) -> None:
    none = np.zeros(SHAPE, bool)
    whole = kinship([Neighbours.of(voxels, none, WHOLE, WIDE)])
    assert whole == pytest.approx(_by_numpy(voxels), abs=0.02)  # its means leave out an edge
    tiles = [
        Neighbours.of(voxels, none, (slice(0, 6), rows, columns), WIDE)
        for rows in (slice(0, 17), slice(17, 160))
        for columns in (slice(0, 31), slice(31, 200))
    ]
    assert kinship(tiles) == pytest.approx(whole, rel=1e-9)


def test_noise_is_told_from_the_least_blur() -> None:
    none, shape = np.zeros((20, 200, 200), bool), (20, 200, 200)
    own = tuple(slice(0, n) for n in shape)
    noise = np.random.default_rng(9).poisson(0.1, shape).astype(np.uint8)
    assert abs(kinship([Neighbours.of(noise, none, own, (0.0, 0.0, 10.0))])) < MIN_KINSHIP
    seen = noise + ndimage.gaussian_filter(noise.astype(np.float32), 0.6)
    assert kinship([Neighbours.of(seen, none, own, (0.0, 0.0, 10.0))]) > 10 * MIN_KINSHIP


def test_lines_that_differ_hide_no_body() -> None:
    lines = np.random.default_rng(10).normal(0, 20, (*SHAPE[:2], 1))
    none = np.zeros(SHAPE, bool)
    seen = Neighbours.of(BLURRED + lines, none, WHOLE, WIDE)
    along_y = np.corrcoef((BLURRED + lines)[:, 1:].ravel(), (BLURRED + lines)[:, :-1].ravel())[0, 1]
    assert abs(along_y) < 0.1
    assert kinship([seen]) > 0.9


def test_padding_and_hot_voxels_beyond_the_scale_take_no_part() -> None:
    voxels, padding = BLURRED.copy(), np.zeros(SHAPE, bool)
    padding[:, :, 80:110] = True
    voxels[padding] = 1e6
    halves = np.delete(BLURRED, slice(80, 110), axis=2)
    found = kinship([Neighbours.of(voxels, padding, WHOLE, WIDE)])
    assert found == pytest.approx(_by_numpy(halves), abs=0.05)
    hot = BLURRED.copy()
    hot[3, 5, 7] = 1e9
    same = Neighbours.of(hot, np.zeros(SHAPE, bool), WHOLE, (0.0, 5.0, 10.0))
    assert kinship([same]) == pytest.approx(_by_numpy(BLURRED), abs=0.05)


def test_what_is_not_known_says_nothing_against() -> None:
    flat = Neighbours.of(np.full(SHAPE, 7), np.zeros(SHAPE, bool), WHOLE, WIDE)
    assert kinship([flat]) == kinship([]) == 1.0
    assert kinship([Neighbours.of(NOISE, np.ones(SHAPE, bool), WHOLE, WIDE)]) == 1.0
