"""The part of a solid that is too thin for a surface that only every k-th plane carries."""

import numpy as np
import pytest
from skimage.morphology import opening

from stereocell.isosurface.thin_structures import count_thin


@pytest.mark.parametrize("every", [2, 3])
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("first", range(4, 7))
def test_a_plate_no_thicker_than_the_planes_distance_is_thin_wherever_it_lies(
    every: int, axis: int, first: int
) -> None:
    for thickness in range(1, every + 3):
        solid = np.zeros((20, 20, 20), bool)
        np.moveaxis(solid, axis, 0)[first : first + thickness, 3:17, 3:17] = True
        thin = count_thin(solid, (every, every, every))
        assert thin == (solid.sum() if thickness <= every else 0)


@pytest.mark.parametrize("step", [(2, 2, 2), (1, 3, 2), (4, 1, 1)])
def test_thin_voxels_are_those_that_scikit_image_s_opening_removes(
    step: tuple[int, int, int],
) -> None:
    solid = np.random.default_rng(0).random((18, 24, 30)) < 0.95
    solid[:5], solid[-5:] = False, False
    box = np.ones([every + 1 if every > 1 else 1 for every in step], bool)
    inner = np.pad(solid, 6, mode="edge")
    wanted = opening(inner, box)[6:-6, 6:-6, 6:-6]
    assert 0 < wanted.sum() < solid.sum()
    assert count_thin(solid, step) == (solid & ~wanted).sum()


def test_nothing_is_thin_where_all_planes_are_kept() -> None:
    assert count_thin(np.eye(4, dtype=bool)[None], (1, 1, 1)) == 0
    assert count_thin(np.zeros((5, 5, 5), bool), (2, 2, 2)) == 0
