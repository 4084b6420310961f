"""The phantoms are tested, too: wrong bodies could make wrong code pass."""

from itertools import permutations, product

import numpy as np
import pytest

from support.phantoms import as_counts, blurred_ball, f_phantom


def test_f_differs_from_all_its_turns_and_mirror_images() -> None:
    body = f_phantom()
    cube = np.full((48, 48, 48), body.min())
    cube[: body.shape[0], : body.shape[1], : body.shape[2]] = body
    poses = {
        np.flip(cube.transpose(order), axes).tobytes()
        for order in permutations(range(3))
        for axes in ([a for a in range(3) if flips[a]] for flips in product((0, 1), repeat=3))
    }
    assert len(poses) == 48


@pytest.mark.slow
def test_blurred_ball_keeps_its_volume_and_is_a_numeric_convolution() -> None:
    from scipy import ndimage

    spacing, radius, sigma = (0.25, 0.2, 0.2), 2.0, 0.5
    shape, center = (40, 50, 50), (4.9, 5.0, 4.9)
    ball = blurred_ball(shape, spacing, center, radius, sigma)
    voxel = float(np.prod(spacing))
    assert ball.sum() * voxel == pytest.approx(4.0 / 3.0 * np.pi * radius**3, rel=1e-3)

    fine = 4  # samples of a voxel along each axis
    axes = [
        (np.arange(n * fine) + 0.5) / fine * h - 0.5 * h - c
        for n, h, c in zip(shape, spacing, center, strict=True)
    ]
    z, y, x = np.meshgrid(*axes, indexing="ij")
    solid = (z**2 + y**2 + x**2 <= radius**2).astype(np.float32)
    parts = [fine * sigma / h for h in spacing]
    smooth = ndimage.gaussian_filter(solid, parts)
    means = smooth.reshape(40, fine, 50, fine, 50, fine).mean(axis=(1, 3, 5))
    assert np.abs(means - ball).max() < 0.02


def test_counts_lie_between_their_levels() -> None:
    ball = blurred_ball((20, 20, 20), (0.5, 0.5, 0.5), (5.0, 5.0, 5.0), 3.0, 0.3)
    counts = as_counts(ball, 100.0, 900.0)
    assert counts.dtype == np.uint16
    assert (counts.min(), counts.max()) == (100, 900)
    assert as_counts(ball, 100.0, 900.0, noise=5.0).std() > counts.std()
