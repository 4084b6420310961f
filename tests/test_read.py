"""Readers against files written by zarr and tifffile directly."""

import re
import shutil
from collections.abc import Callable
from itertools import permutations
from pathlib import Path
from typing import Any

import fsspec
import numpy as np
import pytest
import tifffile
import tifffile.zarr
from numpy.typing import NDArray

from conftest import Server
from phantoms import UNITS, f_phantom, write_ome_tiff, write_ome_zarr
from stereocell import read
from stereocell.errors import SourceError, UsageError
from stereocell.read.fingerprint import BUDGET_BYTES
from stereocell.tiling import Box

BOX = Box((1, 3, 5), (4, 30, 21))
FORMATS = ("tiny_zarr_04", "tiny_zarr_05", "tiny_tiff")


def in_order(czyx: NDArray[Any], axes: str) -> NDArray[Any]:
    """Move (c, z, y, x) into another order of axes; `t` becomes an axis of length 1."""
    return np.moveaxis(czyx[None], range(5), ["tczyx".index(a) for a in "tczyx"]).transpose(
        ["tczyx".index(axis) for axis in axes]
    )


@pytest.mark.parametrize("fixture", FORMATS)
def test_metadata_and_voxels_are_those_written(
    fixture: str, request: pytest.FixtureRequest, voxels: NDArray[np.uint16]
) -> None:
    dataset = read.open(request.getfixturevalue(fixture))
    assert dataset.name == fixture.replace("_zarr_", "").replace("_tiff", "")
    assert dataset.dtype == np.uint16
    assert [level.shape for level in dataset.levels] == [(6, 40, 56), (6, 20, 28)]
    assert dataset.levels[0].spacing_um == pytest.approx((0.5, 0.2, 0.2))
    assert dataset.levels[1].spacing_um == pytest.approx((0.5, 0.4, 0.4))
    assert [channel.name for channel in dataset.channels] == ["Hoechst", "CD31"]
    assert dataset.channels[0].color == (0.0, 0.0, 1.0)
    assert dataset.channels[1].color == pytest.approx((0.0, 1.0, 0.2158605), abs=1e-6)  # linear
    assert dataset.has_channel_names
    assert (dataset.time_points, dataset.images) == (1, 1)
    for channel in (0, 1):
        volume = dataset.read(channel, BOX)
        np.testing.assert_array_equal(volume.voxels, voxels[channel][BOX.slices])
        assert volume.voxels.dtype == np.uint16
        assert volume.spacing_um == pytest.approx((0.5, 0.2, 0.2))
        assert volume.origin_um == pytest.approx((0.5, 0.6, 1.0))
    coarse = dataset.read(1, Box((0, 2, 4), (6, 20, 28)), level=1)
    np.testing.assert_array_equal(coarse.voxels, voxels[1, :, 4::2, 8::2])
    # A coarse voxel stands for a block of fine ones, so its centre lies half a fine voxel further.
    assert coarse.origin_um == pytest.approx((0.0, 2 * 0.4 + 0.1, 4 * 0.4 + 0.1))


ZARR_AXES = ["zyx", "xyz", "yxz", "czyx", "cxyz", "tczyx", "tcyzx", "tzyx", "zcyx"]


@pytest.mark.parametrize("version", ["0.4", "0.5"])
@pytest.mark.parametrize("axes", ZARR_AXES)
def test_zarr_axes_in_any_order_give_the_same_f(tmp_path: Path, axes: str, version: str) -> None:
    body = f_phantom()
    stored = in_order(np.stack([body, body]) if "c" in axes else body[None], "tczyx")
    stored = stored.transpose(
        ["tczyx".index(a) for a in axes] + ["tczyx".index(a) for a in "tczyx" if a not in axes]
    )
    stored = stored.reshape(stored.shape[: len(axes)])
    path = write_ome_zarr(tmp_path / "f.zarr", [stored], axes=axes, version=version)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx((0.5, 0.2, 0.2))
    volume = dataset.read(len(dataset.channels) - 1, dataset.levels[0].box)
    np.testing.assert_array_equal(volume.voxels, body)


