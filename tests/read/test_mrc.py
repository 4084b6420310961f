"""MRC and CCP4 maps, written by mrcfile: axes, hand, Angstrom, signed bytes."""

import bz2
import gzip
from pathlib import Path
from typing import Any

import mrcfile
import numpy as np
import pytest

from stereocell import read
from stereocell.model.errors import SourceError
from stereocell.model.tiling import Box
from support.phantoms import f_phantom
from support.reading import whole

ANGSTROM = (4.0, 8.0, 10.0)  # x, y, z


def write(path: Path, voxels: Any = None, **fields: Any) -> Path:
    with mrcfile.new(path, overwrite=True) as file:
        file.set_data(f_phantom().astype(np.int16) if voxels is None else voxels)
        file.set_volume()
        file.voxel_size = ANGSTROM
        for name, value in fields.items():
            file.header[name] = value
    return path


@pytest.mark.parametrize("name", ["a.mrc", "it's a µ tomogram.REC", "a.map.gz", "a.mrc.bz2"])
@pytest.mark.parametrize("dtype", [np.int16, np.uint16, np.float32])
def test_rows_run_upwards_so_y_is_reversed(tmp_path: Path, name: str, dtype: Any) -> None:
    path = write(tmp_path / "plain", f_phantom().astype(dtype))
    pack = {".gz": gzip.compress, ".bz2": bz2.compress}.get(Path(name).suffix, bytes)
    (tmp_path / name).write_bytes(pack(path.read_bytes()))
    dataset = read.open(tmp_path / name)
    np.testing.assert_array_equal(whole(dataset), f_phantom()[:, ::-1])
    assert dataset.dtype == dtype
    assert dataset.levels[0].spacing_um == pytest.approx((1e-3, 8e-4, 4e-4))
    assert dataset.name == name.partition(".")[0]
    box = Box((2, 3, 4), (9, 17, 30))
    expected = f_phantom()[:, ::-1][box.slices]
    np.testing.assert_array_equal(dataset.read(0, box).voxels, expected)


@pytest.mark.parametrize("order", [(1, 2, 3), (3, 1, 2), (2, 1, 3), (3, 2, 1)])
def test_columns_rows_and_sections_lie_along_any_axes(
    tmp_path: Path, order: tuple[int, int, int]
) -> None:
    names = dict(zip(("mapc", "mapr", "maps"), order, strict=True))
    xyz = f_phantom().astype(np.int16).transpose()
    stored = xyz.transpose([axis - 1 for axis in reversed(order)])  # sections, rows, columns
    counts = dict(zip(("mx", "my", "mz"), xyz.shape, strict=True))
    cell = tuple(n * a for n, a in zip(xyz.shape, ANGSTROM, strict=True))
    dataset = read.open(write(tmp_path / "a.mrc", stored, cella=cell, **names, **counts))
    np.testing.assert_array_equal(whole(dataset), f_phantom()[:, ::-1])
    assert dataset.levels[0].spacing_um == pytest.approx((1e-3, 8e-4, 4e-4))


# mrcfile swaps the bytes of its header in a way that NumPy 2.5 deprecates
@pytest.mark.filterwarnings("ignore:Setting the dtype on a NumPy array:DeprecationWarning")
def test_big_endian_and_an_extended_header_are_read(tmp_path: Path) -> None:
    with mrcfile.new(tmp_path / "a.mrc") as file:
        file.set_data(f_phantom().astype(">i2"))
        file.set_volume()
        file.set_extended_header(np.zeros(100, "V8"))
        file.voxel_size = ANGSTROM
    dataset = read.open(tmp_path / "a.mrc")
    np.testing.assert_array_equal(whole(dataset), f_phantom()[:, ::-1])


