"""Tiles cover the region once, and their lattices share planes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stereocell.tiling import Box, cut, size_of_grid

lengths = st.integers(2, 60)


@given(shape=st.tuples(lengths, lengths, lengths), size=st.tuples(lengths, lengths, lengths))
def test_tiles_cover_every_voxel_once_and_lattices_every_cell_once(
    shape: tuple[int, int, int], size: tuple[int, int, int]
) -> None:
    region = Box((3, 4, 5), (shape[0] + 3, shape[1] + 4, shape[2] + 5))
    voxels, cells = np.zeros(region.stop, int), np.zeros(region.stop, int)
    tiles = cut(region, size)
    for tile in tiles:
        voxels[tile.box.slices] += 1
        lattice = tile.lattice(region)
        cells[tuple(slice(a, b - 1) for a, b in zip(lattice.start, lattice.stop, strict=True))] += 1
        assert min(lattice.shape) >= 2
    assert (voxels[region.slices] == 1).all()
    inner = tuple(slice(a, b - 1) for a, b in zip(region.start, region.stop, strict=True))
    assert (cells[inner] == 1).all()
    assert cells.sum() == cells[inner].sum()
    assert len({tile.id for tile in tiles}) == len(tiles)


def test_ids_name_row_and_column_and_depth_where_split() -> None:
    region = Box((0, 0, 0), (8, 20, 50))
    assert [t.id for t in cut(region, (8, 10, 25))] == ["r0_c0", "r0_c1", "r1_c0", "r1_c1"]
    assert [t.id for t in cut(region, (4, 20, 50))] == ["r0_c0_z0", "r0_c0_z1"]


def test_grid_gives_columns_by_rows() -> None:
    region = Box((0, 0, 0), (64, 256, 641))
    tiles = cut(region, size_of_grid(region, 5, 2))
    assert len(tiles) == 10
    assert tiles[-1].id == "r1_c4"


@pytest.mark.parametrize("halo", [(0, 0, 0), (2, 3, 100)])
def test_halo_stops_at_the_region(halo: tuple[int, int, int]) -> None:
    region = Box((0, 0, 0), (10, 20, 30))
    window = Box((2, 5, 5), (8, 10, 10)).grown(halo, region)
    assert all(
        0 <= a < b <= n for a, b, n in zip(window.start, window.stop, region.stop, strict=True)
    )
