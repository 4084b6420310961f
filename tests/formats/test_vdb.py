"""The .vdb files are read back by a small reader of the OpenVDB layout that shares no code with the
writer: it walks the tree node by node, as tree/InternalNode.h and tree/LeafNode.h do."""

from pathlib import Path

import numpy as np
import pytest

from stereocell.formats.vdb import check_vdb, write_vdb
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


def test_same_voxels_same_bytes_and_other_voxels_another_uuid(tmp_path: Path) -> None:
    density = np.full((9, 9, 9), 7, dtype=np.uint8)
    for name in ("a", "b"):
        write_vdb(tmp_path / f"{name}.vdb", density, first_um=(0, 0, 0), spacing_um=SPACING_UM)
    density[0, 0, 0] = 8
    write_vdb(tmp_path / "c.vdb", density, first_um=(0, 0, 0), spacing_um=SPACING_UM)
    assert (tmp_path / "a.vdb").read_bytes() == (tmp_path / "b.vdb").read_bytes()
    assert read_vdb(tmp_path / "a.vdb").uuid != read_vdb(tmp_path / "c.vdb").uuid


def test_a_file_that_was_cut_short_or_is_another_is_one_clear_line(tmp_path: Path) -> None:
    path = tmp_path / "a.vdb"
    density = np.random.default_rng(1).integers(0, 256, (9, 12, 30), dtype=np.uint8)
    write_vdb(path, density, first_um=(0.0, 0.0, 0.0), spacing_um=SPACING_UM)
    whole = path.read_bytes()
    check_vdb(path)
    for size in (0, 7, 40, 80, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:size])
        with pytest.raises(StageError, match=r"a\.vdb: can't be read as OpenVDB: it"):
            check_vdb(path)
    path.write_bytes(b"\x76" + whole)
    with pytest.raises(StageError, match="its first bytes are not OpenVDB's"):
        check_vdb(path)
    path.unlink()
    with pytest.raises(StageError, match=r"a\.vdb: can't be read: No such file"):
        check_vdb(path)


def test_a_folder_that_is_a_file_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("in the way")
    with pytest.raises(OutputError, match=r"out/a\.vdb: can't be written"):
        write_vdb(
            tmp_path / "out" / "a.vdb",
            np.zeros((3, 3, 3), np.uint8),
            first_um=(0, 0, 0),
            spacing_um=(1, 1, 1),
        )
