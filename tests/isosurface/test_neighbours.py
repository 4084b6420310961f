"""The correlation of neighbours, compared with numpy's; the same in tiles, and without padding."""

import numpy as np
import pytest
from scipy import ndimage

from stereocell.isosurface.neighbours import MIN_CORRELATION, Neighbours, neighbour_correlation

SHAPE = (6, 160, 200)
WIDE = (-1e9, 3.0, 1e9)
WHOLE = tuple(slice(0, n) for n in SHAPE)
RNG = np.random.default_rng(8)
NOISE = RNG.normal(5, 2, SHAPE)
BLURRED = ndimage.gaussian_filter(NOISE, (0, 1, 2))


def _by_numpy(voxels: np.ndarray) -> float:
    """Return the larger of the correlations along y and along x."""
    along_y = np.corrcoef(voxels[:, 1:].ravel(), voxels[:, :-1].ravel())[0, 1]
    along_x = np.corrcoef(voxels[..., 1:].ravel(), voxels[..., :-1].ravel())[0, 1]
    return max(along_y, along_x)


@pytest.mark.parametrize("voxels", [NOISE, BLURRED], ids=["noise", "blurred"])
def test_correlation_is_numpy_s_and_the_same_in_tiles(voxels: np.ndarray) -> None:
    no_padding = np.zeros(SHAPE, bool)
    whole = neighbour_correlation([Neighbours.of(voxels, no_padding, WHOLE, WIDE)])
    assert whole == pytest.approx(_by_numpy(voxels), abs=0.02)  # numpy's means leave out one edge
    tiles = [
        Neighbours.of(voxels, no_padding, (slice(0, 6), rows, columns), WIDE)
        for rows in (slice(0, 17), slice(17, 160))
        for columns in (slice(0, 31), slice(31, 200))
    ]
    assert neighbour_correlation(tiles) == pytest.approx(whole, rel=1e-9)


def test_even_the_least_blur_is_distinguished_from_noise() -> None:
    no_padding, shape = np.zeros((20, 200, 200), bool), (20, 200, 200)
    own = tuple(slice(0, n) for n in shape)
    noise = np.random.default_rng(9).poisson(0.1, shape).astype(np.uint8)
    assert (
        abs(neighbour_correlation([Neighbours.of(noise, no_padding, own, (0.0, 0.0, 10.0))]))
        < MIN_CORRELATION
    )
    measured = noise + ndimage.gaussian_filter(noise.astype(np.float32), 0.6)
    assert (
        neighbour_correlation([Neighbours.of(measured, no_padding, own, (0.0, 0.0, 10.0))])
        > 10 * MIN_CORRELATION
    )


def test_bodies_are_found_although_scan_lines_differ() -> None:
    lines = np.random.default_rng(10).normal(0, 20, (*SHAPE[:2], 1))
    no_padding = np.zeros(SHAPE, bool)
    measured = Neighbours.of(BLURRED + lines, no_padding, WHOLE, WIDE)
    along_y = np.corrcoef((BLURRED + lines)[:, 1:].ravel(), (BLURRED + lines)[:, :-1].ravel())[0, 1]
    assert abs(along_y) < 0.1
    assert neighbour_correlation([measured]) > 0.9


def test_padding_is_left_out_and_hot_voxels_are_clipped() -> None:
    voxels, padding = BLURRED.copy(), np.zeros(SHAPE, bool)
    padding[:, :, 80:110] = True
    voxels[padding] = 1e6
    halves = np.delete(BLURRED, slice(80, 110), axis=2)
    found = neighbour_correlation([Neighbours.of(voxels, padding, WHOLE, WIDE)])
    assert found == pytest.approx(_by_numpy(halves), abs=0.05)
    hot = BLURRED.copy()
    hot[3, 5, 7] = 1e9
    same = Neighbours.of(hot, np.zeros(SHAPE, bool), WHOLE, (0.0, 5.0, 10.0))
    assert neighbour_correlation([same]) == pytest.approx(_by_numpy(BLURRED), abs=0.05)


def test_an_unknown_correlation_is_one() -> None:
    flat = Neighbours.of(np.full(SHAPE, 7), np.zeros(SHAPE, bool), WHOLE, WIDE)
    assert neighbour_correlation([flat]) == neighbour_correlation([]) == 1.0
    assert neighbour_correlation([Neighbours.of(NOISE, np.ones(SHAPE, bool), WHOLE, WIDE)]) == 1.0
