"""The chunks that a window fetches from a disk, http, S3 or any other address of fsspec."""

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fsspec
import numpy as np
import pytest
import tifffile
import tifffile.zarr

from conftest import Server
from stereocell import read
from stereocell.model.errors import SourceError, UsageError
from stereocell.model.tiling import Box
from stereocell.read.source_place import require_apart
from stereocell.storage import public_hosts
from stereocell.storage.location import Location
from support.phantoms import f_phantom, write_ome_tiff
from support.recorded_service import serving

BOX = Box((1, 3, 5), (4, 30, 21))
FORMATS = ("tiny_zarr_04", "tiny_zarr_05", "tiny_tiff")

# Reading on request: chunks are (2, 16, 16) in the fixtures.


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
    # Indices of the tiles along c, z, y, x. Zarr v2 and v3 spell the keys differently.
    tiles = {tuple(int(n) for n in re.findall(r"\d+", key))[:4] for key in decoded}
    assert tiles == {(1, 2, 1, 0), (1, 2, 1, 1), (1, 3, 1, 0), (1, 3, 1, 1)}
    assert len(decoded) == 4


# Addresses


@pytest.mark.slow
@pytest.mark.parametrize("fixture", FORMATS)
def test_http_gives_the_same_voxels_as_the_disk(
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


@pytest.mark.slow
@pytest.mark.parametrize("fixture", FORMATS)
def test_s3_gives_the_same_voxels_as_the_disk(
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


@pytest.mark.parametrize("fixture", FORMATS)
@pytest.mark.slow
def test_a_public_host_does_not_redirect_into_a_private_network(
    fixture: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """127.0.0.2 plays a private host here, and 127.0.0.1 a public one."""
    path: Path = request.getfixturevalue(fixture)
    files = [path] if path.is_file() else [file for file in path.rglob("*") if file.is_file()]
    with serving() as public, serving("127.0.0.2") as private:
        for file in files:
            name = f"/{file.relative_to(path.parent).as_posix()}"
            private.put(name, file.read_bytes())
            public.redirect(name, f"{private.url}{name}")
        address = f"{public.url}/{path.name}"
        if fixture != "tiny_tiff":  # the reader of TIFF needs ranges
            assert read.open(address).fingerprint == read.open(path).fingerprint
        private.asked.clear()
        monkeypatch.setattr(public_hosts, "is_public", lambda number: number == "127.0.0.1")
        # fsspec doesn't report the reason where it opens a TIFF.
        words = "not reachable" if fixture == "tiny_tiff" else "private network"
        with pytest.raises(SourceError, match=words):
            read.open(address)
        assert private.asked == []


def test_secrets_in_an_address_are_not_shown() -> None:
    with pytest.raises(SourceError) as caught:
        read.open("http://user:hunter2@127.0.0.1:9/a.ome.tif?signature=abc")
    assert "127.0.0.1:9/a.ome.tif" in str(caught.value)
    assert "hunter2" not in str(caught.value)
    assert "signature" not in str(caught.value)


@pytest.mark.parametrize("name", ["a:b.ome.tif", "c:", "s3:a.ome.tif", "in:1/out:2"])
def test_a_colon_alone_does_not_make_an_address(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert Location.of(name) == Location(str(tmp_path / name), True)
    assert Location.of(f"./x://{name}").is_local
    assert not Location.of(f"s3://bucket/{name}").is_local


def test_a_local_file_with_a_colon_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_ome_tiff(tmp_path / "a:b.ome.tif", f_phantom())
    dataset = read.open("a:b.ome.tif")
    assert dataset.name == "a:b"
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, f_phantom())


@pytest.mark.parametrize(
    ("source", "out"),
    [
        ("v.ome.zarr", "v.ome.zarr"),
        ("v.ome.zarr", "v.ome.zarr/out"),
        ("./v.ome.zarr/", "w/../v.ome.zarr/a/b"),
        ("v.ome.zarr", "link/out"),
        ("plate.zarr/A/1/0", "plate.zarr/out"),
        ("v.ome.tif", "v.ome.tif"),
    ],
)
def test_out_inside_the_input_is_wrong_usage(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, source: str, out: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "v.ome.zarr").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "v.ome.zarr")
    with pytest.raises(UsageError, match=r"OUT is .*, inside the input .*, expected a folder else"):
        require_apart(source, Path(out))


@pytest.mark.parametrize(
    ("source", "out"),
    [
        ("v.ome.zarr", "v.ome.zarr.out"),
        ("v.ome.zarr", "out"),
        ("in/v.ome.zarr", "in"),
        ("s3://bucket/v.ome.zarr", "s3:/bucket/v.ome.zarr"),
    ],
)
def test_out_beside_the_input_is_accepted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, source: str, out: str
) -> None:
    monkeypatch.chdir(tmp_path)
    require_apart(source, Path(out))
