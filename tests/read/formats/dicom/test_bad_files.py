"""DICOM that doesn't make a volume is refused in one line, or left out with a note."""

import os
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pydicom
import pytest
from pydicom.encaps import encapsulate, generate_frames
from pydicom.uid import (
    MPEG2MPML,
    BasicTextSRStorage,
    DeflatedExplicitVRLittleEndian,
    JPEG2000Lossless,
    JPEGBaseline8Bit,
    JPEGLosslessSV1,
    JPEGLSLossless,
    RLELossless,
    RTStructureSetStorage,
    generate_uid,
)

from stereocell import read
from stereocell.model.errors import SourceError
from stereocell.read.formats.dicom import stored_values
from stereocell.read.formats.dicom.stored_values import plane_size
from support.dicom_reading import error, whole
from support.dicom_series import compress, grid, image, save, write_enhanced, write_series

SHAPE = (6, 30, 26)
Change = Callable[[pydicom.Dataset], None]


def series(folder: Path, change: Change = lambda ds: None) -> list[Path]:
    return write_series(folder, grid(shape=SHAPE), SHAPE, change=change)


def refusal(source: Path) -> str:
    with pytest.raises(SourceError) as caught:
        whole(read.open(source))
    line = str(caught.value)
    assert "\n" not in line
    assert "expected" in line
    assert caught.value.__cause__ is None  # its text might quote the file
    return line


def without(tag: str) -> Change:
    return lambda ds: ds.__delattr__(tag)


def setting(**values: object) -> Change:
    def change(ds: pydicom.Dataset) -> None:
        for name, value in values.items():
            setattr(ds, name, value)

    return change


def colours(ds: pydicom.Dataset) -> None:
    ds.SamplesPerPixel, ds.PhotometricInterpretation, ds.PlanarConfiguration = 3, "RGB", 0
    ds.BitsAllocated = ds.BitsStored = 8
    ds.HighBit = 7
    ds.PixelData = bytes(3 * ds.Rows * ds.Columns)


def junk_in(syntax: str) -> Change:
    def change(ds: pydicom.Dataset) -> None:
        ds.file_meta.TransferSyntaxUID = syntax
        junk = np.random.default_rng(0).bytes(400)
        ds["PixelData"] = pydicom.DataElement("PixelData", "OB", encapsulate([junk]))
        ds["PixelData"].is_undefined_length = True

    return change


