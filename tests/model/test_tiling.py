"""Tiles cover the region once, and their lattices share planes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stereocell.model.tiling import Box, Tile, cut, cut_evenly

lengths = st.integers(2, 60)


def _assert_whole(tiles: tuple[Tile, ...], region: Box) -> None:
    voxels, cells = np.zeros(region.stop, int), np.zeros(region.stop, int)
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


@given(shape=st.tuples(lengths, lengths, lengths), size=st.tuples(lengths, lengths, lengths))
def test_tiles_cover_every_voxel_once_and_lattices_every_cell_once(
    shape: tuple[int, int, int], size: tuple[int, int, int]
) -> None:
    region = Box((3, 4, 5), (shape[0] + 3, shape[1] + 4, shape[2] + 5))
    _assert_whole(cut(region, size), region)


@pytest.mark.slow
@given(columns=st.integers(1, 9), rows=st.integers(1, 9), more=st.tuples(lengths, lengths, lengths))
def test_a_grid_gives_columns_by_rows_of_nearly_equal_tiles(
    columns: int, rows: int, more: tuple[int, int, int]
) -> None:
    depth, height, width = more[0], 2 * rows - 2 + more[1], 2 * columns - 2 + more[2]
    region = Box((3, 4, 5), (3 + depth, 4 + height, 5 + width))
    tiles = cut_evenly(region, columns, rows)
    _assert_whole(tiles, region)
    assert len(tiles) == columns * rows
    assert tiles[-1].id == f"r{rows - 1}_c{columns - 1}"
    for axis in range(3):
        sizes = [tile.box.shape[axis] for tile in tiles]
        assert max(sizes) - min(sizes) <= 1
        assert min(sizes) >= 2


def test_tile_ids_name_row_column_and_a_split_depth() -> None:
    region = Box((0, 0, 0), (8, 20, 50))
    assert [t.id for t in cut(region, (8, 10, 25))] == ["r0_c0", "r0_c1", "r1_c0", "r1_c1"]
    assert [t.id for t in cut(region, (4, 20, 50))] == ["r0_c0_z0", "r0_c0_z1"]


@pytest.mark.parametrize("halo", [(0, 0, 0), (2, 3, 100)])
def test_the_halo_ends_at_the_region(halo: tuple[int, int, int]) -> None:
    region = Box((0, 0, 0), (10, 20, 30))
    window = Box((2, 5, 5), (8, 10, 10)).grown(halo, region)
    assert all(
        0 <= a < b <= n for a, b, n in zip(window.start, window.stop, region.stop, strict=True)
    )
