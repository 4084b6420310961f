"""Folders of planes: how names are read, and voxels compared with what other libraries wrote."""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray
from PIL import Image as Pillow

from stereocell import read
from stereocell.model.errors import SourceError, StereoCellError, UsageError
from stereocell.model.tiling import Box
from stereocell.read.formats.planes import files as planes_files
from stereocell.read.spacing import Triple

GIVEN: Triple = (2.0, 1.0, 1.0)
Write = Callable[[Path, NDArray[Any]], None]


def tiff(path: Path, pixels: NDArray[Any]) -> None:
    tifffile.imwrite(path, pixels, photometric="rgb" if pixels.ndim == 3 else "minisblack")


def png(path: Path, pixels: NDArray[Any]) -> None:
    path.write_bytes(imagecodecs.png_encode(pixels))


def pillow(path: Path, pixels: NDArray[Any]) -> None:
    Pillow.fromarray(pixels).save(path)


def volume(*shape: int, dtype: str = "uint16") -> NDArray[Any]:
    return np.random.default_rng(sum(shape)).integers(0, 255, shape).astype(dtype)


def fill(folder: Path, names: dict[str, NDArray[Any]], write: Write = tiff) -> Path:
    for name, pixels in names.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        write(folder / name, pixels)
    return folder


def read_all(dataset: read.Dataset) -> NDArray[Any]:
    """Return the voxels of all channels at the finest level, (c, z, y, x)."""
    box = dataset.levels[0].box
    return np.stack([dataset.read(c, box).voxels for c in range(len(dataset.channels))])


def refusal(folder: Path, kind: type[StereoCellError] = SourceError, **options: Any) -> str:
    with pytest.raises(kind) as caught:
        read_all(read.open(folder, **{"spacing_um": GIVEN} | options))
    line = str(caught.value)
    assert "\n" not in line
    assert "expected" in line
    return line


# how microscopes and programs name planes: (c, z) or z -> name
NAMES: dict[str, Callable[[int, int], str]] = {
    "ImageJ": lambda c, z: f"stack{z:04d}.tif",
    "one number": lambda c, z: f"{z}.tif",
    "Leica": lambda c, z: f"Exp 1_Series014_z{z:03d}_ch{c:02d}.tif",
    "Olympus": lambda c, z: f"s_C{c + 1:03d}Z{z:03d}.tif",
    "Zeiss": lambda c, z: f"embryo_z{z}c{c + 1}_ORG.tif",
    "MetaMorph": lambda c, z: f"exp_w{c + 1}_z{z}.TIF",
    "MetaXpress": lambda c, z: f"TimePoint_1/ZStep_{z + 1}/9987_B02_s1_w{c + 1}.TIF",
    "Micro-Manager": lambda c, z: f"img_channel{c:03d}_position000_time000000000_z{z:03d}.tif",
    "words": lambda c, z: f"cells {('DAPI', 'GFP-2')[c]} {z}.tif",
    "markers": lambda c, z: f"T1_{('CD31', 'MART1')[c]}_{z:02d}.tif",
    "folders": lambda c, z: f"ch{c}/ch{10000 * c + z:05d}.tif",
    "folders of words": lambda c, z: f"{('red', 'green')[c]}/plane {z}.tif",
    "word before": lambda c, z: f"slice_{z}.tif",
    "unicode": lambda c, z: f"ma\u00dfstab \u00b5 it's {z} .tif",
    "from 7 in steps of 5": lambda c, z: f"s{7 + 5 * z}.tif",
    "negative": lambda c, z: f"z-{z:02d}.tiff",
}
ONE_CHANNEL = {
    "ImageJ", "one number", "word before", "unicode", "from 7 in steps of 5", "negative",
}  # fmt: skip


@pytest.mark.parametrize("form", NAMES)
def test_names_are_understood(tmp_path: Path, form: str) -> None:
    count = 1 if form in ONE_CHANNEL else 2
    stored = volume(count, 12, 10, 14)  # 12 planes, so that text sorts 10 before 2
    folder = fill(
        tmp_path,
        {NAMES[form](c, z): stored[c, z] for c in range(count) for z in range(12)},
    )
    dataset = read.open(folder, spacing_um=GIVEN)
    assert dataset.dtype == np.uint16
    order = [1, 0] if form == "folders of words" else range(count)  # green before red
    np.testing.assert_array_equal(read_all(dataset), stored[order])
    assert "12 planes" in dataset.notes[0]
    assert dataset.time_points == 1


