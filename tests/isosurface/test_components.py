"""Components found by runs of voxels, compared with SciPy's labels."""

from typing import Literal

import numpy as np
import pytest
from scipy import ndimage

from stereocell.isosurface.components import find_components

SPACING = (2.0, 1.0, 0.5)


@pytest.mark.parametrize("connectivity", [6, 26])
@pytest.mark.parametrize("share", [0.1, 0.3, 0.6])
def test_components_equal_those_of_scipy(connectivity: Literal[6, 26], share: float) -> None:
    mask = np.random.default_rng(0).random((9, 14, 23)) < share
    around = ndimage.generate_binary_structure(3, 1 if connectivity == 6 else 3)
    labels, count = ndimage.label(mask, around)
    found = find_components(mask, SPACING, connectivity)
    assert len(found.voxels) == count

    seen = np.zeros(mask.shape, int)
    for k in range(count):
        own = found.mask_of(np.arange(count) == k)
        label = labels[own][0]
        np.testing.assert_array_equal(own, labels == label)
        places = np.argwhere(own)
        assert found.voxels[k] == len(places)
        extent = np.ptp(places, axis=0) * SPACING
        assert found.diagonal_um[k] == pytest.approx(float(np.linalg.norm(extent)))
        ends = np.array(mask.shape) - 1
        assert found.whole[k] == ((places > 0) & (places < ends)).all()
        beyond = sum(int((np.diff(own.astype(int), axis=axis) != 0).sum()) for axis in range(3))
        assert found.faces()[k] == 2 * beyond
        seen += own
    np.testing.assert_array_equal(seen > 0, mask)


@pytest.mark.parametrize("value", [False, True])
def test_an_empty_mask_has_no_component_and_a_full_one_has_one(value: bool) -> None:
    found = find_components(np.full((3, 4, 5), value), SPACING, 26)
    assert found.voxels.tolist() == ([60] if value else [])
    assert found.whole.tolist() == ([False] if value else [])
