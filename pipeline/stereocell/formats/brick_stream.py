"""Bytes of a voxel BVH, on disk and on the wire, and the messages of the websocket `/bricks`.

docs/brick-stream.md describes the protocol and every byte. schemas/brick_stream.schema.json holds
the messages, and the layouts below as data; a test compares them with this module. All numbers are
little-endian.

Each brick is a separate zstd frame. Its name is the first 128 bits of the SHA-256 of that frame. So
a cache of bricks is addressed by content, and the client checks a brick before it unpacks it.
Bricks hold texels, not differences of neighbouring texels, and zstd packs them at its level 3.
Differences along x made them 5 % larger (7 T head, zstd 1 to 9), and zstd's level 9 saved 1 % of
the bytes in six times the time.
"""

import hashlib
import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import zstandard
from jsonschema import Draft202012Validator
from numpy.typing import NDArray

from stereocell.formats.voxel_bvh import EMPTY, STORED, STREAM_BRICK, Bvh
from stereocell.model.errors import StereoCellError
from stereocell.storage.assets import schema_path

VERSION = 1
MAGIC = b"\x89SCBVH\r\n"
HEADER = struct.Struct("<8s2H4B5Ih2xQ16s")
RECORD = np.dtype(
    {
        "names": [
            *("level", "flags", "child_mask", "constant", "x", "y", "z", "min", "max"),
            *("error_max", "error_rms", "length", "hash"),
        ],
        "formats": [*("u1",) * 4, *("<u2",) * 3, *("u1",) * 3, "<f4", "<u4", "V16"],
        "offsets": [0, 1, 2, 3, 4, 6, 8, 10, 11, 12, 16, 20, 24],
        "itemsize": 40,
    }
)
HASH_BYTES = 16
FRAME = struct.Struct("<BBHIII")
ENTRY = struct.Struct("<III")
TABLE_FRAME, BRICKS_FRAME = 1, 2
_ZSTD = 1
_ZSTD_LEVEL = 3
_MAX_TABLE_BYTES = 1 << 28  # largest number of bytes of a table that is read
_LONGEST_FRAME = 1 << 14  # largest number of bytes of a brick's zstd frame; a brick has 18^3 bytes


class BrickFormatError(StereoCellError):
    """Bytes or a message that break the rules of docs/brick-stream.md."""


@dataclass(frozen=True, slots=True)
class Table:
    """A tree without its bricks: header and node records.

    size         texels (z, y, x)
    threshold    largest invisible intensity, 0..254; -1: all texels are visible
    source       first 128 bits of the SHA-256 of the volume's KTX2 file
    nodes        records of RECORD (n,): the fields of voxel_bvh.NODE, and `length` (bytes) and
                 `hash` of the brick's zstd frame, zeros in empty nodes
    brick_bytes  length of all zstd frames of bricks together
    """

    size: tuple[int, int, int]
    threshold: int
    source: bytes
    nodes: NDArray[np.void]
    brick_bytes: int

    @property
    def bytes(self) -> int:
        """Length of the table in bytes. In a file, the bricks begin at this position."""
        return HEADER.size + self.nodes.nbytes


@dataclass(frozen=True, slots=True)
class Part:
    """A piece of a binary frame: bytes of a tree's table, or one brick of a tree.

    tree  number of the tree
    at    table: position of the first of these bytes in it; brick: number of its node
    data  bytes of the table, or the brick's zstd frame
    """

    tree: int
    at: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Frame:
    """A binary message that the server sends: tables or bricks of trees.

    kind      TABLE_FRAME or BRICKS_FRAME
    sequence  number of the frame in the connection
    view      ID that the client gave the view whose bricks the frame holds; 0 for tables
    parts     content, one part after the other
    """

    kind: int
    sequence: int
    view: int
    parts: tuple[Part, ...]


def content_hash(data: bytes) -> bytes:
    """Return the first 128 bits of the SHA-256 of `data`."""
    return hashlib.sha256(data).digest()[:HASH_BYTES]


def encode_tree(bvh: Bvh, source: bytes) -> bytes:
    """Return a tree as the content of a file: header, node records, bricks in the nodes' order.

    source  first 128 bits of the SHA-256 of the volume's KTX2 file
    """
    compressor = zstandard.ZstdCompressor(level=_ZSTD_LEVEL, write_content_size=True)
    frames = [compressor.compress(brick.tobytes()) for brick in bvh.bricks]
    nodes = np.zeros(len(bvh.nodes), dtype=RECORD)
    for name in bvh.nodes.dtype.names or ():
        nodes[name] = bvh.nodes[name]
    stored = np.flatnonzero((nodes["flags"] & EMPTY) == 0)
    nodes["length"][stored] = [len(frame) for frame in frames]
    nodes["hash"][stored] = np.array([content_hash(frame) for frame in frames], dtype="V16")
    z, y, x = bvh.size
    header = HEADER.pack(
        MAGIC,
        VERSION,
        HEADER.size,
        STREAM_BRICK,
        (STORED - STREAM_BRICK) // 2,
        int(nodes["level"][0]) + 1,
        _ZSTD,
        x,
        y,
        z,
        len(nodes),
        len(frames),
        bvh.threshold,
        sum(map(len, frames)),
        source,
    )
    return b"".join([header, nodes.tobytes(), *frames])