@pytest.mark.parametrize(
    ("form", "names"),
    [
        ("Leica", ["ch00", "ch01"]),
        ("words", ["DAPI", "GFP"]),
        ("markers", ["CD31", "MART1"]),
        ("folders of words", ["green", "red"]),
    ],
)
def test_channels_are_called_by_the_words_in_the_names(
    tmp_path: Path, form: str, names: list[str]
) -> None:
    pixels = volume(10, 14)
    label = {"words": lambda c, z: f"cells {('DAPI', 'GFP')[c]} {z}.tif"}.get(form, NAMES[form])
    folder = fill(tmp_path, {label(c, z): pixels for c in range(2) for z in range(3)})
    dataset = read.open(folder, spacing_um=GIVEN)
    assert [channel.name for channel in dataset.channels] == names


def test_time_points_are_recognised_by_the_letter_t(tmp_path: Path) -> None:
    stored = volume(3, 4, 10, 14)
    folder = fill(tmp_path, {f"x_t{t}_z{z}.tif": stored[t, z] for t in range(3) for z in range(4)})
    dataset = read.open(folder, time=2, spacing_um=GIVEN)
    assert dataset.time_points == 3
    np.testing.assert_array_equal(read_all(dataset)[0], stored[2])


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32", "float64", "bool", ">u2"])
def test_tiff_of_any_number_type(tmp_path: Path, dtype: str) -> None:
    stored = (volume(3, 10, 14) % 2 if dtype == "bool" else volume(3, 10, 14)).astype(dtype)
    for z in range(3):
        order: Any = ">" if dtype[0] == ">" else "<"
        tifffile.imwrite(tmp_path / f"z{z}.tif", stored[z], byteorder=order)
    dataset = read.open(tmp_path, spacing_um=GIVEN)
    np.testing.assert_array_equal(read_all(dataset)[0], stored)


@pytest.mark.parametrize(("dtype", "write"), [("uint8", png), ("uint16", png), ("uint8", pillow)])
def test_png_planes(tmp_path: Path, dtype: str, write: Write) -> None:
    stored = volume(3, 10, 14, dtype=dtype) * (200 if dtype == "uint16" else 1)
    folder = fill(tmp_path, {f"z{z}.PNG": stored[z] for z in range(3)}, write)
    dataset = read.open(folder, spacing_um=GIVEN)
    assert dataset.dtype == dtype
    np.testing.assert_array_equal(read_all(dataset)[0], stored)


@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
@pytest.mark.parametrize("samples", [3, 4])
@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_colour_planes(tmp_path: Path, dtype: str, samples: int, suffix: str) -> None:
    stored = volume(3, 10, 14, samples).astype(dtype) * np.array(
        257 if dtype == "uint16" else 1, dtype
    )
    write = png if suffix == "png" else tiff
    folder = fill(tmp_path, {f"z{z}.{suffix}": stored[z] for z in range(3)}, write)
    dataset = read.open(folder, spacing_um=GIVEN)
    assert [channel.name for channel in dataset.channels] == ["Red", "Green", "Blue"]
    np.testing.assert_array_equal(read_all(dataset), np.moveaxis(stored[..., :3], -1, 0))
    assert any("alpha is left out" in note for note in dataset.notes) == (samples == 4)


def test_jpeg_planes(tmp_path: Path) -> None:
    stored = np.broadcast_to(volume(3, 1, 1, dtype="uint8"), (3, 16, 24))
    folder = fill(
        tmp_path, {f"z{z}.jpg": np.ascontiguousarray(stored[z]) for z in range(3)}, pillow
    )
    np.testing.assert_allclose(read_all(read.open(folder, spacing_um=GIVEN))[0], stored, atol=1)


