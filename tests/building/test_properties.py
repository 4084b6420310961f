"""Properties that hold for all inputs of a kind: plans, names, bricks, KTX2 and OpenVDB files.

The examples are the same in each run, so that a failure in CI can be repeated here. Tilings, legal
identifiers, min-max bricks and trees are tested beside their modules.
"""

import json
import struct
from pathlib import Path

import numpy as np
import pytest
import zstandard
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from jsonschema import Draft202012Validator

from stereocell.filters.min_max_bricks import mip_levels
from stereocell.formats.brick_stream import content_hash, encode_tree, parse_table
from stereocell.formats.ktx2 import decode_finest, encode_2d, encode_3d
from stereocell.formats.vdb import check_vdb, write_vdb
from stereocell.formats.vdb_read import read_vdb_head
from stereocell.formats.voxel_bvh import build
from stereocell.model.errors import SourceError, UsageError
from stereocell.model.identifiers import from_identifier, to_identifier
from stereocell.planning import settings as settings_module
from stereocell.planning.channels import Channel
from stereocell.planning.plan import Plan, choose_level, make_plan
from stereocell.planning.plan_file import from_json, to_json
from stereocell.read import Level
from stereocell.storage.assets import schema_path
from support.ktx2_parser import parse
from support.sealed_files import seal
from support.server.brick_decoder import decode_brick
from support.vdb_reader import read_vdb, value_at

