"""Packed voxels are read back bit by bit."""

from pathlib import Path

import numpy as np
import pytest
from numcodecs import blosc

from stereocell.formats.packed_voxels import pack_voxels, unpack_voxels


@pytest.mark.parametrize("dtype", ["u1", "<u2", ">u2", "i2", "u4", "f4", "f8"])
@pytest.mark.parametrize("shape", [(1, 1, 1), (3, 5, 7), (5, 700, 611)])
def test_voxels_of_any_type_are_read_back(
    tmp_path: Path, dtype: str, shape: tuple[int, int, int]
) -> None:
    drawn = np.random.default_rng(0).normal(90, 20, shape)
    voxels = drawn.astype(dtype)
    content = pack_voxels(voxels.transpose(0, 2, 1))
    (tmp_path / "a.npz").write_bytes(content)
    found = unpack_voxels(tmp_path / "a.npz")
    assert found.dtype == voxels.dtype
    np.testing.assert_array_equal(found, voxels.transpose(0, 2, 1))
    assert content == pack_voxels(found)


def test_the_same_voxels_give_the_same_bytes_with_any_number_of_threads(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(blosc, "use_threads", None)  # as long as zarr is not imported
    voxels = np.random.default_rng(0).normal(900, 200, (2, 1000, 1000)).astype(np.uint16)
    assert len({pack_voxels(voxels) for _ in range(50)}) == 1
    assert blosc.use_threads is None  # other users of Blosc keep their setting


def test_smooth_voxels_take_less_room_than_plain_ones() -> None:
    z, y, x = np.indices((20, 100, 100))
    voxels = (1000 + 3 * z + 2 * y + x).astype(np.uint16)
    assert len(pack_voxels(voxels)) < voxels.nbytes / 3


def test_voxels_of_a_file_that_was_cut_are_refused(tmp_path: Path) -> None:
    content = pack_voxels(np.arange(6000, dtype=np.uint16).reshape(10, 20, 30))
    (tmp_path / "a.npz").write_bytes(content[:-30])
    with pytest.raises(Exception, match=r"zip|read|magic"):
        unpack_voxels(tmp_path / "a.npz")
