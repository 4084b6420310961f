"""No byte of a patient's identity leaves the reader: none is found in any output."""

import base64
import gzip
import logging
import shutil
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pydicom
import pytest
import zstandard
from PIL import Image, PngImagePlugin
from pxr import Sdf
from pydicom.datadict import DicomDictionary
from pydicom.dataset import Dataset
from pydicom.uid import JPEGLosslessSV1

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.model.errors import SourceError
from stereocell.serve.brick_library import BrickLibrary
from stereocell.steps.open_source import forget_sources
from support import dicom_mosaics, identity_search
from support.dicom_segmentations import write_segmentation
from support.dicom_series import compress, grid, write_enhanced, write_series

# Every text contains TEXT and a count, every UID NUMBER, every date DATE, every time TIME.
TEXT, NUMBER, DATE, TIME = "ZQ7KX9WV", "73194628150937", "19370214", "113355"
WORDS = [TEXT, NUMBER, DATE, TIME + ".7719"]
SHAPE = (10, 30, 26)
# Elements that the reader must understand
_NEEDED = {
    "SOPClassUID", "MediaStorageSOPClassUID", "TransferSyntaxUID", "SpecificCharacterSet",
    "Modality", "PhotometricInterpretation", "PixelSpacing", "ImagePositionPatient",
    "ImageOrientationPatient", "RescaleType", "SOPInstanceUID", "SeriesInstanceUID",
    "FrameOfReferenceUID", "InstanceNumber", "RescaleSlope", "RescaleIntercept", "NumberOfFrames",
}  # fmt: skip
_LONG = ("LO", "LT", "PN", "SH", "ST", "UC", "UR", "UT", "AE", "CS")


def marked(vr: str, count: int) -> str | None:
    if vr in _LONG:
        return f"{TEXT}{count:05d}"
    values = {"UI": f"1.2.{NUMBER}.{count}", "DA": DATE, "TM": f"{TIME}.7719"}
    return values.get(vr, f"{DATE}{TIME}.7719" if vr == "DT" else None)


def mark(ds: Dataset, group: Callable[[int], bool]) -> int:
    """Put a marker into each text, UID, date and time element of the standard's dictionary."""
    count = 0
    for tag, (vr, *_, keyword) in DicomDictionary.items():
        value = marked(vr.split(" ")[0], count)
        if value is None or keyword in _NEEDED or not keyword or not group(tag >> 16):
            continue
        ds.add_new(tag, vr.split(" ")[0], value)
        count += 1
    return count


def mark_all(ds: Any) -> None:
    assert mark(ds, lambda group: 8 <= group < 0x6000 and group != 0x28) > 1000
    assert mark(ds.file_meta, lambda group: group == 2) >= 3
    serial = ds.InstanceNumber
    ds.SOPInstanceUID = ds.file_meta.MediaStorageSOPInstanceUID = f"1.2.{NUMBER}.9.{serial}"
    ds.SeriesInstanceUID = f"1.2.{NUMBER}.8"
    ds.FrameOfReferenceUID = f"1.2.{NUMBER}.7"
    inner = Dataset()
    mark(inner, lambda group: group in (8, 0x10, 0x40))
    for keyword in (
        "OtherPatientIDsSequence",
        "ReferencedStudySequence",
        "RequestAttributesSequence",
    ):
        setattr(ds, keyword, [inner])
    block = ds.private_block(0x0029, f"{TEXT} CREATOR", create=True)
    block.add_new(1, "LO", f"{TEXT} private")
    block.add_new(2, "UN", f"{TEXT} unknown".encode())
    block.add_new(3, "SQ", [inner])
    ds.preamble = (f"{TEXT} preamble".encode() * 10)[:128]