@pytest.mark.parametrize("order", ["".join(p) for p in permutations("TCZ")])
def test_tiff_planes_in_any_order_give_the_same_f(tmp_path: Path, order: str) -> None:
    body = f_phantom()
    tczyx = np.stack([np.stack([body * (1 + t) + c for c in range(2)]) for t in range(3)])
    stored = tczyx.transpose(["TCZYX".index(axis) for axis in order + "YX"])
    path = write_ome_tiff(tmp_path / "f.ome.tif", stored, axes=order + "YX")
    dataset = read.open(path, time=2)
    assert dataset.time_points == 3
    volume = dataset.read(1, dataset.levels[0].box)
    np.testing.assert_array_equal(volume.voxels, tczyx[2, 1])


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32", ">u2", ">f4"])
@pytest.mark.parametrize("suffix", [".zarr", ".ome.tif"])
def test_dtypes_are_kept_in_native_order(tmp_path: Path, dtype: str, suffix: str) -> None:
    body = (f_phantom() // 4).astype(dtype)
    path = tmp_path / f"f{suffix}"
    if suffix == ".zarr":
        write_ome_zarr(path, [body], version="0.4")
    else:
        tifffile.imwrite(
            path,
            body,
            byteorder=">" if dtype[0] == ">" else None,
            ome=True,
            metadata={"axes": "ZYX", "PhysicalSizeZ": 1, "PhysicalSizeY": 1, "PhysicalSizeX": 1},
        )
    dataset = read.open(path)
    volume = dataset.read(0, dataset.levels[0].box)
    assert dataset.dtype == np.dtype(dtype).newbyteorder("=")
    assert volume.voxels.dtype == np.dtype(dtype).newbyteorder("=")
    np.testing.assert_array_equal(volume.voxels, body)


@pytest.mark.parametrize(
    ("unit", "um"),
    [
        ("nanometer", 1e-3),
        ("micrometer", 1.0),
        ("millimeter", 1e3),
        ("meter", 1e6),
        ("inch", 25400),
    ],
)
def test_zarr_units_become_um(tmp_path: Path, unit: str, um: float) -> None:
    path = write_ome_zarr(tmp_path / "f.zarr", [f_phantom()], units=dict.fromkeys("zyx", unit))
    assert read.open(path).levels[0].spacing_um == pytest.approx((0.5 * um, 0.2 * um, 0.2 * um))


@pytest.mark.parametrize(("unit", "um"), [("nm", 1e-3), ("\u00b5m", 1.0), ("mm", 1e3), ("m", 1e6)])
def test_tiff_units_become_um(tmp_path: Path, unit: str, um: float) -> None:
    path = write_ome_tiff(tmp_path / "f.ome.tif", f_phantom(), unit=unit)
    assert read.open(path).levels[0].spacing_um == pytest.approx((0.5 * um, 0.2 * um, 0.2 * um))


def test_all_transformations_are_composed_and_a_translation_places_the_level(
    tmp_path: Path,
) -> None:
    body = f_phantom()
    path = write_ome_zarr(
        tmp_path / "f.zarr",
        [body, body[:, ::4, ::4]],
        scales=[{"z": 1, "y": 0.1, "x": 0.1}, {"z": 1, "y": 0.4, "x": 0.4}],
        translations=[{"z": 3, "y": 5, "x": 7}, {"z": 3, "y": 5.2, "x": 7.1}],
        image_transformations=[{"type": "scale", "scale": [2.0, 2.0, 2.0]}],
    )
    fine, coarse = read.open(path).levels
    assert fine.spacing_um == pytest.approx((2.0, 0.2, 0.2))
    assert fine.origin_um == (0.0, 0.0, 0.0)
    assert coarse.spacing_um == pytest.approx((2.0, 0.8, 0.8))
    assert coarse.origin_um == pytest.approx((0.0, 0.4, 0.2))
    # A given spacing stretches the levels and their places alike.
    coarse = read.open(path, spacing_um=(4.0, 1.0, 1.0)).levels[1]
    assert coarse.spacing_um == pytest.approx((4.0, 4.0, 4.0))
    assert coarse.origin_um == pytest.approx((0.0, 2.0, 1.0))


def test_odd_sizes_halve_to_a_whole_factor(tmp_path: Path) -> None:
    path = write_ome_tiff(tmp_path / "f.ome.tif", np.ones((3, 41, 57), np.uint8), levels=3)
    levels = read.open(path).levels
    assert [level.shape for level in levels] == [(3, 41, 57), (3, 21, 29), (3, 11, 15)]
    assert levels[2].spacing_um == pytest.approx((0.5, 0.8, 0.8))


@pytest.mark.parametrize("suffix", [".zarr", ".ome.tif"])
def test_a_given_spacing_stands_in_for_a_missing_one(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"f{suffix}"
    if suffix == ".zarr":
        write_ome_zarr(path, [f_phantom()], units={})
    else:
        write_ome_tiff(path, f_phantom(), spacing=None)
    with pytest.raises(SourceError, match=r"voxel size: not found .* --spacing-um z,y,x"):
        read.open(path)
    assert read.open(path, spacing_um=(3.0, 1.0, 2.0)).levels[0].spacing_um == (3.0, 1.0, 2.0)


@pytest.mark.parametrize("bad", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, float("nan"))])
def test_a_given_spacing_must_be_a_length(tiny_tiff: Path, bad: tuple[float, float, float]) -> None:
    with pytest.raises(UsageError, match=r"--spacing-um: found .*, expected z,y,x in um"):
        read.open(tiny_tiff, spacing_um=bad)