@pytest.mark.parametrize("form", ["C{}-embryo.tif", "embryo_{}.tif", "embryo w{}.stk.tif"])
def test_a_stack_for_each_channel(tmp_path: Path, form: str) -> None:
    stored = volume(2, 5, 10, 14)
    for c in range(2):
        tifffile.imwrite(
            tmp_path / form.format(c + 1), stored[c], imagej=True, resolution=(5.0, 4.0),
            metadata={"axes": "ZYX", "spacing": 0.5, "unit": "um"},
        )  # fmt: skip
    dataset = read.open(tmp_path)
    assert dataset.levels[0].spacing_um == pytest.approx((0.5, 0.25, 0.2))
    np.testing.assert_array_equal(read_all(dataset), stored)
    part = dataset.read(1, Box((1, 2, 3), (4, 9, 11))).voxels
    np.testing.assert_array_equal(part, stored[1, 1:4, 2:9, 3:11])


def test_a_hyperstack_for_each_time(tmp_path: Path) -> None:
    stored = volume(11, 5, 2, 10, 14)
    for t in range(11):  # more than are kept open
        tifffile.imwrite(
            tmp_path / f"x_t{t}.tif", stored[t], imagej=True, metadata={"axes": "ZCYX"}
        )
    for t in (10, 0, 9):
        dataset = read.open(tmp_path, time=t, spacing_um=GIVEN)
        np.testing.assert_array_equal(read_all(dataset), stored[t].transpose(1, 0, 2, 3))
    assert dataset.time_points == 11


def test_a_folder_of_one_stack_is_read_as_the_stack(tmp_path: Path) -> None:
    stored = volume(5, 10, 14)
    tifffile.imwrite(tmp_path / "a.tif", stored, imagej=True, metadata={"axes": "ZYX"})
    (tmp_path / "notes.txt").write_text("of another kind")
    np.testing.assert_array_equal(read_all(read.open(tmp_path, spacing_um=GIVEN))[0], stored)


def test_series_in_the_names_are_listed_and_chosen(tmp_path: Path) -> None:
    stored = volume(2, 3, 10, 14)
    names = {f"x_Series00{s}_z{z}.tif": stored[s, z] for s in range(2) for z in range(3)}
    folder = fill(tmp_path, names)
    first, second = read.list_series(folder)
    assert "series000: 3 files" in first
    assert "series001: 3 files" in second
    for number in (1, 2):
        dataset = read.open(folder, series=number, spacing_um=GIVEN)
        np.testing.assert_array_equal(read_all(dataset)[0], stored[number - 1])
    assert any("2 series in the names" in note for note in dataset.notes)
    assert "expected 1 to 2" in refusal(folder, UsageError, series=3)


def test_a_pattern_explains_the_names(tmp_path: Path) -> None:
    stored = volume(2, 3, 10, 14)
    names = {f"{z} of day 1, ({c}) [x].tif": stored[c, z] for c in range(2) for z in range(3)}
    folder = fill(tmp_path, names)
    dataset = read.open(folder, pattern="{z} of day *, ({c}) [x].tif", spacing_um=GIVEN)
    np.testing.assert_array_equal(read_all(dataset), stored)
    other = read.open(folder, pattern="{c} of day *, ({z}) [x].tif", spacing_um=GIVEN)
    np.testing.assert_array_equal(read_all(other), stored.transpose(1, 0, 2, 3))
    alone = read.open(folder, pattern="{z} of day 1, (1) [x].tif", spacing_um=GIVEN)
    np.testing.assert_array_equal(read_all(alone)[0], stored[1])
    assert "3 files whose names don't fit the pattern left out" in alone.notes


@pytest.mark.parametrize(
    ("pattern", "expected"),
    [
        ("y_{z}.tif", "none of 3 files matches, such as 'x_z0.tif'"),
        ("x_z{n}.tif", "{n} is unknown"),
        ("{z}{z}", "expected a name with {z}"),
        ("(((", "none of 3 files matches"),
    ],
)
def test_a_pattern_that_is_invalid_or_matches_no_file_is_refused(
    tmp_path: Path, pattern: str, expected: str
) -> None:
    folder = fill(tmp_path, {f"x_z{z}.tif": volume(4, 4) for z in range(3)})
    assert expected in refusal(folder, UsageError, pattern=pattern)