def test_bytes_of_imod_have_a_sign_where_its_flag_says_so(tmp_path: Path) -> None:
    voxels = (f_phantom() // 5).astype(np.uint8)  # values 20 and 200
    path = write(tmp_path / "a.mrc", voxels.view(np.int8))
    content = bytearray(path.read_bytes())
    content[152:160] = np.array([1146047817, 0], "<i4").tobytes()
    path.write_bytes(content)
    dataset = read.open(path)
    assert dataset.dtype == np.uint8
    np.testing.assert_array_equal(whole(dataset), voxels[:, ::-1])


def test_a_stack_of_images_is_reported(tmp_path: Path) -> None:
    dataset = read.open(write(tmp_path / "a.mrc", ispg=0, mz=1, cella=(144.0, 384.0, 10.0)))
    assert dataset.notes == ("the header states a stack of images: read as one volume",)


def test_a_stack_of_volumes_has_a_volume_for_each_point_in_time(tmp_path: Path) -> None:
    both = np.stack([f_phantom(), f_phantom() + 7]).astype(np.int16)
    with mrcfile.new(tmp_path / "a.mrc") as file:
        file.set_data(both)
        file.voxel_size = ANGSTROM
    for time in (0, 1):
        dataset = read.open(tmp_path / "a.mrc", time=time)
        np.testing.assert_array_equal(whole(dataset), both[time, :, ::-1])
    assert dataset.time_points == 2
    assert dataset.levels[0].spacing_um == pytest.approx((1e-3, 8e-4, 4e-4))
    assert any("a stack of 2 volumes of 16 sections" in note for note in dataset.notes)


def test_a_cell_whose_axes_are_not_at_right_angles_is_reported(tmp_path: Path) -> None:
    dataset = read.open(write(tmp_path / "a.mrc", cellb=(90, 90, 120)))
    assert any("found 90, 90, 120 degrees, expected 90 each" in note for note in dataset.notes)
    assert read.open(write(tmp_path / "b.mrc", cellb=(0, 0, 0))).notes == ()


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"cella": (0, 0, 0)}, "--spacing-um"),
        ({"mapc": 3}, "MAPS, MAPR, MAPC"),
        ({"nx": 0}, "size"),
        ({"nz": 4000}, "cut short"),
        ({"mode": 4}, "complex"),
        ({"mode": 77}, "expected an MRC"),
        ({"nsymbt": -5000}, "expected"),
    ],
)
def test_invalid_fields_are_named(tmp_path: Path, fields: dict[str, Any], message: str) -> None:
    path = write(tmp_path / "a.mrc")
    header = np.frombuffer(path.read_bytes()[:1024], mrcfile.dtypes.HEADER_DTYPE).copy()
    for name, value in fields.items():
        header[name] = value
    path.write_bytes(header.tobytes() + path.read_bytes()[1024:])
    with pytest.raises(SourceError, match=message) as caught:
        whole(read.open(path))
    assert "\n" not in str(caught.value)


def test_a_map_with_another_ending_is_recognised_by_its_content(tmp_path: Path) -> None:
    """IMOD names a tilt series .st, and an aligned one .ali."""
    with mrcfile.new(tmp_path / "a.mrc") as file:
        file.set_data(np.arange(4 * 5 * 6, dtype=np.int16).reshape(4, 5, 6))
        file.voxel_size = 10.0
    content = (tmp_path / "a.mrc").read_bytes()
    (tmp_path / "a.st").write_bytes(content)
    np.testing.assert_array_equal(
        whole(read.open(tmp_path / "a.st")), whole(read.open(tmp_path / "a.mrc"))
    )


@pytest.mark.parametrize("content", [b"", b"no map", bytes(2000), b"\x1f\x8bno gzip"])
def test_a_file_that_is_not_a_map_is_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.mrc").write_bytes(content)
    with pytest.raises(SourceError, match="expected"):
        read.open(tmp_path / "a.mrc")
    (tmp_path / "c.rec").write_bytes(content)
    (tmp_path / "c.PAR").touch()
    with pytest.raises(SourceError, match="dcm2niix"):
        read.open(tmp_path / "c.rec")
    (tmp_path / "b.mrc").mkdir()
    with pytest.raises(SourceError, match="found a folder"):
        read.open(tmp_path / "b.mrc")
