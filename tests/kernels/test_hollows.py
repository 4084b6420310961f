"""Hollows and distances in a CT scan, compared with SciPy's."""

import numpy as np
import pytest
from scipy import ndimage

from stereocell.kernels.hollows import count_faces, find_hollows
from stereocell.kernels.plane_distances import find_far


@pytest.mark.parametrize("shape", [(9, 14, 17), (1, 8, 9), (6, 1, 7), (5, 6, 2)])
def test_hollows_are_the_holes_of_all_slices(shape: tuple[int, int, int]) -> None:
    for share in (0.4, 0.6, 0.8):
        solid = np.random.default_rng(7).random(shape) < share
        expected = np.zeros(shape, bool)
        for axis in range(3):
            filled = [ndimage.binary_fill_holes(one) for one in np.moveaxis(solid, axis, 0)]
            expected |= np.stack(filled, axis) & ~solid
        assert (find_hollows(solid) == expected).all()


def test_faces_of_a_hollow_are_counted_by_what_lies_beyond() -> None:
    labels = np.zeros((5, 5, 5), np.uint32)
    labels[1:4, 2, 2], labels[0, 0, 0] = 1, 2
    solid = labels == 0
    body = solid.copy()
    body[:, :, 3:] = False
    at_body, at_solid = count_faces(labels, body, solid, 3)
    assert at_body.tolist() == [0, 11, 3]
    assert at_solid.tolist() == [0, 14, 3]


@pytest.mark.parametrize("spacing", [(1000.0, 300.0, 300.0), (488.0, 4002.5, 488.0)])
def test_far_voxels_are_those_beyond_a_distance(spacing: tuple[float, float, float]) -> None:
    mask = np.random.default_rng(3).random((23, 31, 28)) < 0.001
    away = ndimage.distance_transform_edt(~mask, spacing)
    for distance in (200.0, 1234.5, 5001.0, 1e5):
        found = find_far(mask, np.array(spacing), distance)
        assert (found == (away > distance)).all()
    assert find_far(np.zeros((3, 4, 5), bool), np.array(spacing), 1.0).all()