def test_missing_planes_are_refused_by_name(tmp_path: Path) -> None:
    names = {f"x_z{z:03d}_ch{c}.tif": volume(4, 4) for z in range(9) for c in range(2)}
    for gone in ("x_z004_ch1.tif", "x_z008_ch0.tif"):
        del names[gone]
    line = refusal(fill(tmp_path, names))
    assert "found 16 of 18 planes" in line
    assert "missing 'x_z008_ch0.tif', 'x_z004_ch1.tif'" in line


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ([f"x_z{z}.tif" for z in (0, 2, 4, 6)], "4 planes (0 to 6; no file is numbered 1, 3, 5)"),
        ([f"x_z{z}_c{c}.tif" for z in range(3) for c in (1, 3)], "(c1, c3; no file is numbered 2)"),
        ([f"x_t{t}_z{z}.tif" for z in range(3) for t in (0, 1, 4)], "(no file is numbered 2, 3)"),
        ([f"x_z{z}.tif" for z in (10, 11, 12)], "3 planes (10 to 12)"),
    ],
)
def test_numbers_that_no_name_has_are_noted(
    tmp_path: Path, names: list[str], expected: str
) -> None:
    folder = fill(tmp_path, dict.fromkeys(names, volume(4, 4)))
    notes = read.open(folder, spacing_um=GIVEN).notes
    assert any(expected in note for note in notes), notes


def test_numbers_that_are_not_consecutive_are_refused(tmp_path: Path) -> None:
    for numbers in ((1, 2, 900_000_000_000), (20240101, 31, 7), (1, 2, 4, 10**30)):
        folder = fill(tmp_path / str(numbers), {f"x{n}.tif": volume(4, 4) for n in numbers})
        line = refusal(folder)
        assert "missing" in line or "expected consecutive numbers" in line


def test_two_files_of_one_plane_are_refused(tmp_path: Path) -> None:
    names = dict.fromkeys(("x1.tif", "x01.tif", "x2.tif", "x3.tif"), volume(4, 4))
    line = refusal(fill(tmp_path, names))
    assert "two files for one plane, 'x1.tif' and 'x01.tif'" in line or "'x01.tif'" in line


@pytest.mark.parametrize(
    ("odd", "expected"),
    [
        (volume(10, 15), "found 15 x 10 pixels of uint16, expected 14 x 10 pixels of uint16"),
        (volume(10, 14, dtype="uint8"), "found 14 x 10 pixels of uint8, expected"),
        (volume(10, 14, 3, dtype="uint16"), "3 samples a pixel"),
    ],
)
def test_planes_that_differ_are_named(tmp_path: Path, odd: NDArray[Any], expected: str) -> None:
    folder = fill(tmp_path, {f"z{z}.tif": volume(10, 14) for z in range(5)} | {"z3.tif": odd})
    line = refusal(folder)
    assert expected in line
    assert "'z3.tif'" in line


def test_files_that_do_not_form_a_volume_are_refused(tmp_path: Path) -> None:
    flat = fill(tmp_path / "flat", {"DAPI.tif": volume(4, 4), "GFP.tif": volume(4, 4)})
    assert "whose names don't count planes" in refusal(flat)
    for names, expected in (
        (("a b", "c", "d e f"), "named alike"),
        (("p1", "p2"), "expected numbers or words for planes"),
    ):
        mixed = tmp_path / names[0]
        mixed.mkdir()
        for name in names:
            path = mixed / f"{name}.tif"
            tifffile.imwrite(path, volume(5, 9, 9), imagej=True, metadata={"axes": "ZYX"})
        assert expected in refusal(mixed)