@pytest.fixture(scope="module")
def series(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scan")
    affine = grid("coronal", SHAPE, (3, 2, 2.2))
    write_series(folder / "a", affine, SHAPE, change=mark_all, name=f"{TEXT}_{{}}.dcm".format)
    return folder


def enhanced(folder: Path) -> None:
    path = write_enhanced(folder / f"{TEXT}.dcm", grid(shape=(4, 8, 9)), (4, 8, 9))
    ds = pydicom.dcmread(path)
    mark_all(ds)
    shared = ds.SharedFunctionalGroupsSequence[0]
    for group in [shared, *ds.PerFrameFunctionalGroupsSequence]:
        for sequence in [group, *(item for element in group for item in element.value)]:
            mark(sequence, lambda number: number in (8, 0x10, 0x40))
    for group in ds.PerFrameFunctionalGroupsSequence:
        content = group.FrameContentSequence[0]
        content.StackID, content.FrameLabel = TEXT, f"{TEXT} label"
    ds.save_as(path)


def jpeg(folder: Path) -> None:
    shape = (4, 20, 18)
    paths = write_series(
        folder,
        grid(shape=shape),
        shape,
        dtype=np.uint16,
        change=mark_all,
        name=f"{TEXT}_{{}}".format,
    )
    for path in paths:
        compress(path, JPEGLosslessSV1)
        packed = pydicom.dcmread(path)
        mark_all(packed)  # GDCM drops some elements
        packed.save_as(path)


def mosaic(folder: Path) -> None:
    def change(ds: pydicom.Dataset) -> None:
        mark_all(ds)
        ds.ImageType = [TEXT.upper()[:16], "MOSAIC"]
        header = dicom_mosaics.csa(
            NumberOfImagesInMosaic=["7"],
            SliceNormalVector=["0", "0", "1"],
            ReferencingPhysicianName=[TEXT, NUMBER, DATE, TIME],
        )
        ds[0x00291010].value = header + bytes(len(header) % 2)

    affine = grid(shape=dicom_mosaics.SHAPE, spacing=dicom_mosaics.SPACING)
    dicom_mosaics.write_mosaic(folder / f"{TEXT}.dcm", affine, change=change)


def packed_nifti(folder: Path) -> None:
    values = np.arange(8 * 9 * 10, dtype=np.float32).reshape(8, 9, 10)
    values[0, 0, 0] = np.nan  # makes the reader print a note
    nifti = nibabel.Nifti1Image(values, np.eye(4))
    for field in ("descrip", "db_name", "aux_file", "intent_name"):
        nifti.header[field] = TEXT
    for code in ("comment", "dicom", "afni"):
        nifti.header.extensions.append(
            nibabel.nifti1.Nifti1Extension(code, f"{TEXT} {NUMBER} {DATE} {TIME}.7719".encode())
        )
    nibabel.save(nifti, folder / "a.nii.gz")


@pytest.mark.parametrize("write", [enhanced, jpeg, mosaic, packed_nifti])
def test_no_identity_is_in_results_of_other_kinds_of_file(
    write: Callable[[Path], None],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.DEBUG)
    folder, out = tmp_path / "in", tmp_path / "out"
    folder.mkdir()
    write(folder)
    source = str(folder)
    if write is packed_nifti:  # plan.json keeps the path that the user typed
        source = str(folder / "a.nii.gz")
    assert main(["plan", source, "-o", str(out)]) == 0
    assert main(["slices", source, "-o", str(out / "slices")]) == 0
    if write is not packed_nifti:
        assert main(["plan", source, "-o", str(out), "--series", "list"]) == 0
    printed = capfd.readouterr()
    assert (write is packed_nifti) == ("NaN" in printed.out + printed.err)
    texts = {"stdout": printed.out, "stderr": printed.err, "log": caplog.text}
    assert identity_search.find(out, WORDS, texts) == []
    assert {hit.split(" ")[0] for hit in identity_search.find(folder, WORDS)} == set(WORDS)


@pytest.mark.slow
def test_no_identity_is_in_any_byte_of_a_build(
    series: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.DEBUG)
    out = tmp_path / "out"
    assert main(["build", str(series), "-o", str(out), "--workers", "1", "--grid", "2x1"]) == 0
    assert main(["slices", str(series), "-o", str(out / "slices")]) == 0
    assert main(["build", str(series), "-o", str(out), "--series", "list"]) == 0
    assert main(["export", str(out), str(out / "scene.html")]) == 0
    library = BrickLibrary(out / "bundle", out / "bricks")  # the cache of `serve`
    for tile, channel in library.volumes():
        library.open(tile, channel)
    assert list((out / "bricks").iterdir())
    printed = capfd.readouterr()
    texts = {"stdout": printed.out, "stderr": printed.err, "log": caplog.text}
    assert "MR, coronal" in printed.out
    assert identity_search.find(out, WORDS, texts) == []
    assert sum(file.stat().st_size for file in out.rglob("*") if file.is_file()) > 100_000
    # The same search finds all words in the source.
    assert {hit.split(" ")[0] for hit in identity_search.find(series, WORDS)} == set(WORDS)


def test_no_identity_of_a_segmentation_is_in_the_results_of_its_objects(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.DEBUG)
    folder, out = tmp_path / "in", tmp_path / "out"
    voxels = np.zeros((10, 14, 12, 2), np.uint8)
    voxels[2:8, 2:6, 3:9, 0] = voxels[2:8, 8:12, 3:9, 1] = 1

    def change(ds: Dataset) -> None:
        ds.SegmentSequence[1].SegmentedPropertyTypeCodeSequence[0].CodeValue = f"{TEXT} code"
        mark_all(ds)
        ds.SegmentationType = "BINARY"
        for group in ds.PerFrameFunctionalGroupsSequence:
            mark(group.FrameContentSequence[0], lambda number: number in (8, 0x18))
        for item in ds.SegmentSequence:
            item.SegmentLabel = item.SegmentDescription = item.TrackingID = f"{TEXT} of her"
            item.TrackingUID = f"1.2.{NUMBER}.6"
            kind = item.SegmentedPropertyTypeCodeSequence[0]
            item.SegmentedPropertyCategoryCodeSequence[0].CodeMeaning = f"{TEXT} category"
            kind.CodeMeaning = f"{TEXT} meaning"

    write_segmentation(folder, "BINARY", voxels, change)
    shutil.rmtree(folder / "images")
    source = str(folder)
    for phase in (["plan", source, "--labels", "."], ["units"], ["stage"], ["bundle"]):
        assert main([*phase, "-o", str(out)] if phase[0] == "plan" else [*phase, str(out)]) == 0
    table = (out / "bundle/channels/labels/objects.json").read_text("utf-8")
    assert "Segment 2" in table
    printed = capfd.readouterr()
    texts = {"stdout": printed.out, "stderr": printed.err, "log": caplog.text}
    assert identity_search.find(out, WORDS, texts) == []
    assert {hit.split(" ")[0] for hit in identity_search.find(folder, WORDS)} == set(WORDS)


def test_a_leak_put_in_by_hand_is_found(
    series: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from stereocell.read.formats.dicom import image as dicom

    honest = dicom.read_image

    def leaky(location: Any, *, series: int = 0) -> Any:
        header = pydicom.dcmread(next(Path(location.source).rglob("*.dcm")))
        return replace(honest(location, series=series), title=str(header.PatientName))

    monkeypatch.setattr(dicom, "read_image", leaky)
    forget_sources()
    assert main(["plan", str(series), "-o", str(tmp_path / "out")]) == 0
    forget_sources()
    assert f"{TEXT} as bytes in plan.json" in identity_search.find(tmp_path / "out", WORDS)


def put_usdc(path: Path, word: str) -> None:
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    layer.documentation = f"{word * 40} and {word * 40}"
    layer.Export(str(path.with_suffix(".usdc")))


def put_png(path: Path, word: str) -> None:
    info = PngImagePlugin.PngInfo()
    info.add_itxt("comment", word, zip=True)
    Image.new("L", (4, 4)).save(path.with_suffix(".png"), pnginfo=info)


def put_zip(path: Path, word: str) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a", word * 9)


LEAKS: dict[str, Callable[[Path, str], Any]] = {
    "bytes": lambda path, word: path.write_bytes(b"\0\1" + word.encode()),
    "lower case": lambda path, word: path.write_text(word.lower()),
    "UTF-16LE": lambda path, word: path.write_bytes(b"\7" + word.encode("utf-16-le")),
    "UTF-16BE": lambda path, word: path.write_bytes(word.encode("utf-16-be")),
    "hex": lambda path, word: path.write_text(word.encode().hex().upper()),
    "name": lambda path, word: path.with_name(f"a{word}b").mkdir(),
    "gzip": lambda path, word: path.write_bytes(gzip.compress(word.encode() * 9)),
    "zstd": lambda path, word: path.write_bytes(b"abc" + zstandard.compress(word.encode() * 9)),
    "zip": put_zip,
    "png": put_png,
    "usdc": put_usdc,
    **{
        f"base64 after {n}": lambda path, word, n=n: path.write_bytes(
            base64.b64encode(b"x" * n + word.encode() + b"tail")
        )
        for n in range(3)
    },
}


@pytest.mark.parametrize("name", LEAKS)
@pytest.mark.parametrize("word", WORDS)
def test_the_search_finds_every_form(tmp_path: Path, name: str, word: str) -> None:
    LEAKS[name](tmp_path / "file", word)
    assert identity_search.find(tmp_path, [word])


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def garble(path: Path) -> None:
    path.write_bytes(path.read_bytes().replace(b"UI", b"\xff\xff", 5))


def misplace(path: Path) -> None:
    ds = pydicom.dcmread(path)
    with pydicom.config.disable_value_validation():
        ds.add_new("ImagePositionPatient", "LO", [TEXT, TEXT, TEXT])
        ds.save_as(path)


def misname(path: Path) -> None:
    ds = pydicom.dcmread(path)
    ds.Modality = TEXT
    ds.save_as(path)


def compressed_junk(path: Path) -> None:
    ds = pydicom.dcmread(path)
    ds.file_meta.TransferSyntaxUID = pydicom.uid.RLELossless
    junk = pydicom.encaps.encapsulate([TEXT.encode() * 20])
    ds["PixelData"] = pydicom.DataElement("PixelData", "OB", junk)
    ds["PixelData"].is_undefined_length = True
    ds.save_as(path)


@pytest.mark.parametrize("spoil", [cut, garble, misplace, misname, compressed_junk])
@pytest.mark.parametrize("share", ["one", "all"])
def test_messages_about_damaged_files_contain_no_identity(
    series: Path,
    tmp_path: Path,
    spoil: Callable[[Path], None],
    share: str,
    capfd: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    shutil.copytree(series, tmp_path / "s")
    files = sorted((tmp_path / "s").rglob("*.dcm"))
    for file in files[:1] if share == "one" else files:
        spoil(file)
    shown = ""
    try:
        dataset = read.open(tmp_path / "s")
        shown = repr((dataset.name, dataset.modality, dataset.channels, dataset.notes))
        dataset.read(0, dataset.levels[0].box)
    except SourceError as error:
        shown += f"{error} {error.__cause__!r}"
    out, err = capfd.readouterr()
    assert shown
    assert (
        identity_search.find(tmp_path / "none", WORDS, {"printed": shown + out + err + caplog.text})
        == []
    )


def test_texts_and_name_of_a_nifti_file_are_not_copied(tmp_path: Path) -> None:
    nifti = nibabel.Nifti1Image(np.arange(8 * 9 * 10, dtype=np.int16).reshape(8, 9, 10), np.eye(4))
    nifti.header["descrip"] = nifti.header["db_name"] = nifti.header["aux_file"] = TEXT
    nifti.header["intent_name"] = TEXT
    (tmp_path / "in").mkdir()
    nibabel.save(nifti, tmp_path / "in" / f"{TEXT}.nii")
    dataset = read.open(tmp_path / "in" / f"{TEXT}.nii")
    shown = repr((dataset.name, dataset.modality, dataset.channels, dataset.notes))
    assert TEXT not in shown
