"""The share of chunks that are not stored is reported, and a level without any is refused."""

import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import zarr

from stereocell.cli.__main__ import main
from stereocell.planning import input_files
from stereocell.read import chunk_counts
from support import phantoms
from support.array_files import write_n5

BODY = phantoms.f_phantom()
BOTH = np.stack([BODY, BODY + 7])


@pytest.fixture(autouse=True)
def fresh() -> None:
    input_files.forget()


def plan(path: Path | str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    capsys.readouterr()
    flags = ["--spacing-um", "1,1,1", "--as", "intensity"]
    code = main(["plan", str(path), "-o", str(tmp_path / "out"), *flags])
    shutil.rmtree(tmp_path / "out", ignore_errors=True)
    input_files.forget()
    return code, capsys.readouterr().err


def write_shards(path: Path) -> Path:
    phantoms.write_ome_zarr(path, [BODY])
    array: Any = zarr.open_group(path).create_array(
        "0", shape=BODY.shape, dtype="u2", chunks=(4, 12, 18), shards=(8, 24, 36),
        compressors=None, fill_value=3, overwrite=True,
    )  # fmt: skip
    array[:] = BODY
    return path


def write_hdf5(path: Path, count: int) -> Path:
    """Write some of the eight chunks of a dataset."""
    with h5py.File(path, "w") as file:
        data = file.create_dataset("raw", BODY.shape, "u2", chunks=(2, 48, 36), fillvalue=9)
        data[: 2 * count] = BODY[: 2 * count]
    return path


@pytest.mark.slow
def test_the_share_of_chunks_that_are_not_stored_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chunks = phantoms.write_ome_zarr(tmp_path / "a.ome.zarr", [BODY], chunks=(4, 48, 36))
    flat = phantoms.write_ome_zarr(
        tmp_path / "b.ome.zarr", [BOTH], "czyx", version="0.4", chunks=(1, 4, 48, 36),
        scales=[{"z": 1, "y": 1, "x": 1}],
    )  # fmt: skip
    shards, blocks = write_shards(tmp_path / "c.ome.zarr"), write_n5(tmp_path / "a.n5", BODY)
    note = "({}) are not stored: they are read as {}, and the format does not state"
    for path, lost, words in (
        (chunks, "0/c/1/0/0", "1 of 4 chunks of resolution level 0 " + note.format("25.00%", 0)),
        (flat, "0/1/2/0/0", "1 of 8 chunks of resolution level 0 " + note.format("12.50%", 0)),
        (shards, "0/c/0/1/0", "1 of 4 shards of resolution level 0 " + note.format("25.00%", 3)),
        (blocks, "1/0/1", "1 of 24 blocks of resolution level 0 " + note.format("4.17%", 0)),
    ):
        code, printed = plan(path, tmp_path, capsys)
        assert (code, "not stored" in printed) == (0, False)
        (path / lost).unlink()
        code, printed = plan(path, tmp_path, capsys)
        assert code == 0
        assert words in printed
    code, printed = plan(write_hdf5(tmp_path / "a.h5", 6), tmp_path, capsys)
    assert code == 0
    assert "2 of 8 chunks of resolution level 0 " + note.format("25.00%", 9) in printed


@pytest.mark.slow
def test_chunks_of_other_channels_and_regions_are_not_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = phantoms.write_ome_zarr(
        tmp_path / "b.ome.zarr", [BOTH], "czyx", chunks=(1, 4, 48, 36),
        scales=[{"z": 1, "y": 1, "x": 1}],
    )  # fmt: skip
    (path / "0/c/1/3/0/0").unlink()
    for flags, is_reported in (
        ([], True),
        (["--channels", "0"], False),
        (["--region", "0:12,0:48,0:36"], False),
        (["--region", "0:13,0:48,0:36"], True),
    ):
        capsys.readouterr()
        plan_it = ["plan", str(path), "-o", str(tmp_path / "out"), "--as", "intensity"]
        assert main([*plan_it, *flags]) == 0
        assert ("not stored" in capsys.readouterr().err) == is_reported
        shutil.rmtree(tmp_path / "out")


def test_a_level_without_any_chunk_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = phantoms.write_ome_zarr(tmp_path / "a.ome.zarr", [BODY], chunks=(4, 48, 36))
    shutil.rmtree(path / "0" / "c")
    code, printed = plan(path, tmp_path, capsys)
    assert code == 1
    assert "level 0: found none of 4 chunks, expected the chunks that hold voxels" in printed


@pytest.mark.parametrize("seed", range(5))
def test_counting_touched_chunks_agrees_with_listing_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ranges = [range(int(a), int(a + rng.integers(1, 9))) for a in rng.integers(0, 60, 7)]
    touched = {voxel // 4 for one in ranges for voxel in one}
    assert chunk_counts._count(4, ranges) == len(touched)
    assert chunk_counts._count(1, [range(10**15), range(10**14, 10**15 + 1)]) == 10**15 + 1