FEW = settings(
    max_examples=25,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
MANY = settings(FEW, max_examples=60)
PLAN_SCHEMA = Draft202012Validator(json.loads(schema_path("plan.schema.json").read_text("utf-8")))

lengths = st.integers(2, 90)
shapes = st.tuples(st.integers(2, 40), lengths, lengths)
spacings = st.tuples(*[st.floats(0.05, 5.0)] * 3)
# Names of channels have only printable characters, like those that readers return.
names = st.text(min_size=1, max_size=40).filter(str.isprintable)
volumes = npst.arrays(
    np.uint8,
    npst.array_shapes(min_dims=3, max_dims=3, min_side=1, max_side=21),
    elements=st.one_of(st.just(0), st.integers(0, 255)),
)


def cuts() -> st.SearchStrategy[dict[str, object]]:
    """Return settings that cut a region by tile size, by a grid, or by the defaults."""
    return st.one_of(
        st.just({}),
        st.builds(lambda z, y, x: {"tile_size": [z, y, x]}, lengths, lengths, lengths),
        st.builds(lambda c, r: {"grid": f"{c}x{r}"}, st.integers(1, 7), st.integers(1, 7)),
    )


@st.composite
def regions(draw: st.DrawFn, shape: tuple[int, int, int]) -> str:
    """Return a region inside a shape, at least two voxels along each axis, or no region."""
    if draw(st.booleans()):
        return ""
    ends = []
    for n in shape:
        low = draw(st.integers(0, n - 2))
        ends.append(f"{low}:{draw(st.integers(low + 2, n))}")
    return ",".join(ends)


@st.composite
def plans(draw: st.DrawFn) -> Plan:
    shape = draw(shapes)
    wanted = settings_module.load(
        None, None, flags={"plan": {**draw(cuts()), "region": draw(regions(shape))}}
    )
    channels = [
        Channel(index, name, (0.1, 0.2, 0.3))
        for index, name in enumerate(draw(st.lists(names, min_size=1, max_size=3, unique=True)))
    ]
    levels = (Level(shape, draw(spacings)),)
    try:
        chosen = choose_level(levels, len(channels), wanted)
        return make_plan(
            "in.ome.zarr",
            "in",
            fingerprint="ab" * 32,
            levels=levels,
            origin_um=(0.0, 0.0, 0.0),
            channels=channels,
            level=chosen,
            settings=wanted,
            formats=["ome-zarr"],
        )
    except (UsageError, SourceError) as error:  # refused in one line before anything is written
        assert "\n" not in str(error)  # noqa: PT017
        assume(False)
        raise


@pytest.mark.slow
@MANY
@given(plans())
def test_a_plan_covers_its_region_once_and_its_windows_lie_inside(plan: Plan) -> None:
    count = np.zeros(plan.region.stop, int)
    for tile in plan.tiles:
        count[tile.box.slices] += 1
        window = tile.lattice(plan.region).grown(plan.halo, plan.region)
        for own, wide, inner in (
            (tile.box, window, plan.region),
            (tile.lattice(plan.region), window, plan.region),
        ):
            assert all(a >= b for a, b in zip(own.start, wide.start, strict=True))
            assert all(a <= b for a, b in zip(own.stop, wide.stop, strict=True))
            assert all(a >= b for a, b in zip(wide.start, inner.start, strict=True))
            assert all(a <= b for a, b in zip(wide.stop, inner.stop, strict=True))
        # the whole halo is there, except where the data end
        for low, high, own, end, reach, first, last in zip(
            window.start, window.stop, tile.box.start, tile.lattice(plan.region).stop,
            plan.halo, plan.region.start, plan.region.stop, strict=True,
        ):  # fmt: skip
            assert low == max(own - reach, first)
            assert high == min(end + reach, last)
    assert (count[plan.region.slices] == 1).all()
    assert count.sum() == count[plan.region.slices].size


@pytest.mark.slow
@MANY
@given(plans())
def test_a_plan_read_from_its_file_is_the_same(plan: Plan) -> None:
    content = seal(json.loads(json.dumps(to_json(plan))))
    assert list(PLAN_SCHEMA.iter_errors(content)) == []
    assert from_json(content) == plan
    ids = [f"{channel.id}_{tile.id}" for channel in plan.channels for tile in plan.tiles]
    assert len(set(ids)) == len(ids)


@pytest.mark.slow
@MANY
@given(st.lists(st.text(min_size=1, max_size=300), min_size=2, max_size=12, unique=True))
def test_identifiers_are_unique_and_stable_and_fit_a_file_name(texts: list[str]) -> None:
    identifiers = [to_identifier(text) for text in texts]
    # identifiers of names that differ only in case differ, too
    assert len(set(identifiers)) == len(texts)
    for text, identifier in zip(texts, identifiers, strict=True):
        assert to_identifier(text) == identifier
        assert len(f"{identifier}_r999_c999_z999_volume.usdc".encode()) <= 255
        shown = from_identifier(identifier)
        # a shortened name is shown by its beginning
        assert shown == text or text.startswith(shown.removesuffix("\u2026"))
        if shown == text:
            assert to_identifier(shown) == identifier


@FEW
@given(volumes, st.integers(-1, 254))
def test_bricks_of_any_volume_are_the_same_after_packing_and_unpacking(
    volume: np.ndarray[tuple[int, ...], np.dtype[np.uint8]], threshold: int
) -> None:
    bvh = build(volume, threshold)
    data = encode_tree(bvh, content_hash(volume.tobytes()))
    table = parse_table(data)
    assert table.size == volume.shape
    ends = table.bytes + np.cumsum(table.nodes["length"]).astype(int)
    frames = [
        data[end - length : end]
        for end, length in zip(ends.tolist(), table.nodes["length"].tolist(), strict=True)
        if length
    ]
    assert data[table.bytes :] == b"".join(frames)
    unpacked = np.array([decode_brick(frame) for frame in frames])
    np.testing.assert_array_equal(unpacked.reshape(bvh.bricks.shape), bvh.bricks)


@FEW
@given(volumes)
def test_any_volume_is_the_same_after_writing_and_reading_ktx2(
    volume: np.ndarray[tuple[int, ...], np.dtype[np.uint8]],
) -> None:
    levels = mip_levels(volume)
    texture = encode_3d(levels)
    np.testing.assert_array_equal(decode_finest(texture.data)[..., 0], volume)
    header, index, descriptor, key_values = parse(texture.data)
    assert (header["depth"], header["height"], header["width"]) == volume.shape
    assert (header["levels"], header["format"], header["scheme"]) == (len(levels), 9, 2)
    assert struct.unpack_from("<I", descriptor)[0] == len(descriptor)
    assert b"KTXwriter\0" in key_values
    # levels fill the end of the file without a gap, smallest first, and unpack to the input
    end = len(texture.data)
    for level, (offset, length, plain) in zip(levels, index, strict=True):
        assert offset + length == end
        end = offset
        assert plain == level.size
        assert zstandard.decompress(texture.data[offset : offset + length]) == level.tobytes()


@FEW
@given(
    npst.arrays(
        np.uint8,
        st.tuples(st.integers(1, 24), st.integers(1, 24), st.sampled_from([1, 2, 4])),
    )
)
def test_any_table_is_the_same_after_writing_and_reading_ktx2(
    image: np.ndarray[tuple[int, ...], np.dtype[np.uint8]],
) -> None:
    np.testing.assert_array_equal(decode_finest(encode_2d(image).data)[0], image)


@FEW
@given(volumes, st.integers(0, 10_000), st.integers(0, 255))
def test_a_damaged_ktx2_is_refused_or_has_the_same_size(
    volume: np.ndarray[tuple[int, ...], np.dtype[np.uint8]], at: int, value: int
) -> None:
    data = bytearray(encode_3d([volume]).data)
    data[at % len(data)] = value
    try:
        found = decode_finest(bytes(data))
    except SourceError as error:
        assert "\n" not in str(error)  # noqa: PT017
        return
    assert found.size == volume.size


@FEW
@given(volumes, spacings, st.tuples(*[st.floats(-1e4, 1e4)] * 3))
def test_any_volume_is_the_same_after_writing_and_reading_openvdb(
    tmp_path: Path,
    volume: np.ndarray[tuple[int, ...], np.dtype[np.uint8]],
    spacing: tuple[float, float, float],
    first: tuple[float, float, float],
) -> None:
    path = tmp_path / "a.vdb"
    write_vdb(path, volume, first_um=first, spacing_um=spacing)
    check_vdb(path)
    vdb = read_vdb(path)  # the tests' own reader, written after OpenVDB's tables
    assert len(vdb.voxels) == np.count_nonzero(volume)
    (grid,) = read_vdb_head(path)
    assert grid.spacing is not None
    assert tuple(grid.spacing) == vdb.scale_um == spacing[::-1]
    z, y, x = (n - 1 for n in volume.shape)
    for k, j, i in ((0, 0, 0), (z, y, x), (z, 0, x), (0, y, 0)):
        world = (first[2] + i * spacing[2], -(first[1] + j * spacing[1]), first[0] + k * spacing[0])
        assert value_at(vdb, world) == pytest.approx(volume[k, j, i] / 255, abs=2.5e-4)
