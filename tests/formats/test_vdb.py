"""The .vdb files are read back by a small reader of the OpenVDB layout that shares no code with the
writer: it walks the tree node by node, as tree/InternalNode.h and tree/LeafNode.h do."""

import struct
import zlib
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stereocell.formats.vdb import check_vdb, write_vdb
from stereocell.model.errors import OutputError, StageError

SPACING_UM = (0.28, 0.14, 0.15)


@dataclass
class Vdb:
    uuid: str
    metadata: dict[str, Any]
    transform: str
    offset_um: tuple[float, ...]
    scale_um: tuple[float, ...]
    voxels: dict[tuple[int, int, int], float] = field(default_factory=dict)


class Reader:
    def __init__(self, content: bytes) -> None:
        self.file = BytesIO(content)

    def take(self, layout: str) -> Any:
        values = struct.unpack("<" + layout, self.file.read(struct.calcsize("<" + layout)))
        return values if len(values) > 1 else values[0]

    def text(self) -> str:
        return self.file.read(self.take("I")).decode()

    def bits(self, count: int) -> list[int]:
        mask = int.from_bytes(self.file.read(count // 8), "little")
        return [n for n in range(count) if mask >> n & 1]

    def metadata(self) -> dict[str, Any]:
        parse = {"string": bytes.decode, "bool": any, "int64": lambda b: struct.unpack("<q", b)[0]}
        parse["vec3i"] = lambda b: struct.unpack("<3i", b)
        items = {}
        for _ in range(self.take("I")):
            name, kind = self.text(), self.text()
            items[name] = parse[kind](self.file.read(self.take("I")))
        return items

    def halves(self, count: int) -> tuple[float, ...]:
        """Active values only (code 0), zipped unless the size is negative."""
        assert self.take("b") == 0
        if count == 0:
            return ()
        size = self.take("q")
        raw = zlib.decompress(self.file.read(size)) if size > 0 else self.file.read(-size)
        return struct.unpack(f"<{count}e", raw)


def read_vdb(path: Path) -> Vdb:
    r = Reader(path.read_bytes())
    magic, version, major, _, has_offsets = r.take("qIII?")
    assert (magic, version, major, has_offsets) == (0x56444220, 224, 12, True)
    uuid = r.file.read(36).decode()
    assert r.metadata() == {}
    assert r.take("i") == 1  # grids
    assert (r.text(), r.text(), r.text()) == ("density", "Tree_float_5_4_3_HalfFloat", "")
    grid_at, blocks_at, end_at = r.take("qqq")
    assert r.file.tell() == grid_at
    assert r.take("I") == 3  # zip and active mask
    metadata = r.metadata()
    transform = r.text()
    numbers = r.take("18d")
    offset, scale = numbers[:3], numbers[3:6]
    s = np.array(scale)
    assert np.allclose(numbers[6:], np.concatenate([np.abs(s), 1 / s, 1 / s**2, 0.5 / s]))
    vdb = Vdb(uuid, metadata, transform, offset, scale)

    buffers, background, tiles, children = r.take("ifII")
    assert (buffers, background, tiles) == (1, 0.0, 0)
    leaves = []
    for _ in range(children):
        root = r.take("3i")
        assert all(v % 4096 == 0 for v in root)
        outer, active = r.bits(32768), r.bits(32768)
        assert r.halves(len(active)) == ()
        for n in outer:
            low = [root[a] + 128 * (n >> shift & 31) for a, shift in enumerate((10, 5, 0))]
            inner, active = r.bits(4096), r.bits(4096)
            assert r.halves(len(active)) == ()
            for m in inner:
                corner = [low[a] + 8 * (m >> shift & 15) for a, shift in enumerate((8, 4, 0))]
                leaves.append((corner, r.bits(512)))
    assert r.file.tell() == blocks_at
    for (x, y, z), mask in leaves:
        assert r.bits(512) == mask
        for n, value in zip(mask, r.halves(len(mask)), strict=True):
            vdb.voxels[x + (n >> 6), y + (n >> 3 & 7), z + (n & 7)] = value
    assert r.file.tell() == end_at
    assert r.file.read() == b""
    return vdb


def value_at(vdb: Vdb, position_um: tuple[float, float, float]) -> float:
    """The value of the voxel whose centre lies at a world position."""
    index = (np.array(position_um) - vdb.offset_um) / vdb.scale_um
    assert np.allclose(index, np.rint(index), atol=1e-4)
    i, j, k = (int(n) for n in np.rint(index))
    return vdb.voxels.get((i, j, k), 0.0)


def test_every_voxel_lies_at_its_world_position(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    density = rng.integers(0, 256, (11, 18, 25), dtype=np.uint8)
    density[rng.random(density.shape) < 0.4] = 0
    write_vdb(tmp_path / "a.vdb", density, (5.0, 7.0, 9.0), SPACING_UM)
    vdb = read_vdb(tmp_path / "a.vdb")
    assert len(vdb.voxels) == np.count_nonzero(density)
    for z, y, x in np.ndindex(density.shape):
        world = (9.0 + 0.15 * x, -(7.0 + 0.14 * y), 5.0 + 0.28 * z)
        assert value_at(vdb, world) == pytest.approx(density[z, y, x] / 255, abs=2.5e-4)


def test_scales_are_positive_and_the_header_names_the_grid(tmp_path: Path) -> None:
    density = np.zeros((4, 6, 9), dtype=np.uint8)
    density[1, 2, 3] = density[2, 5, 8] = 255
    write_vdb(tmp_path / "a.vdb", density, (0.0, 0.0, 0.0), SPACING_UM)
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
    write_vdb(tmp_path / "a.vdb", density, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    vdb = read_vdb(tmp_path / "a.vdb")
    assert vdb.transform == "UniformScaleTranslateMap"
    assert len(vdb.voxels) == len(marks)
    for n, (z, y, x) in enumerate(marks):
        expected = (50 * (n + 1) - 45) / 255
        assert value_at(vdb, (x, -y, z)) == pytest.approx(expected, abs=2.5e-4)


def test_an_empty_volume_is_a_file_without_leaves(tmp_path: Path) -> None:
    write_vdb(tmp_path / "a.vdb", np.zeros((9, 9, 9), dtype=np.uint8), (0, 0, 0), SPACING_UM)
    vdb = read_vdb(tmp_path / "a.vdb")
    assert vdb.voxels == {}
    assert vdb.metadata["file_bbox_max"] == (-1, -1, -1)


def test_same_voxels_same_bytes_and_other_voxels_another_uuid(tmp_path: Path) -> None:
    density = np.full((9, 9, 9), 7, dtype=np.uint8)
    for name in ("a", "b"):
        write_vdb(tmp_path / f"{name}.vdb", density, (0, 0, 0), SPACING_UM)
    density[0, 0, 0] = 8
    write_vdb(tmp_path / "c.vdb", density, (0, 0, 0), SPACING_UM)
    assert (tmp_path / "a.vdb").read_bytes() == (tmp_path / "b.vdb").read_bytes()
    assert read_vdb(tmp_path / "a.vdb").uuid != read_vdb(tmp_path / "c.vdb").uuid


def test_a_file_that_was_cut_short_or_is_another_is_one_clear_line(tmp_path: Path) -> None:
    path = tmp_path / "a.vdb"
    density = np.random.default_rng(1).integers(0, 256, (9, 12, 30), dtype=np.uint8)
    write_vdb(path, density, (0.0, 0.0, 0.0), SPACING_UM)
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
        write_vdb(tmp_path / "out" / "a.vdb", np.zeros((3, 3, 3), np.uint8), (0, 0, 0), (1, 1, 1))