def test_other_kinds_of_images_are_left_out_and_noted(tmp_path: Path) -> None:
    stored = volume(5, 10, 14)
    fill(tmp_path, {f"z{z}.tif": stored[z] for z in range(5)})
    fill(tmp_path, {"overview.png": volume(4, 4, dtype="uint8")}, png)
    fill(tmp_path / "below", {"z9.tif": volume(4, 4)})
    fill(tmp_path, {"x_thumb.tif": volume(4, 4), "max projection of all.tif": volume(4, 4)})
    (tmp_path / "._z0.tif").write_bytes(b"of macOS")
    dataset = read.open(tmp_path, spacing_um=GIVEN)
    np.testing.assert_array_equal(read_all(dataset)[0], stored)
    joined = " | ".join(dataset.notes)
    for words in (
        "1 image in folders below left out",
        "7 TIFF are read, 1 other left out",
        "1 thumbnail left out",
        "1 file with another name left out",
    ):
        assert words in joined


def test_a_plane_that_is_cut_short_or_not_an_image_is_named(tmp_path: Path) -> None:
    for suffix, write in (("tif", tiff), ("png", png), ("jpg", pillow)):
        for share in (0.0, 0.3, 0.9):
            folder = tmp_path / f"{suffix}{share}"
            pixels = volume(40, 44, dtype="uint8")
            fill(folder, {f"z{z}.{suffix}": pixels for z in range(4)}, write)
            content = (folder / f"z2.{suffix}").read_bytes()
            (folder / f"z2.{suffix}").write_bytes(content[: int(share * len(content))])
            assert f"z2.{suffix}" in refusal(folder)
        (folder / f"z2.{suffix}").write_text("<html>")
        assert "found an HTML page" in refusal(folder)


def test_a_link_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    tiff(tmp_path / "secret.tif", volume(4, 4))
    folder = fill(tmp_path / "planes", {f"z{z}.tif": volume(4, 4) for z in range(3)})
    (folder / "z3.tif").symlink_to(tmp_path / "secret.tif")
    assert "'z3.tif': leads to" in refusal(folder)


def test_a_png_that_claims_a_huge_size_takes_no_memory(tmp_path: Path) -> None:
    folder = fill(tmp_path, {f"z{z}.png": volume(4, 4, dtype="uint8") for z in range(3)}, png)
    for path in folder.iterdir():
        content = bytearray(path.read_bytes())
        struct.pack_into(">2I", content, 16, 1 << 30, 1 << 30)
        path.write_bytes(content)
    assert "expected at most 4 GiB" in refusal(folder)


def test_only_the_planes_of_a_window_are_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = fill(tmp_path, {f"z{z:02d}.tif": volume(10, 14) for z in range(30)})
    dataset = read.open(folder, spacing_um=GIVEN)
    decoded = []
    once = planes_files._tiff_plane

    def counting(path: str, named: str) -> NDArray[Any]:
        decoded.append(path[-7:])
        return once(path, named)

    monkeypatch.setitem(
        planes_files._FORMATS,
        "tiff",
        planes_files._Format(planes_files._FORMATS["tiff"].head, counting),
    )
    dataset.read(0, Box((3, 0, 0), (5, 2, 2)))
    assert decoded == ["z03.tif", "z04.tif"]
    assert dataset.arrays[0].chunk == (1, 10, 14)


def test_a_folder_of_dicom_with_pictures_stays_dicom(tmp_path: Path) -> None:
    fill(tmp_path, {f"z{z}.png": volume(4, 4, dtype="uint8") for z in range(3)}, png)
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "1").write_bytes(bytes(128) + b"DICM" + bytes(20))
    assert "no DICOM image" in refusal(tmp_path)


def test_other_formats_in_a_folder_of_planes_are_noted(tmp_path: Path) -> None:
    """A preview beside a NIfTI must not silently be read as the volume."""
    (tmp_path / "head.nii.gz").touch()
    png(tmp_path / "preview.png", np.zeros((8, 9), np.uint8))
    with pytest.raises(SourceError, match=r"by its own name \(1 NIfTI or Analyze\)"):
        read.open(tmp_path)
    for number in (1, 2):
        png(tmp_path / f"z{number}.png", np.zeros((8, 9), np.uint8))
    (tmp_path / "preview.png").unlink()
    notes = read.open(tmp_path, spacing_um=(1, 1, 1)).notes
    assert any("also holds 1 NIfTI or Analyze" in note for note in notes)