def test_channels_are_found_by_name_and_by_index(tiny_zarr_05: Path) -> None:
    dataset = read.open(tiny_zarr_05)
    assert dataset.find_channels(["CD31", "0"]) == (1, 0)
    assert dataset.find_channels(["1", "CD31"]) == (1,)
    with pytest.raises(SourceError, match=r"'cd-31'.*did you mean 'CD31'.*Hoechst, CD31"):
        dataset.find_channels(["cd-31"])
    with pytest.raises(SourceError, match=r"'2': not found, expected an index from 0 to 1"):
        dataset.find_channels(["2"])


@pytest.mark.parametrize("suffix", [".zarr", ".ome.tif"])
def test_missing_names_matter_only_where_channels_are_named(
    tmp_path: Path, voxels: NDArray[np.uint16], suffix: str
) -> None:
    path = tmp_path / f"f{suffix}"
    if suffix == ".zarr":
        write_ome_zarr(path, [voxels], axes="czyx")
    else:
        write_ome_tiff(path, voxels, axes="CZYX")
    dataset = read.open(path)
    assert [channel.name for channel in dataset.channels] == ["Channel0", "Channel1"]
    assert [channel.color for channel in dataset.channels] == [None, None]
    assert not dataset.has_channel_names
    assert dataset.find_channels(["1"]) == (1,)
    with pytest.raises(SourceError, match="no channel names, expected an index from 0 to 1"):
        dataset.find_channels(["Channel0"])


def test_equal_names_are_told_apart(tmp_path: Path) -> None:
    stack = np.zeros((3, 2, 8, 8), np.uint8)
    channels = [{"label": "DNA"}, {"label": "CD8"}, {"label": "DNA"}]
    path = write_ome_zarr(tmp_path / "c.zarr", [stack], axes="czyx", channels=channels)
    names = [channel.name for channel in read.open(path).channels]
    assert names == ["DNA (channel 0)", "CD8", "DNA (channel 2)"]


@pytest.mark.parametrize("fixture", FORMATS)
def test_a_window_out_of_range_is_a_bug(fixture: str, request: pytest.FixtureRequest) -> None:
    dataset = read.open(request.getfixturevalue(fixture))
    for channel, box, level in (
        (2, BOX, 0),
        (0, BOX, 2),
        (0, Box((0, 0, 0), (7, 1, 1)), 0),
        (0, Box((-1, 0, 0), (1, 1, 1)), 0),
        (0, Box((1, 1, 1), (1, 2, 2)), 0),
    ):
        with pytest.raises(ValueError, match=r"doesn't exist|leaves level"):
            dataset.read(channel, box, level)


