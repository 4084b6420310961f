"""Bytes of trees and frames, written by hand; messages; and errors for faulty ones."""

import hashlib
import json
import struct
import time

import numpy as np
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st

from stereocell.formats.brick_stream import (
    BRICKS_FRAME,
    ENTRY,
    FRAME,
    HEADER,
    RECORD,
    TABLE_FRAME,
    BrickFormatError,
    Frame,
    Part,
    encode_frame,
    encode_tree,
    parse_message,
    parse_table,
)
from stereocell.formats.voxel_bvh import NODE, build
from stereocell.storage.assets import schema_path
from support.server.brick_bundles import phantom
from support.server.brick_decoder import decode_brick, decode_frame, reassemble

SOURCE = bytes(range(16))
SCHEMA = json.loads(schema_path("brick_stream.schema.json").read_text("utf-8"))

# A volume of 20 x 3 x 2 texels with threshold 40. The first 15 texels along x are 200, the last 5
# are 7. The tree is a root of level 1, a leaf, and an empty node, because its apron, texel 15, is 7
# too. Root texels along x are seven of 200, then (200 + 7) / 2 = 103.5 -> 104, two of 7, and 7
# beyond the end. Interpolated at texels 13 to 16 (at 1/4 and 3/4) they give 176, 128, 79.75, 31.25,
# where the true values are 200, 200, 7, 7.
HEADER_HEX = """
89 53 43 42 56 48 0d 0a  01 00  40 00  10 01 02 01
14 00 00 00  03 00 00 00  02 00 00 00  03 00 00 00  02 00 00 00
28 00  00 00
"""
ROOT_HEX = "01 00 03 98  00 00 00 00 00 00  07 c8 49 00 00 00"  # mean 151.75, error_max 73
LEAF_HEX = "00 00 00 bc  00 00 00 00 00 00  07 c8 00 00 00 00"
EMPTY_HEX = "00 01 00 07  01 00 00 00 00 00  07 07 00 00 00 00"


def by_hand():
    """Return the volume, the bytes of its tree, and the frames of its bricks."""
    volume = np.full((2, 3, 20), 7, np.uint8)
    volume[..., :15] = 200
    root, leaf = (np.full((18, 18, 18), 7, np.uint8) for _ in range(2))
    root[..., :8] = 200  # the apron repeats the first texel
    root[..., 8] = 104
    leaf[..., :16] = 200
    compress = zstandard.ZstdCompressor(level=3).compress
    frames = [compress(brick.tobytes()) for brick in (root, leaf)]
    rms = np.sqrt((24**2 + 72**2 + 72.75**2 + 24.25**2) / 20)
    records = []
    for text, frame, error in zip(
        (ROOT_HEX, LEAF_HEX, EMPTY_HEX), (*frames, b""), (rms, 0, 0), strict=True
    ):
        digest = hashlib.sha256(frame).digest()[:16] if frame else bytes(16)
        records.append(bytes.fromhex(text) + struct.pack("<fI", error, len(frame)) + digest)
    total = struct.pack("<Q", sum(map(len, frames)))
    return volume, bytes.fromhex(HEADER_HEX) + total + SOURCE + b"".join(records), frames


def test_a_tree_has_the_bytes_that_were_written_by_hand():
    volume, table, frames = by_hand()
    assert encode_tree(build(volume, 40), SOURCE) == table + b"".join(frames)


def test_a_table_written_by_hand_is_read():
    _, data, frames = by_hand()
    table = parse_table(data)
    assert (table.size, table.threshold, table.source) == ((2, 3, 20), 40, SOURCE)
    assert table.bytes == len(data) == 64 + 3 * 40
    assert table.brick_bytes == sum(map(len, frames))
    assert table.nodes["level"].tolist() == [1, 0, 0]
    assert table.nodes["error_max"].tolist() == [73, 0, 0]
    assert table.nodes["x"].tolist() == [0, 0, 1]
    assert [n["hash"].tobytes() for n in table.nodes][:2] == [
        hashlib.sha256(f).digest()[:16] for f in frames
    ]


def test_frames_have_the_bytes_that_were_written_by_hand():
    expected = "02 01 0000 07000000 09000000 02000000"
    expected += "03000000 05000000 02000000  00000000 01010000 01000000  aabb cc"
    parts = (Part(3, 5, b"\xaa\xbb"), Part(0, 257, b"\xcc"))
    data = encode_frame(Frame(BRICKS_FRAME, 7, 9, parts))
    assert data == bytes.fromhex(expected)
    assert decode_frame(data) == Frame(BRICKS_FRAME, 7, 9, parts)


def test_a_tables_part_is_one_zstd_frame():
    data = encode_frame(Frame(TABLE_FRAME, 1, 0, (Part(2, 4096, b"abc" * 100),)))
    assert data[:16] == bytes.fromhex("01 01 0000 01000000 00000000 01000000")
    tree, at, length = struct.unpack_from("<III", data, 16)
    assert (tree, at, length) == (2, 4096, len(data) - 28)
    assert zstandard.decompress(data[28:]) == b"abc" * 100


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("header", HEADER.size),
        ("node", RECORD.itemsize),
        ("frame", FRAME.size),
        ("part", ENTRY.size),
    ],
)
def test_the_layouts_in_the_schema_cover_every_byte(name, size):
    layout = SCHEMA["x-layout"][name]
    at = 0
    for item in layout["fields"]:
        assert item["offset"] == at
        at += int(item["type"][1:]) // 8 * item.get("count", 1)
    assert at == layout["bytes"] == size