REFUSED: dict[str, tuple[Change, str]] = {
    "no position": (without("ImagePositionPatient"), "6 without a place in the patient"),
    "no orientation": (without("ImageOrientationPatient"), "6 without a place"),
    "no spacing": (without("PixelSpacing"), "6 without a PixelSpacing above 0"),
    "spacing of 0": (setting(PixelSpacing=[0, 1]), "6 without a PixelSpacing"),
    "orientation of no frame": (
        setting(ImageOrientationPatient=[1, 0, 0, 1, 0, 0]), "6 without a place"
    ),
    "two numbers for a place": (setting(ImagePositionPatient=[1, 2]), "6 without a place"),
    "all at one place": (setting(ImagePositionPatient=[0, 0, 0]), "at least 2 slices: found 1"),
    "absurd spacing": (
        setting(PixelSpacing=[1e9, 1e9]),
        r"6 with an implausible PixelSpacing \(1e\+09 and 1e\+09 mm\)",
    ),
    "colours": (colours, "6 in colour"),
    "no pixels": (without("PixelData"), "6 without pixels"),
    "one bit": (setting(BitsAllocated=1, BitsStored=1, HighBit=0), "6 with 1 bits per pixel"),
    "impossible bits": (setting(BitsStored=17), "6 with 17 bits"),
    "slope of 0": (setting(RescaleSlope=0), "6 with an unusable rescale slope"),
    "planes larger than their pixels": (setting(Rows=4000), "6 cut short"),
    "terabytes claimed": (setting(Rows=65535, Columns=65535), "6 cut short"),
    "film": (junk_in(MPEG2MPML), "6 compressed in a way that is not supported"),
    "junk in J2K": (junk_in(JPEG2000Lossless), "file 1 of 6 .* found pixels that can't be decoded"),
    "junk in JPEG-LS": (junk_in(JPEGLSLossless), "pixels that can't be decoded"),
    "junk in RLE": (junk_in(RLELossless), "pixels that can't be decoded"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_a_bad_source_is_refused_in_one_line(
    tmp_path: Path, name: str, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    change, words = REFUSED[name]
    series(tmp_path / "s", change)
    assert re.search(words, refusal(tmp_path / "s"))
    assert caplog.text == ""
    assert capfd.readouterr() == ("", "")


def test_stated_sizes_of_compressed_pixels_are_checked_before_memory_is_allocated(
    tmp_path: Path,
) -> None:
    def claim(ds: pydicom.Dataset) -> None:
        junk_in(JPEG2000Lossless)(ds)
        ds.Rows = ds.Columns = 65535

    series(tmp_path / "s", claim)
    assert "expected at most 4 GiB" in refusal(tmp_path / "s")


@pytest.mark.parametrize(
    "syntax", [JPEGBaseline8Bit, JPEGLosslessSV1, JPEG2000Lossless, JPEGLSLossless]
)
def test_streams_state_their_size(tmp_path: Path, syntax: str) -> None:
    kind = np.uint8 if syntax == JPEGBaseline8Bit else np.uint16
    (path, _) = write_series(tmp_path, grid(), (2, 40, 36), dtype=kind)
    compress(path, syntax)
    (stream,) = generate_frames(pydicom.dcmread(path).PixelData, number_of_frames=1)
    assert plane_size(stream) == (40, 36)


# the size 40 x 36 as streams state it, and a false size in its place
_SIZES = {
    JPEG2000Lossless: (b"\0\0\0\x28", b"\0\0\xea\x60"),
    JPEGLSLossless: (b"\0\x28\0\x24", b"\xea\x60\xea\x60"),
}


@pytest.mark.parametrize("syntax", _SIZES)
def test_streams_that_state_a_larger_size_than_the_header_are_not_decoded(
    tmp_path: Path, syntax: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    shape = (3, 40, 36)
    paths = write_series(tmp_path / "s", grid(shape=shape), shape, dtype=np.uint16)
    decoded = []
    honest = stored_values.iter_pixels
    monkeypatch.setattr(
        stored_values, "iter_pixels", lambda *a, **k: decoded.append(1) or honest(*a, **k)
    )
    stated, claimed = _SIZES[syntax]
    for path in paths:
        compress(path, syntax)
    whole(read.open(tmp_path / "s"))
    assert len(decoded) == 3
    for path in paths:
        content = path.read_bytes()
        start = content.index(b"\xff\x51" if syntax == JPEG2000Lossless else b"\xff\xd8", 132)
        path.write_bytes(content[:start] + content[start:].replace(stated, claimed, 1))
    assert "pixels that can't be decoded" in refusal(tmp_path / "s")
    assert len(decoded) == 3


@pytest.mark.slow
def test_streams_on_which_gdcm_aborts_are_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """GDCM runs in another process: neither its end nor its output reaches this one."""
    shape = (2, 40, 36)
    random = np.random.default_rng(0)
    for path in write_series(tmp_path / "s", grid(shape=shape), shape, dtype=np.uint16):
        compress(path, JPEGLosslessSV1)
        content = np.frombuffer(path.read_bytes(), np.uint8).copy()
        start = content.tobytes().index(b"\xff\xda")
        content[start + 14 : -8] = random.integers(0, 256, len(content) - start - 22)
        content[start : start + 14] = 0xFF
        path.write_bytes(content.tobytes())
    assert "pixels that can't be decoded" in refusal(tmp_path / "s")
    assert capfd.readouterr() == ("", "")


def test_deflated_files_are_not_decompressed(tmp_path: Path) -> None:
    def deflate(ds: pydicom.Dataset) -> None:
        ds.file_meta.TransferSyntaxUID = DeflatedExplicitVRLittleEndian

    series(tmp_path / "s", deflate)
    assert "6 deflated as a whole" in refusal(tmp_path / "s")


def test_folder_without_dicom_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("nothing")
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "b").write_bytes(bytes(3000))
    assert "found 2 files: 2 not DICOM" in refusal(tmp_path)


def test_files_without_images_are_named_by_their_kind(tmp_path: Path) -> None:
    for name, kind in (("a", RTStructureSetStorage), ("b", BasicTextSRStorage), ("c", "1.2.3.4.5")):
        ds = image(np.zeros((8, 9), np.int16), grid(), 0)
        del ds.PixelData, ds.Rows, ds.Columns
        ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = kind
        save(ds, tmp_path / "s" / name)
    line = refusal(tmp_path / "s")
    assert "1 without pixels (RT Structure Set Storage)" in line
    assert "1 without pixels (Basic Text SR Storage)" in line
    assert "1 without pixels;" in line
    assert "1.2.3.4.5" not in line  # private data may identify the patient
    assert "found 1 file: 1 without pixels" in refusal(save(ds, tmp_path / "t" / "a").parent)


def test_empty_folder_is_refused(tmp_path: Path) -> None:
    assert "found an empty folder, expected slices" in refusal(tmp_path)


def test_several_frames_without_places_are_refused(tmp_path: Path) -> None:
    ds = image(np.zeros((4, 8, 9), np.int16), grid(), 0)
    ds.NumberOfFrames = 4
    path = save(ds, tmp_path / "f.dcm")
    assert "several frames but no place for each" in refusal(path)


def test_truncated_files_are_left_out_and_their_gap_is_noted(tmp_path: Path) -> None:
    paths = series(tmp_path / "s")
    paths[2].write_bytes(paths[2].read_bytes()[:-500])
    notes = read.open(tmp_path / "s").notes
    assert any(f"1 missing slice of {len(paths)} (" in note for note in notes)
    assert any("1 cut short" in note for note in notes)


def test_too_few_slices_for_their_gaps_are_refused(tmp_path: Path) -> None:
    write_series(tmp_path / "s", grid(), indices=[0, 1, 2, 40])
    assert "37 of 41 slices are missing" in refusal(tmp_path / "s")


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.slow
def test_garbled_headers_raise_no_other_error(tmp_path: Path, seed: int) -> None:
    """Bytes are changed at random; a series still opens, or is refused in one line."""
    random = np.random.default_rng(seed)
    write_enhanced(tmp_path / "e", grid(shape=(3, 8, 9)), (3, 8, 9))
    content = np.frombuffer((tmp_path / "e").read_bytes(), np.uint8)
    for _ in range(60):
        garbled = content.copy()
        places = random.integers(132, len(content), random.integers(1, 12))
        garbled[places] = random.integers(0, 256, len(places))
        garbled = garbled[: len(garbled) if random.random() < 0.7 else random.integers(200, 2000)]
        (tmp_path / "e").write_bytes(garbled.tobytes())
        with suppress(SourceError):
            whole(read.open(tmp_path / "e"))


def test_files_without_preamble_are_read(tmp_path: Path) -> None:
    for path in series(tmp_path / "s"):
        path.write_bytes(path.read_bytes()[132:])
    assert error(read.open(tmp_path / "s")) <= 0.51


def test_pipes_in_a_folder_are_skipped(tmp_path: Path) -> None:
    series(tmp_path / "s")
    os.mkfifo(tmp_path / "s" / "pipe")  # opening it would wait forever
    assert read.open(tmp_path / "s").notes == ("file left out: 1 not DICOM",)


def test_a_folder_of_another_format_is_named_by_its_content(tmp_path: Path) -> None:
    for name in ("JANE.nii", "DOE.nii.gz"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "plate.zarr").mkdir()
    (tmp_path / "notes of JANE.txt").write_bytes(b"")
    message = refusal(tmp_path)
    assert "by its own name (2 NIfTI or Analyze, 1 OME-Zarr)" in message
    assert "DOE" not in message


def test_a_preamble_like_that_of_a_tiff_changes_nothing(tmp_path: Path) -> None:
    """DICOM leaves the preamble to the writer: some files are valid as TIFF, too."""
    path = tmp_path / "both of mine"
    write_enhanced(path, grid(shape=SHAPE), SHAPE)
    content = path.read_bytes()
    path.write_bytes(b"II*\0" + content[4:])
    assert whole(read.open(path)).shape == whole(read.open(_plain(tmp_path, content))).shape


def _plain(folder: Path, content: bytes) -> Path:
    path = folder / "plain.dcm"
    path.write_bytes(content)
    return path


def write_concatenation(folder: Path, parts: int) -> list[Path]:
    """Write an enhanced image as several files, each with some of its frames."""
    folder.mkdir()
    shape = (parts * 3, *SHAPE[1:])
    ds = pydicom.dcmread(write_enhanced(folder / "all", grid(shape=shape), shape, seed=None))
    groups, size = list(ds.PerFrameFunctionalGroupsSequence), len(ds.PixelData) // parts
    pixels, whole_uid = ds.PixelData, ds.SOPInstanceUID
    (folder / "all").unlink()
    paths = [folder / f"part{number}" for number in range(1, parts + 1)]
    for number, path in enumerate(paths):
        ds.SOPInstanceUID = ds.file_meta.MediaStorageSOPInstanceUID = generate_uid(
            entropy_srcs=[str(number)]
        )
        ds.SOPInstanceUIDOfConcatenationSource = whole_uid
        ds.ConcatenationUID = "1.2.826.0.3"
        ds.InConcatenationNumber, ds.InConcatenationTotalNumber = number + 1, parts
        ds.ConcatenationFrameOffsetNumber = 3 * number
        ds.NumberOfFrames = 3
        ds.PerFrameFunctionalGroupsSequence = groups[3 * number : 3 * number + 3]
        ds.PixelData = pixels[number * size : (number + 1) * size]
        ds.save_as(path)
    return paths


@pytest.mark.parametrize("lost", [0, 1, 2])
def test_a_lost_file_of_an_image_in_several_files_is_refused(tmp_path: Path, lost: int) -> None:
    paths = write_concatenation(tmp_path / "parts", 3)
    assert read.open(tmp_path / "parts").levels[0].shape == (30, 9, 26)
    paths[lost].unlink()
    assert "found 2 of 3 files of an image that is stored in several" in refusal(tmp_path / "parts")
