"""The lattice of a tile: thinned, cut, or closed by itself."""

import numpy as np

from stereocell.model.lattice import Lattice
from stereocell.model.tiling import Box

REGION = Box((0, 0, 0), (9, 20, 30))
LEFT = Lattice(
    Box((0, 0, 0), (9, 20, 18)), Box((0, 0, 0), (9, 20, 15)), REGION, (2, 1, 1), (0, 5, 7)
)


def test_a_tile_is_cut_where_another_follows_and_nowhere_else() -> None:
    """World x grows with the voxels' x, so the plane of voxel x = 14 lies at 14 + 7 um."""
    assert list(LEFT.cuts()) == [(2, 14)]
    assert LEFT.cut_planes() == ((0, 21.0),)
    assert list(LEFT.alone().cuts()) == []
    assert list(Lattice.of_whole(REGION, (1, 1, 1)).cuts()) == []


def test_grown_points_stay_in_the_region() -> None:
    assert LEFT.grown(3).own == Box((0, 0, 0), (9, 20, 18))
    assert LEFT.grown(100).own == REGION


def test_thinned_planes_keep_their_places() -> None:
    """Each kept voxel has the same world position: origin plus index times spacing."""
    inner = Box((3, 2, 5), (9, 18, 29))
    lattice = Lattice(
        Box((3, 4, 8), (9, 16, 27)), Box((3, 6, 10), (9, 14, 24)), inner, (2, 1, 1), (0, 5, 7)
    )
    step = (1, 3, 2)
    thin = lattice.thinned(step)
    kept = lattice.slices_of_thinned(step)
    for axis in range(3):
        places = np.arange(lattice.window.start[axis], lattice.window.stop[axis])[kept[axis]]
        um = places * lattice.spacing_um[axis] + lattice.origin_um[axis]
        indices = np.arange(thin.window.start[axis], thin.window.stop[axis])
        np.testing.assert_allclose(um, indices * thin.spacing_um[axis] + thin.origin_um[axis])
    assert lattice.thinned((1, 1, 1)) is lattice