# Laziness: chunks are (2, 16, 16) in the fixtures.


@pytest.mark.parametrize("fixture", ["tiny_zarr_04", "tiny_zarr_05"])
def test_only_the_chunks_that_a_box_touches_are_read(
    fixture: str, request: pytest.FixtureRequest, serve: Callable[[Path], Server]
) -> None:
    path: Path = request.getfixturevalue(fixture)
    server = serve(path.parent)
    dataset = read.open(f"{server.url}/{path.name}")
    chunks = f"/{path.name}/0/1/" if fixture == "tiny_zarr_04" else f"/{path.name}/0/c/1/"
    assert server.gets(f"/{path.name}/0/c/") + server.gets(f"/{path.name}/0/0/") == []
    dataset.read(1, Box((2, 16, 0), (4, 32, 17)))
    assert sorted(server.gets(chunks)) == [f"{chunks}1/1/0", f"{chunks}1/1/1"]


def test_only_the_tiles_that_a_box_touches_are_decoded(
    tiny_tiff: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    decoded = []
    original = tifffile.zarr.ZarrTiffStore.get

    async def counting(store: Any, key: str, *args: Any, **kwargs: Any) -> Any:
        if not key.endswith((".zarray", ".zattrs", "zarr.json")):
            decoded.append(key)
        return await original(store, key, *args, **kwargs)

    monkeypatch.setattr(tifffile.zarr.ZarrTiffStore, "get", counting)
    dataset = read.open(tiny_tiff)
    assert decoded == []
    dataset.read(1, Box((2, 16, 0), (4, 32, 17)))
    # c, z, y, x of the tiles; the key's spelling is the store's own (Zarr v2 or v3)
    tiles = {tuple(int(n) for n in re.findall(r"\d+", key))[:4] for key in decoded}
    assert tiles == {(1, 2, 1, 0), (1, 2, 1, 1), (1, 3, 1, 0), (1, 3, 1, 1)}
    assert len(decoded) == 4


# Addresses


@pytest.mark.parametrize("fixture", FORMATS)
def test_http_gives_what_the_disk_gives(
    fixture: str, request: pytest.FixtureRequest, serve: Callable[[Path], Server]
) -> None:
    path: Path = request.getfixturevalue(fixture)
    local = read.open(path)
    remote = read.open(f"{serve(path.parent).url}/{path.name}")
    assert remote.name == local.name
    assert remote.fingerprint == local.fingerprint
    np.testing.assert_array_equal(remote.read(1, BOX).voxels, local.read(1, BOX).voxels)


def test_a_remote_window_doesnt_fetch_the_whole_tiff(
    tmp_path: Path, serve: Callable[[Path], Server]
) -> None:
    noise = np.random.default_rng(0).integers(0, 65535, (8, 1024, 1024), np.uint16)
    path = write_ome_tiff(tmp_path / "n.ome.tif", noise, tile=(128, 128), compression=None)
    server = serve(tmp_path)
    dataset = read.open(f"{server.url}/{path.name}")
    server.requests.clear()
    dataset.read(0, Box((4, 512, 512), (6, 640, 640)))
    ranges = [
        r.removeprefix("bytes=").split("-") for m, _, r in server.requests if m == "GET" and r
    ]
    fetched = sum(int(last) - int(first) + 1 for first, last in ranges)
    assert 2 * 128 * 128 * 2 <= fetched < path.stat().st_size / 8


@pytest.mark.parametrize("fixture", FORMATS)
def test_s3_gives_what_the_disk_gives(
    fixture: str, request: pytest.FixtureRequest, s3_bucket: Path
) -> None:
    path: Path = request.getfixturevalue(fixture)
    if path.is_dir():
        shutil.copytree(path, s3_bucket / path.name)
    else:
        shutil.copy(path, s3_bucket)
    remote = read.open(f"s3://bucket/{path.name}")
    local = read.open(path)
    np.testing.assert_array_equal(remote.read(1, BOX).voxels, local.read(1, BOX).voxels)
    assert remote.fingerprint == local.fingerprint


@pytest.mark.parametrize("fixture", FORMATS)
def test_any_address_that_fsspec_knows_works(fixture: str, request: pytest.FixtureRequest) -> None:
    path: Path = request.getfixturevalue(fixture)
    memory = fsspec.filesystem("memory")
    memory.put(str(path), f"/{path.name}", recursive=True)
    try:
        remote = read.open(f"memory://{path.name}")
        np.testing.assert_array_equal(
            remote.read(1, BOX).voxels, read.open(path).read(1, BOX).voxels
        )
    finally:
        memory.rm(f"/{path.name}", recursive=True)


def test_secrets_in_an_address_are_not_shown() -> None:
    with pytest.raises(SourceError) as caught:
        read.open("http://user:hunter2@127.0.0.1:9/a.ome.tif?signature=abc")
    assert "127.0.0.1:9/a.ome.tif" in str(caught.value)
    assert "hunter2" not in str(caught.value)
    assert "signature" not in str(caught.value)


# Fingerprints


def test_fingerprint_ignores_path_and_chunks_of_a_copy(tiny_zarr_05: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(tiny_zarr_05, tmp_path / "elsewhere" / "other.ome.zarr")
    assert read.open(copy).fingerprint == read.open(tiny_zarr_05).fingerprint


def test_fingerprint_sees_a_voxel_a_name_a_spacing(
    tmp_path: Path, voxels: NDArray[np.uint16]
) -> None:
    def of(voxels: NDArray[np.uint16], label: str = "A", **options: Any) -> str:
        channels = [{"label": label}, {"label": "B"}]
        path = tmp_path / "v.zarr"
        write_ome_zarr(path, [voxels], axes="czyx", channels=channels)
        return read.open(path, **options).fingerprint

    changed = voxels.copy()
    changed[1, 5, 39, 55] += 1
    same = of(voxels)
    assert of(voxels) == same
    assert len({same, of(changed), of(voxels, "C"), of(voxels, spacing_um=(1.0, 1.0, 1.0))}) == 4


def test_fingerprint_reads_a_bounded_part(tmp_path: Path) -> None:
    # 240 MB by its header; chunks that were never written are zeros and cost nothing here.
    import zarr

    path = write_ome_zarr(tmp_path / "v.zarr", [np.zeros((4, 8, 8), np.uint8)])
    zarr.create_array(
        str(path / "0"),
        shape=(60, 2000, 2000),
        chunks=(10, 500, 500),
        dtype="uint8",
        overwrite=True,
    )
    dataset = read.open(path)
    taken = []
    window = type(dataset.arrays[0]).window

    def counting(array: Any, time: int, channel: int, box: Box) -> Any:
        taken.append(int(np.prod(box.shape)))
        return window(array, time, channel, box)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(dataset.arrays[0]), "window", counting)
        first = dataset.fingerprint
    assert 0.9 * BUDGET_BYTES < sum(taken) <= BUDGET_BYTES
    assert read.open(path).fingerprint == first


def test_absent_chunks_are_the_fill_value(tiny_zarr_05: Path) -> None:
    (tiny_zarr_05 / "0/c/0/0/0/0").unlink()
    volume = read.open(tiny_zarr_05).read(0, Box((0, 0, 0), (2, 16, 17)))
    assert not volume.voxels[:, :, :16].any()
    assert volume.voxels[:, :, 16].all()


def test_pages_of_a_file_are_closed(tiny_tiff: Path) -> None:
    dataset = read.open(tiny_tiff)
    assert dataset.on_close is not None
    dataset.on_close()
    del dataset  # a second close does no harm; an open file would be a ResourceWarning


def test_unused_units_of_time_and_channel_do_no_harm(tmp_path: Path) -> None:
    stack = np.stack([f_phantom()] * 2)
    path = write_ome_zarr(tmp_path / "t.zarr", [stack], axes="tzyx", units=UNITS)
    assert read.open(path, time=1).time == 1