def test_the_node_in_the_schema_is_the_written_record():
    fields = {f["name"]: f for f in SCHEMA["x-layout"]["node"]["fields"]}
    for name in RECORD.names:
        kind, offset = RECORD.fields[name]
        assert fields[name]["offset"] == offset
        assert int(fields[name]["type"][1:]) // 8 * fields[name].get("count", 1) == kind.itemsize
    assert set(fields) == {*RECORD.names, "reserved"}
    assert set(RECORD.names) == {*NODE.names, "length", "hash"}


def test_a_tree_is_read_back_from_its_bytes():
    volume = phantom()
    bvh = build(volume, 20)
    data = encode_tree(bvh, SOURCE)
    table = parse_table(data)
    for name in NODE.names:
        np.testing.assert_array_equal(table.nodes[name], bvh.nodes[name])
    at, bricks = table.bytes, []
    for length in table.nodes["length"][table.nodes["length"] > 0].tolist():
        bricks.append(decode_brick(data[at : at + length]))
        at += length
    assert at == len(data)
    again = type(bvh)(table.size, table.threshold, table.nodes, np.array(bricks))
    np.testing.assert_array_equal(reassemble(again), reassemble(bvh))


def test_the_same_volume_gives_the_same_bytes():
    volume = phantom()
    assert encode_tree(build(volume, 9), SOURCE) == encode_tree(build(volume.copy(), 9), SOURCE)


@pytest.mark.slow
@settings(max_examples=400, deadline=None)
@given(st.integers(0, 183), st.integers(0, 255))
def test_a_damaged_byte_is_refused_or_changes_no_structure(at, value):
    _, data, _ = by_hand()
    damaged = bytearray(data)
    damaged[at] = value
    try:
        table = parse_table(bytes(damaged))
    except BrickFormatError:
        return
    assert table.nodes["child_mask"].tolist() == [3, 0, 0]
    assert table.nodes["level"].tolist() == [1, 0, 0]
    assert table.nodes["x"].tolist() == [0, 0, 1]


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused_in_one_line(data):
    for read in (parse_table, decode_frame, decode_brick):
        for given_ in (data, by_hand()[1][:64] + data, b"\x02\x01\0\0" + data, b"\x01\x01" + data):
            try:
                read(given_)
            except BrickFormatError as error:
                assert "\n" not in str(error)  # noqa: PT017


VIEW = {
    "type": "view",
    "id": 1,
    "trees": [0],
    "clip": [float(i) for i in range(16)],
    "eye": [0, 0, 1],
    "gaze": [0, 0, -1],
    "pixels_per_radian": 500,
    "texel_px": 1,
    "budget": 1000,
}


@pytest.mark.parametrize(
    "message",
    [
        {"type": "hello", "version": 1},
        {"type": "hello", "version": 1, "window": 65536},
        {"type": "open", "volumes": [{"tile": "r0_c0", "channel": "CD31", "table": "0" * 32}]},
        {"type": "have", "tree": 0, "nodes": "AQ=="},
        VIEW,
        {**VIEW, "error_grey": 2.5},
        {"type": "cancel", "id": 3},
        {"type": "ack", "sequence": 1},
    ],
)
def test_messages_from_the_documentation_are_accepted(message):
    assert parse_message(json.dumps(message)) == message


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "not JSON"),
        ("[" * 60000, "not JSON"),
        ("1" * 5000, "not JSON"),
        ("[]", "not a JSON object"),
        ("{}", "type: expected one of hello, open"),
        ('{"type": ["view"]}', "type: expected one of"),
        ('{"type": "bye"}', "type: expected one of"),
        ('{"type": "ack", "sequence": NaN}', "NaN is not a JSON number"),
        ('{"type": "ack", "sequence": 0}', r"ack: \$.sequence: minimum"),
        ('{"type": "ack", "sequence": 1, "x": 0}', r"ack: \$: additionalProperties"),
        ('{"type": "cancel"}', r"cancel: \$: required"),
        (json.dumps({**VIEW, "clip": [0] * 15}), r"view: \$.clip: minItems"),
        (json.dumps({**VIEW, "eye": [0, 0, 1e300]}), r"view: \$.eye\[2\]: maximum"),
        (json.dumps({**VIEW, "eye": [0, 0, 10**400]}), r"view: \$.eye\[2\]: maximum"),
        (json.dumps({**VIEW, "trees": [0] * 65}), "maxItems"),
        (json.dumps({**VIEW, "budget": -1}), "minimum"),
    ],
)
def test_other_messages_are_refused_in_one_line(text, expected):
    with pytest.raises(BrickFormatError, match=expected) as error:
        parse_message(text)
    assert len(str(error.value)) < 200
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "hostile",
    [
        {**VIEW, "trees": [{"a": i} for i in range(5000)]},
        {**VIEW, "clip": [[]] * 15000},
        {**VIEW, "eye": [[[[0] * 30] * 30] * 5] * 3},
        {"type": "open", "volumes": [{}] * 15000},
        {"type": "have", "tree": 0, "nodes": "=" * 60000},
        {"type": "hello", **{f"k{i}": 0 for i in range(5000)}},
    ],
)
def test_every_message_of_allowed_length_is_refused_quickly(hostile):
    text = json.dumps(hostile)
    assert len(text) < 1 << 16
    start = time.process_time()
    with pytest.raises(BrickFormatError):
        parse_message(text)
    assert time.process_time() - start < 0.5