def parse_table(data: bytes) -> Table:
    """Return the tree at the start of `data`; bricks may follow it.

    Raises BrickFormatError for any value that would break a client or a server.
    """
    if len(data) < HEADER.size:
        raise BrickFormatError(f"a tree of {len(data)} bytes, expected {HEADER.size} or more")
    magic, version, header_bytes, brick, apron, levels, codec, *rest = HEADER.unpack_from(data)
    x, y, z, count, stored, threshold, brick_bytes, source = rest
    if magic != MAGIC:
        raise BrickFormatError(f"magic is {magic!r}, expected {MAGIC!r}")
    layout = (version, header_bytes, brick, apron, codec)
    expected = (VERSION, HEADER.size, STREAM_BRICK, 1, _ZSTD)
    if layout != expected:
        raise BrickFormatError(
            f"version, header, brick, apron, codec are {layout}, expected {expected}"
        )
    end = HEADER.size + count * RECORD.itemsize
    if count == 0 or end > min(len(data), _MAX_TABLE_BYTES):
        raise BrickFormatError(f"{count} nodes in {len(data)} bytes")
    if not 0 < levels <= 16 or not all(0 < n <= STREAM_BRICK << levels - 1 for n in (x, y, z)):
        raise BrickFormatError(f"{x} x {y} x {z} texels in {levels} levels")
    nodes = np.frombuffer(data, dtype=RECORD, count=count, offset=HEADER.size)
    _check_nodes(nodes, levels, stored, brick_bytes)
    return Table((z, y, x), threshold, source, nodes, brick_bytes)


def _check_nodes(nodes: NDArray[np.void], levels: int, stored: int, brick_bytes: int) -> None:
    is_empty = (nodes["flags"] & EMPTY) != 0
    counts = np.bitwise_count(nodes["child_mask"])
    parents = np.repeat(np.arange(len(nodes)), counts)
    faults = {
        "flags": nodes["flags"] > EMPTY,
        "child_mask": (counts > 0) != (~is_empty & (nodes["level"] > 0)),
        "length": is_empty != (nodes["length"] == 0),
        "length of a frame": nodes["length"] > _LONGEST_FRAME,
        "min": nodes["min"] > nodes["max"],
        "error_rms": ~(nodes["error_rms"] >= 0),
    }
    for name, fault in faults.items():
        if fault.any():
            raise BrickFormatError(f"node {fault.argmax()}: {name} is out of its range")
    if len(parents) != len(nodes) - 1 or (parents >= np.arange(1, len(nodes))).any():
        raise BrickFormatError(f"{len(parents)} children in a tree of {len(nodes)} nodes")
    bits = np.unpackbits(nodes["child_mask"][:, np.newaxis], axis=1, bitorder="little")
    octant = np.nonzero(bits)[1]
    child, parent = nodes[1:], nodes[parents]
    fits = child["level"] + 1 == parent["level"]
    for shift, axis in enumerate("xyz"):
        fits &= child[axis] == 2 * parent[axis].astype(np.int64) + (octant >> shift & 1)
    root = nodes[0]
    if root["level"] != levels - 1 or root["x"] or root["y"] or root["z"] or not fits.all():
        raise BrickFormatError("nodes lie outside of the places that their parents state")
    if np.count_nonzero(~is_empty) != stored or int(nodes["length"].sum()) != brick_bytes:
        raise BrickFormatError("bricks do not add up to the numbers in the header")


def encode_frame(frame: Frame) -> bytes:
    """Return the bytes of a binary frame; a table's `data` is passed uncompressed."""
    datas, lengths = [], []
    for part in frame.parts:
        is_table = frame.kind == TABLE_FRAME
        datas.append(zstandard.compress(part.data, _ZSTD_LEVEL) if is_table else part.data)
        lengths.append(len(datas[-1]))
    head = FRAME.pack(frame.kind, VERSION, 0, frame.sequence, frame.view, len(frame.parts))
    entries = [
        ENTRY.pack(part.tree, part.at, n) for part, n in zip(frame.parts, lengths, strict=True)
    ]
    return b"".join([head, *entries, *datas])


def parse_message(text: str) -> dict[str, Any]:
    """Return a client's message that matches its schema.

    Raises BrickFormatError for other text, with an error of one line.
    """
    try:
        message = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise BrickFormatError(f"not JSON: {_short(str(error))}") from None
    if not isinstance(message, dict):
        raise BrickFormatError("not a JSON object")
    kind = message.get("type")
    validators = _validators()
    if not isinstance(kind, str) or kind not in validators:
        raise BrickFormatError(f"type: expected one of {', '.join(validators)}")
    # Only the first fault is found, since finding all faults of a long message would take seconds.
    fault = next(validators[kind].iter_errors(message), None)
    if fault is not None:
        where = _short(f"{fault.json_path}: {fault.validator}")
        raise BrickFormatError(f"{kind}: {where} does not match the schema")
    return message


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is not a JSON number")


def _short(text: str) -> str:
    return text if len(text) <= 60 else f"{text[:60]}..."


@cache
def _validators() -> dict[str, Draft202012Validator]:
    schema = json.loads(schema_path("brick_stream.schema.json").read_bytes())
    return {
        name: Draft202012Validator({"$defs": schema["$defs"], "$ref": ref})
        for name, ref in _kinds(schema["$defs"]["ClientMessage"]["oneOf"])
    }


def _kinds(references: Sequence[dict[str, str]]) -> list[tuple[str, str]]:
    return [(ref["$ref"].rsplit("/", 1)[1].lower(), ref["$ref"]) for ref in references]
