from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from stereocell.formats.exr import check_exr, read_atlas, write_atlas, write_lut
from stereocell.model.errors import StageError
from stereocell.transfer.opacity import evaluate


@pytest.mark.parametrize("shape", [(1, 5, 9), (7, 3, 30), (5, 5, 5), (26, 66, 51)])
def test_an_atlas_is_read_back_as_the_same_bytes(
    tmp_path: Path, shape: tuple[int, int, int]
) -> None:
    volume = np.random.default_rng(1).integers(0, 256, shape, dtype=np.uint8)
    write_atlas(tmp_path / "a.exr", volume)
    assert np.array_equal(read_atlas(tmp_path / "a.exr"), volume)


def test_slices_start_at_the_upper_left_and_the_header_states_their_layout(tmp_path: Path) -> None:
    volume = np.zeros((5, 4, 4), dtype=np.uint8)
    volume[3, 1, 2] = 255
    write_atlas(tmp_path / "a.exr", volume)
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        header, pixels = dict(file.header()), np.array(file.channels()["Y"].pixels)
    assert (header["columns"], header["rows"], header["apron"]) == (2, 3, 1)
    assert list(header["atlasSize"]) == [4, 4, 5]
    assert pixels.dtype == np.float16
    assert np.argwhere(pixels).tolist() == [[1 * 4 + 1, 1 * 4 + 2]]  # slice 3: row 1, column 1
    assert "capDate" not in header


def test_the_same_volume_gives_the_same_bytes(tmp_path: Path) -> None:
    volume = np.random.default_rng(1).integers(0, 256, (9, 20, 30), dtype=np.uint8)
    for name in ("a", "b"):
        write_atlas(tmp_path / f"{name}.exr", volume)
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()


def test_a_lut_holds_the_opacity_of_every_intensity(tmp_path: Path) -> None:
    points = ((0.0, 0.0), (0.2, 0.0), (0.6, 1.0), (1.0, 0.5))
    write_lut(tmp_path / "lut.exr", points)
    with OpenEXR.File(str(tmp_path / "lut.exr")) as file:
        pixels = np.array(file.channels()["RGBA"].pixels)
    assert pixels.shape == (1, 256, 4)
    assert (pixels[..., :3] == 1).all()
    x = np.arange(256) / 255
    rising, falling = (x - 0.2) / 0.4, 1 - 0.5 * (x - 0.6) / 0.4
    expected = np.where(x < 0.2, 0, np.where(x < 0.6, rising, falling))
    assert np.allclose(pixels[0, :, 3], expected, atol=1e-3)
    assert np.allclose(evaluate(points), expected, atol=1e-6)


def test_the_error_for_a_file_that_was_cut_short_is_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.exr"
    volume = np.random.default_rng(1).integers(0, 256, (9, 60, 90), dtype=np.uint8)
    write_atlas(path, volume)
    whole = path.read_bytes()
    check_exr(path)
    for size in (0, 3, 100, 400, len(whole) // 2, len(whole) - 200, len(whole) - 1):
        path.write_bytes(whole[:size])
        with pytest.raises(
            StageError, match=r"a\.exr: can't be read as OpenEXR: (its|the file) "
        ) as caught:
            read_atlas(path)
        assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")  # OpenEXR would print to stderr


@pytest.mark.parametrize("compression", ["NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "DWAB"])
def test_complete_files_of_other_programs_pass(tmp_path: Path, compression: str) -> None:
    path = tmp_path / "a.exr"
    header = {"compression": getattr(OpenEXR, f"{compression}_COMPRESSION")}
    header["type"] = OpenEXR.scanlineimage
    pixels = np.random.default_rng(1).random((300, 20)).astype(np.float16)
    OpenEXR.File(header, {"Y": pixels}).write(str(path))
    check_exr(path)
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(StageError, match=r"expected \d+ or more"):
        check_exr(path)


def test_tiled_files_pass_by_their_header(tmp_path: Path) -> None:
    header = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    pixels = np.zeros((64, 64), dtype=np.float16)
    OpenEXR.File(header, {"Y": pixels}).write(str(tmp_path / "a.exr"))
    check_exr(tmp_path / "a.exr")


def test_the_error_for_a_damaged_missing_or_other_file_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    with pytest.raises(StageError, match=r"a\.exr"):
        read_atlas(path)
    volume = np.random.default_rng(1).integers(0, 256, (9, 20, 30), dtype=np.uint8)
    write_atlas(path, volume)
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(StageError, match=r"a\.exr: can't be read as OpenEXR"):
        read_atlas(path)
    write_lut(path, ((0.0, 0.0), (1.0, 1.0)))
    with pytest.raises(StageError, match=r"a\.exr: no header attribute columns"):
        read_atlas(path)
    size = np.array([30, 20, 9], dtype=np.int32)
    header = {"columns": 2, "rows": 2, "atlasSize": size, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"Y": np.zeros((40, 60), dtype=np.float16)}).write(str(path))
    with pytest.raises(StageError, match=r"do not hold 9 slices of 30 x 20 in 2 x 2 places"):
        read_atlas(path)


@pytest.mark.parametrize("number", [np.float16, np.float32])
def test_an_atlas_of_another_program_is_rounded_and_clipped(
    tmp_path: Path, number: type[np.floating]
) -> None:
    image = np.array([[-0.5, 0.0, 0.4, 0.5], [1.0, 1.5, np.inf, np.nan]], number)
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "columns": 2,
        "rows": 1,
        "atlasSize": np.array([2, 2, 2], np.int32),
    }
    path = tmp_path / "atlas.exr"
    OpenEXR.File(header, {"Y": image}).write(str(path))
    expected = [[[0, 0], [255, 255]], [[102, 128], [255, 0]]]
    np.testing.assert_array_equal(read_atlas(path), expected)
