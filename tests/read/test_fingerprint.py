"""Fingerprints distinguish datasets, at a bounded cost."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from numpy.typing import NDArray

from stereocell import read
from stereocell.model.tiling import Box
from stereocell.read.fingerprint import BUDGET_BYTES
from support.phantoms import write_ome_zarr


@pytest.mark.slow
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


@pytest.mark.slow
def test_fingerprint_reads_a_bounded_part(tmp_path: Path) -> None:
    # 240 MB by its header. Chunks that were never written are zeros and cost nothing here.
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
