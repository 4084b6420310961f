"""Zarr chunks under other names than the metadata state, and chunks that a shard lacks."""

import json
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.planning import input_files
from support.phantoms import f_phantom, write_ome_zarr

BODY = f_phantom()
NAMED = {
    2: [{"name": "v2", "separator": "/"}, {"name": "v2", "separator": "."}],
    3: [
        {"name": "default", "separator": "/"},
        {"name": "default", "separator": "."},
        {"name": "v2", "separator": "."},
        {"name": "v2", "separator": "/"},
    ],
}


def write(path: Path, version: Any, stored: dict[str, str], stated: dict[str, str]) -> Path:
    """Write an OME-Zarr whose chunks have names of one form, and whose metadata state another."""
    write_ome_zarr(path, [BODY], version="0.4" if version == 2 else "0.5")
    shutil.rmtree(path / "0")
    array = zarr.create_array(
        path / "0", shape=BODY.shape, dtype="u2", chunks=(8, 16, 36), zarr_format=version,
        chunk_key_encoding=stored,  # type: ignore[arg-type]
    )  # fmt: skip
    array[:] = BODY
    file = path / "0" / (".zarray" if version == 2 else "zarr.json")
    about = json.loads(file.read_text("utf-8"))
    if version == 2:
        about["dimension_separator"] = stated["separator"]
    else:
        separator = {"separator": stated["separator"]}
        about["chunk_key_encoding"] = {"name": stated["name"], "configuration": separator}
    file.write_text(json.dumps(about))
    return path


def voxels_of(path: Path | str) -> tuple[Any, tuple[str, ...]]:
    dataset = read.open(path)
    return dataset.read(0, dataset.levels[0].box).voxels, dataset.notes


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.slow
def test_chunks_are_read_by_the_names_of_their_files(tmp_path: Path, version: int) -> None:
    forms = NAMED[version]
    for number, (stored, stated) in enumerate((a, b) for a in forms for b in forms if a != b):
        voxels, notes = voxels_of(write(tmp_path / f"{number}.zarr", version, stored, stated))
        np.testing.assert_array_equal(voxels, BODY)
        assert any("but the files are named like" in note for note in notes), (stored, stated)
    voxels, notes = voxels_of(write(tmp_path / "same.zarr", version, forms[0], forms[0]))
    np.testing.assert_array_equal(voxels, BODY)
    assert notes == ()


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.slow
def test_chunks_in_a_zip_file_are_read_by_the_names_of_their_files(
    tmp_path: Path, version: int
) -> None:
    forms = NAMED[version]
    for number, (stored, stated) in enumerate((a, b) for a in forms for b in forms):
        path = write(tmp_path / f"{number}.zarr", version, stored, stated)
        archive = tmp_path / f"{number}.ozx"
        with zipfile.ZipFile(archive, "w") as file:
            for member in sorted(path.rglob("*")):
                file.write(member, member.relative_to(path))
        voxels, notes = voxels_of(archive)
        np.testing.assert_array_equal(voxels, BODY)
        is_noted = any("but the files are named like" in note for note in notes)
        assert is_noted is (stored != stated), (stored, stated)


def test_chunks_under_both_names_are_all_read(tmp_path: Path) -> None:
    path = write(tmp_path / "a.zarr", 2, NAMED[2][0], NAMED[2][0])
    (path / "0/1/2/0").rename(path / "0/1.2.0")
    voxels, notes = voxels_of(path)
    np.testing.assert_array_equal(voxels, BODY)
    assert "metadata name them like 0/0/0, but the files are named like 0.0.0" in notes[0]


def test_a_bare_array_is_read_by_the_names_of_its_files(tmp_path: Path) -> None:
    path = write(tmp_path / "a.zarr", 2, NAMED[2][1], NAMED[2][0]) / "0"
    path.rename(tmp_path / "bare.zarr")
    dataset = read.open(tmp_path / "bare.zarr", spacing_um=(1, 1, 1))
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, BODY)
    assert "but the files are named like 0.0.0" in dataset.notes[0]


def test_chunks_are_read_by_their_names_at_an_address(
    tmp_path: Path, serve: Callable[[Path], Any]
) -> None:
    for number, (stored, stated) in enumerate(zip(NAMED[2], reversed(NAMED[2]), strict=True)):
        path = write(tmp_path / f"{number}.zarr", 2, stored, stated)
        server = serve(tmp_path)
        voxels, _ = voxels_of(f"{server.url}/{path.name}")
        np.testing.assert_array_equal(voxels, BODY)


def plan(path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    input_files.forget()
    capsys.readouterr()
    assert main(["plan", str(path), "-o", str(tmp_path / "out"), "--as", "intensity"]) == 0
    shutil.rmtree(tmp_path / "out")
    return capsys.readouterr().err


def test_lost_chunks_are_counted_by_the_names_of_the_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path / "a.zarr", 2, NAMED[2][1], NAMED[2][0])
    assert "not stored" not in plan(path, tmp_path, capsys)
    (path / "0/1.2.0").unlink()
    assert "1 of 6 chunks of resolution level 0 (16.67%) are not stored" in plan(
        path, tmp_path, capsys
    )


@pytest.mark.parametrize("place", ["start", "end"])
@pytest.mark.slow
def test_chunks_that_a_shard_lacks_are_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], place: Any
) -> None:
    path = write_ome_zarr(tmp_path / "a.ome.zarr", [BODY])
    codec = zarr.codecs.ShardingCodec(chunk_shape=(4, 12, 12), index_location=place)
    array = zarr.open_group(path).create_array(
        "0", shape=BODY.shape, dtype="u2", chunks=(8, 36, 24), serializer=codec, overwrite=True,
        compressors=None, filters=None, fill_value=3,
    )  # fmt: skip
    array[:] = BODY  # 48 of 72 rows and 36 of 48 columns are filled: the index has more entries
    assert "not stored" not in plan(path, tmp_path, capsys)
    array[4:8, 12:24, 24:36] = 3
    array[8:, :36, :24] = 3  # empties a shard, which zarr-python then deletes
    printed = plan(path, tmp_path, capsys)
    assert (
        "13 of 48 chunks of resolution level 0 (27.08%) are not stored: they are read as 3"
        in printed
    )
