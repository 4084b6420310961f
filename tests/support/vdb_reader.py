"""A VDB reader that is independent of the product, written from the format's description."""

import struct
import zlib
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numcodecs import blosc


@dataclass
class Vdb:
    uuid: str
    metadata: dict[str, Any]
    transform: str
    offset_um: tuple[float, ...]
    scale_um: tuple[float, ...]
    background: float
    voxels: dict[tuple[int, int, int], float] = field(default_factory=dict)


class Reader:
    def __init__(self, content: bytes) -> None:
        self.file = BytesIO(content)
        self.is_half = True

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

    def values(self, count: int) -> tuple[float, ...]:
        """Read values with code 0, active values only; they are packed unless the size is negative.

        OpenVDB leaves out the size if there are no values in half precision, but not for floats.
        """
        assert self.take("b") == 0
        if count == 0 and self.is_half:
            return ()
        size = self.take("q")
        raw = self.file.read(abs(size))
        if size > 0:
            raw = zlib.decompress(raw) if self.is_half else blosc.decompress(raw)
        return struct.unpack(f"<{count}{'e' if self.is_half else 'f'}", raw)


def read_vdb(path: Path, name: str = "density") -> Vdb:
    """Read the only grid of a file, or the grid of this name if there are two."""
    r = Reader(path.read_bytes())
    magic, version, major, _, has_offsets = r.take("qIII?")
    assert (magic, version, major, has_offsets) == (0x56444220, 224, 12, True)
    uuid = r.file.read(36).decode()
    assert r.metadata() == {}
    grids = {}
    count = r.take("i")
    for _ in range(count):
        found, grid = read_grid(r, uuid)
        grids[found] = grid
    assert len(grids) == count
    assert r.file.read() == b""
    return grids[name]


def read_grid(r: Reader, uuid: str) -> tuple[str, Vdb]:
    name, tree, instance = r.text(), r.text(), r.text()
    r.is_half = tree.endswith("_HalfFloat")
    assert (tree.removesuffix("_HalfFloat"), instance) == ("Tree_float_5_4_3", "")
    grid_at, blocks_at, end_at = r.take("qqq")
    assert r.file.tell() == grid_at
    assert r.take("I") == (3 if r.is_half else 6)  # zip or Blosc, and active mask
    metadata = r.metadata()
    assert metadata.get("is_saved_as_half_float", False) == r.is_half
    transform = r.text()
    numbers = r.take("18d")
    offset, scale = numbers[:3], numbers[3:6]
    s = np.array(scale)
    assert np.allclose(numbers[6:], np.concatenate([np.abs(s), 1 / s, 1 / s**2, 0.5 / s]))
    buffers, background, tiles, children = r.take("ifII")
    assert (buffers, tiles) == (1, 0)
    vdb = Vdb(uuid, metadata, transform, offset, scale, background)
    leaves = []
    for _ in range(children):
        root = r.take("3i")
        assert all(v % 4096 == 0 for v in root)
        outer, active = r.bits(32768), r.bits(32768)
        assert r.values(len(active)) == ()
        for n in outer:
            low = [root[a] + 128 * (n >> shift & 31) for a, shift in enumerate((10, 5, 0))]
            inner, active = r.bits(4096), r.bits(4096)
            assert r.values(len(active)) == ()
            for m in inner:
                corner = [low[a] + 8 * (m >> shift & 15) for a, shift in enumerate((8, 4, 0))]
                leaves.append((corner, r.bits(512)))
    assert r.file.tell() == blocks_at
    for (x, y, z), mask in leaves:
        assert r.bits(512) == mask
        for n, value in zip(mask, r.values(len(mask)), strict=True):
            vdb.voxels[x + (n >> 6), y + (n >> 3 & 7), z + (n & 7)] = value
    assert r.file.tell() == end_at
    return name, vdb


def value_at(vdb: Vdb, position_um: tuple[float, float, float]) -> float:
    """Return the value of the voxel whose centre lies at a world position."""
    index = (np.array(position_um) - vdb.offset_um) / vdb.scale_um
    assert np.allclose(index, np.rint(index), atol=1e-4)
    i, j, k = (int(n) for n in np.rint(index))
    return vdb.voxels.get((i, j, k), vdb.background)
