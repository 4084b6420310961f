"""Each file of a series is parsed once, and is not mistaken for another of the series."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import pytest
from pydicom import uid

from stereocell import read
from stereocell.model.errors import SourceError
from stereocell.read.formats.dicom import image as dicom_image
from stereocell.read.formats.dicom.header import read_frames
from stereocell.read.formats.dicom.known_headers import KnownHeaders
from stereocell.read.formats.dicom.pixels import decode, dtype_of
from support.dicom_reading import whole
from support.dicom_series import grid, setting, write_series

SHAPE = (6, 20, 24)


def test_a_series_is_parsed_once_and_its_pixels_are_read_at_the_known_offsets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    paths = write_series(tmp_path / "s", grid("axial"), SHAPE)
    parsed: Counter[str] = Counter()
    honest = pydicom.dcmread

    def count(file: Any, *args: Any, **given: Any) -> Any:
        parsed[str(getattr(file, "name", file))] += 1
        return honest(file, *args, **given)

    monkeypatch.setattr(pydicom, "dcmread", count)
    voxels = whole(read.open(tmp_path / "s"))
    assert voxels.max() > 0
    assert parsed == {str(path): 1 for path in paths}


def as_(syntax: str) -> Callable[[pydicom.FileDataset], None]:
    def change(ds: pydicom.FileDataset) -> None:
        ds.file_meta.TransferSyntaxUID = syntax
        ds.set_original_encoding(
            syntax == uid.ImplicitVRLittleEndian, syntax != uid.ExplicitVRBigEndian
        )
        if syntax == uid.ExplicitVRBigEndian:
            width = {"OB": 1, "OW": 2}[ds["PixelData"].VR]
            ds.PixelData = np.frombuffer(ds.PixelData, f"<u{width}").byteswap().tobytes()

    return change


@pytest.mark.parametrize(
    ("dtype", "bits", "syntax", "is_plain"),
    [
        (np.int16, None, uid.ExplicitVRLittleEndian, True),
        (np.uint16, 12, uid.ExplicitVRLittleEndian, True),
        (np.int16, 12, uid.ImplicitVRLittleEndian, True),
        (np.uint8, None, uid.ImplicitVRLittleEndian, True),
        (np.uint8, None, uid.ExplicitVRLittleEndian, True),
        (np.int16, None, uid.ExplicitVRBigEndian, False),
    ],
)
def test_values_read_at_their_offset_equal_those_of_pydicom(
    tmp_path: Path, dtype: Any, bits: int | None, syntax: str, is_plain: bool
) -> None:
    paths = write_series(
        tmp_path / "s",
        grid("axial"),
        SHAPE,
        dtype=dtype,
        bits=bits,
        slope=2.0,
        intercept=-3.0,
        change=as_(syntax),
    )
    frames = [frame for i, path in enumerate(paths) for frame in read_frames(path, i)]
    assert [frame.start is not None for frame in frames] == [is_plain] * len(frames)
    kind = dtype_of(frames)
    found = decode(frames, paths, kind, "s")
    decoded = decode([replace(frame, start=None) for frame in frames], paths, kind, "s")
    assert np.array_equal(found, decoded)
    assert len(np.unique(found)) > 20


def test_a_file_truncated_after_its_header_was_read_is_refused_in_one_line(
    tmp_path: Path,
) -> None:
    paths = write_series(tmp_path / "s", grid("axial"), SHAPE)
    frames = [frame for i, path in enumerate(paths) for frame in read_frames(path, i)]
    paths[3].write_bytes(paths[3].read_bytes()[:-10])
    with pytest.raises(
        SourceError, match="file 4 of 6 in the order of names: found pixels that can't"
    ):
        decode(frames, paths, dtype_of(frames), "s")


def test_headers_that_differ_in_any_element_are_distinguished(tmp_path: Path) -> None:
    """Each slice after the first states one element that the earlier slices don't state."""
    changes = [
        setting(),
        setting(RescaleSlope=3.0),
        setting(RescaleIntercept=-7.0),
        setting(PixelSpacing=[0.5, 0.25]),
        setting(ImageOrientationPatient=[0, 1, 0, 0, 0, -1]),
        setting(ImageType=["ORIGINAL", "PRIMARY", "P", "ND"]),
        setting(EchoTime=4.5),
        setting(SliceLocation=12.0),
        setting(PixelPaddingValue=5),
        setting(BitsStored=12, HighBit=11),
        setting(PatientPosition="FFP"),
        setting(SeriesDescription="another"),
        setting(Modality="CT", RescaleType="HU"),
        setting(PhotometricInterpretation="MONOCHROME1"),
    ]
    rest = iter(changes)
    paths = write_series(
        tmp_path / "s", grid("axial"), (len(changes), 20, 24), change=lambda ds: next(rest)(ds)
    )
    known = KnownHeaders()
    together = [read_frames(path, i, known) for i, path in enumerate(paths)]
    assert together == [read_frames(path, i) for i, path in enumerate(paths)]
    apart = {
        repr(replace(one, file=0, instance=b"", number=0, position=(0, 0, 0), start=0))
        for (one,) in together
    }
    assert len(apart) == len(changes)


def test_kept_headers_hold_nothing_that_identifies_a_patient(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    secrets = ("Doe^Jane", "MRN-4711", "1.2.840.99.4711", "knee of Jane")
    write_series(
        tmp_path / "s",
        grid("axial"),
        SHAPE,
        series=secrets[2],
        change=setting(PatientName=secrets[0], PatientID=secrets[1], SeriesDescription=secrets[3]),
    )
    made: list[KnownHeaders] = []

    class Watched(KnownHeaders):
        def __init__(self) -> None:
            super().__init__()
            made.append(self)

    monkeypatch.setattr(dicom_image, "KnownHeaders", Watched)
    read.open(tmp_path / "s")
    (known,) = made
    kept = repr(known._values)
    assert "encoding" in kept
    for secret in secrets:
        assert secret not in kept
        assert secret.encode().hex() not in kept
