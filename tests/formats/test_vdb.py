"""The .vdb files are read back by a small reader that shares no code with the writer.

It walks the tree node by node, as tree/InternalNode.h and tree/LeafNode.h of OpenVDB do.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stereocell.formats.vdb import check_vdb, is_vdb_of, write_vdb
from stereocell.formats.vdb_read import VdbValues
from stereocell.model.errors import OutputError, StageError
from support.vdb_reader import read_vdb, value_at

SPACING_UM = (0.28, 0.14, 0.15)


def test_every_voxel_lies_at_its_world_position(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    density = rng.integers(0, 256, (11, 18, 25), dtype=np.uint8)
    density[rng.random(density.shape) < 0.4] = 0
    write_vdb(tmp_path / "a.vdb", density, first_um=(5.0, 7.0, 9.0), spacing_um=SPACING_UM)
    vdb = read_vdb(tmp_path / "a.vdb")
    assert len(vdb.voxels) == np.count_nonzero(density)
    for z, y, x in np.ndindex(density.shape):
        world = (9.0 + 0.15 * x, -(7.0 + 0.14 * y), 5.0 + 0.28 * z)
        assert value_at(vdb, world) == pytest.approx(density[z, y, x] / 255, abs=2.5e-4)


def test_scales_are_positive_and_the_header_names_the_grid(tmp_path: Path) -> None:
    density = np.zeros((4, 6, 9), dtype=np.uint8)
    density[1, 2, 3] = density[2, 5, 8] = 255
    write_vdb(tmp_path / "a.vdb", density, first_um=(0.0, 0.0, 0.0), spacing_um=SPACING_UM)
    vdb = read_vdb(tmp_path / "a.vdb")
    assert vdb.transform == "ScaleTranslateMap"
    assert vdb.scale_um == (0.15, 0.14, 0.28)
    assert vdb.voxels == {(3, 3, 1): 1.0, (8, 0, 2): 1.0}
    assert vdb.metadata["class"] == "fog volume"
    assert vdb.metadata["file_bbox_min"] == (3, 0, 1)
    assert vdb.metadata["file_bbox_max"] == (8, 3, 2)
    assert vdb.metadata["file_voxel_count"] == 2


def test_trees_of_many_nodes_keep_their_order(tmp_path: Path) -> None:
    density = np.zeros((2, 300, 4200), dtype=np.uint8)  # two roots along x, three nodes along y
    marks = [(0, 0, 0), (1, 299, 4199), (0, 150, 127), (1, 20, 128), (0, 171, 4096), (1, 44, 4095)]
    for n, mark in enumerate(marks):
        density[mark] = 50 * (n + 1) - 45
    write_vdb(tmp_path / "a.vdb", density, first_um=(0.0, 0.0, 0.0), spacing_um=(1.0, 1.0, 1.0))
    vdb = read_vdb(tmp_path / "a.vdb")
    assert vdb.transform == "UniformScaleTranslateMap"
    assert len(vdb.voxels) == len(marks)
    for n, (z, y, x) in enumerate(marks):
        expected = (50 * (n + 1) - 45) / 255
        assert value_at(vdb, (x, -y, z)) == pytest.approx(expected, abs=2.5e-4)


def test_an_empty_volume_is_a_file_without_leaves(tmp_path: Path) -> None:
    write_vdb(
        tmp_path / "a.vdb",
        np.zeros((9, 9, 9), dtype=np.uint8),
        first_um=(0, 0, 0),
        spacing_um=SPACING_UM,
    )
    vdb = read_vdb(tmp_path / "a.vdb")
    assert vdb.voxels == {}
    assert vdb.metadata["file_bbox_max"] == (-1, -1, -1)


def test_the_same_voxels_give_the_same_bytes_and_others_another_uuid(tmp_path: Path) -> None:
    density = np.full((9, 9, 9), 7, dtype=np.uint8)
    for name in ("a", "b"):
        write_vdb(tmp_path / f"{name}.vdb", density, first_um=(0, 0, 0), spacing_um=SPACING_UM)
    density[0, 0, 0] = 8
    write_vdb(tmp_path / "c.vdb", density, first_um=(0, 0, 0), spacing_um=SPACING_UM)
    assert (tmp_path / "a.vdb").read_bytes() == (tmp_path / "b.vdb").read_bytes()
    assert read_vdb(tmp_path / "a.vdb").uuid != read_vdb(tmp_path / "c.vdb").uuid


def test_the_error_for_a_file_cut_short_or_of_another_kind_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.vdb"
    density = np.random.default_rng(1).integers(0, 256, (9, 12, 30), dtype=np.uint8)
    write_vdb(path, density, first_um=(0.0, 0.0, 0.0), spacing_um=SPACING_UM)
    whole = path.read_bytes()
    check_vdb(path)
    for size in (0, 7, 40, 80, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:size])
        with pytest.raises(StageError, match=r"a\.vdb: can't be read as OpenVDB: (its|the file) "):
            check_vdb(path)
    path.write_bytes(b"\x76" + whole)
    with pytest.raises(StageError, match="its first bytes are not OpenVDB's"):
        check_vdb(path)
    path.unlink()
    with pytest.raises(StageError, match=r"a\.vdb: can't be read: No such file"):
        check_vdb(path)


@pytest.fixture
def volume() -> dict[str, Any]:
    """Arguments of `write_vdb`: leaves that are full, empty, and cut off at the end."""
    rng = np.random.default_rng(4)
    measured = rng.integers(3, 900, (14, 22, 34)).astype(np.uint16)
    measured[:, :12, :20] = 3
    own = np.clip(measured[1:-1, 1:-1, 1:-1] // 4, 0, 255).astype(np.uint8)
    places = {"first_um": (5.0, 7.0, 9.0), "spacing_um": SPACING_UM}
    return {"density": own, "measured": measured, "apron": 1, **places}


def test_a_file_is_found_equal_to_the_volume_that_it_was_written_from(
    tmp_path: Path, volume: dict[str, Any]
) -> None:
    path = tmp_path / "a.vdb"
    write_vdb(path, **volume)
    assert is_vdb_of(path, **volume)
    write_vdb(path, **{**volume, "measured": None})
    assert is_vdb_of(path, **{**volume, "measured": None})
    with pytest.raises(FileNotFoundError):
        is_vdb_of(tmp_path / "b.vdb", **volume)


@pytest.mark.parametrize(
    "change",
    [
        {"measured": None},
        {"first_um": (5.0, 7.0, 9.5)},
        {"spacing_um": (0.28, 0.14, 0.16)},
        {"apron": 2},
    ],
)
def test_a_file_differs_from_a_volume_of_other_grids_or_places(
    tmp_path: Path, volume: dict[str, Any], change: dict[str, Any]
) -> None:
    write_vdb(tmp_path / "a.vdb", **{**volume, **change})
    assert not is_vdb_of(tmp_path / "a.vdb", **volume)


@pytest.mark.parametrize("grid", ["density", "measured"])
@pytest.mark.parametrize("place", [(0, 0, 0), (11, 19, 31), (5, 3, 4)])
def test_a_file_differs_from_a_volume_with_one_other_voxel(
    tmp_path: Path, volume: dict[str, Any], grid: str, place: tuple[int, int, int]
) -> None:
    write_vdb(tmp_path / "a.vdb", **volume)
    other = volume[grid].copy()
    other[place] += 1
    assert not is_vdb_of(tmp_path / "a.vdb", **{**volume, grid: other})


def test_a_file_with_any_damaged_byte_differs(tmp_path: Path, volume: dict[str, Any]) -> None:
    path = tmp_path / "a.vdb"
    write_vdb(path, **volume)
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    for place in [*range(80), *rng.integers(80, len(whole), 300).tolist()]:
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        assert not is_vdb_of(path, **volume), place
    for size in (0, 64, 200, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:size])
        assert not is_vdb_of(path, **volume), size
    path.write_bytes(whole + b"\0")
    assert not is_vdb_of(path, **volume)


def write_measured(path: Path, measured: np.ndarray, shape: tuple[int, int, int]) -> None:
    density = np.random.default_rng(5).integers(0, 256, shape, dtype=np.uint8)
    write_vdb(
        path,
        density,
        first_um=(5.0, 7.0, 9.0),
        spacing_um=SPACING_UM,
        measured=measured,
        apron=1,
    )


def lowest_um(shape: tuple[int, ...]) -> tuple[float, float, float]:
    """Return the centre of the lowest voxel of an apron, (x, y, z)."""
    return 9.0 - 0.15, -(7.0 + 0.14 * (shape[1] - 2)), 5.0 - 0.28


@pytest.mark.slow
@pytest.mark.parametrize(
    ("dtype", "low", "high"),
    [(np.uint8, 0, 256), (np.uint16, 0, 65536), (np.int16, -1024, 3072), (np.float32, -2, 2)],
)
def test_measured_voxels_are_read_back_bit_by_bit(
    tmp_path: Path, dtype: type, low: int, high: int
) -> None:
    rng = np.random.default_rng(7)
    drawn = rng.uniform(low, high, (14, 21, 28))
    measured = (drawn if dtype == np.float32 else np.floor(drawn)).astype(dtype)
    measured[:, :9] = measured.min()  # leaves of background alone, which are left out
    path = tmp_path / "a.vdb"
    write_measured(path, measured, (11, 18, 26))  # planes and columns are shared with neighbours
    found = VdbValues(path, "measured").box(lowest_um(measured.shape), measured.shape[::-1])
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found, measured.astype(np.float32))
    vdb = read_vdb(path, "measured")  # the tests' own reader, by OpenVDB's layout
    assert vdb.metadata["class"] == "unknown"
    assert vdb.background == measured.min()
    assert len(vdb.voxels) == np.count_nonzero(measured != measured.min())
    for z, y, x in np.ndindex(*(n - 2 for n in measured.shape)):
        world = (9.0 + 0.15 * x, -(7.0 + 0.14 * y), 5.0 + 0.28 * z)
        assert value_at(vdb, world) == measured[z + 1, y + 1, x + 1]
    density = read_vdb(path)
    assert (density.offset_um, density.scale_um) == (vdb.offset_um, vdb.scale_um)


def test_a_part_of_measured_voxels_is_read_by_its_position(tmp_path: Path) -> None:
    measured = np.random.default_rng(2).integers(0, 9999, (20, 40, 300)).astype(np.uint16)
    write_measured(tmp_path / "a.vdb", measured, (18, 38, 298))
    x, y, z = lowest_um(measured.shape)
    corner = (x + 0.15 * 120, y + 0.14 * 3, z + 0.28 * 5)
    found = VdbValues(tmp_path / "a.vdb", "measured").box(corner, (60, 20, 9))
    np.testing.assert_array_equal(found, measured[5:14, 17:37, 120:180])


@pytest.mark.slow
def test_the_error_for_measured_voxels_of_a_damaged_file_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.vdb"
    measured = np.random.default_rng(2).integers(0, 9999, (12, 20, 30)).astype(np.uint16)
    write_measured(path, measured, (10, 18, 28))
    whole = path.read_bytes()
    start = VdbValues(path, "measured").grid.start
    low, size = lowest_um(measured.shape), measured.shape[::-1]
    rng = np.random.default_rng(0)
    refused = 0
    for place in rng.integers(start, len(whole), 300).tolist():
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        try:  # either a value differs or the file is refused
            found = VdbValues(path, "measured").box(low, size)
        except StageError:
            refused += 1
        else:
            assert found.shape == measured.shape
    assert 20 < refused < 300
    write_vdb(path, np.zeros((4, 4, 4), np.uint8), first_um=(0, 0, 0), spacing_um=SPACING_UM)
    with pytest.raises(StageError, match=r"a\.vdb: found no grid 'measured' of floats"):
        VdbValues(path, "measured")


def test_the_error_for_a_folder_that_is_a_file_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("in the way")
    with pytest.raises(OutputError, match=r"out/a\.vdb: can't be written"):
        write_vdb(
            tmp_path / "out" / "a.vdb",
            np.zeros((3, 3, 3), np.uint8),
            first_um=(0, 0, 0),
            spacing_um=(1, 1, 1),
        )
