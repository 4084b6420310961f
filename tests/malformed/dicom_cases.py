# ruff: noqa: E501  (tables of cases)
"""DICOM: files cut short and flipped; tags that are missing, contradictory or claim large sizes."""

import os
import random
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pydicom
from pydicom.encaps import encapsulate

from malformed.cases import ODD_NAMES, Case, copied, plan, slices
from support.dicom_mosaics import csa

KIND = "dicom"
Change = Callable[[Any], None]


def cases() -> Iterator[Case]:
    yield from _tags()
    yield from _bytes()
    yield from _pixels()
    yield from _folders()


def _each(name: str, change: Change, expect: str = "refused", some: slice = slice(None)) -> Case:
    """A series whose headers are changed, in all its files or in some."""

    def make(base: Path, folder: Path) -> list[str]:
        series = copied(base, folder, "series")
        for path in sorted(series.iterdir())[some]:
            ds = pydicom.dcmread(path)
            with pydicom.config.disable_value_validation():
                change(ds)
                ds.save_as(path)
        return slices("series")

    return Case(name, KIND, make, expect)


def _with(**values: Any) -> Change:
    def change(ds: Any) -> None:
        for name, value in values.items():
            setattr(ds, name, value)

    return change


def _without(*names: str) -> Change:
    def change(ds: Any) -> None:
        for name in names:
            delattr(ds, name)

    return change


def _tags() -> Iterator[Case]:
    one, last = slice(0, 1), slice(5, 6)
    for name in (
        "ImagePositionPatient",
        "ImageOrientationPatient",
        "PixelSpacing",
        "Rows",
        "BitsAllocated",
        "PixelData",
    ):
        yield _each(f"without {name}", _without(name))
        yield _each(f"one without {name}", _without(name), "any", one)
    yield _each(
        "without geometry",
        _without("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing"),
    )
    for name, change in {
        "spacing 0": _with(PixelSpacing=[0, 1]), "spacing below 0": _with(PixelSpacing=[-1, 1]),
        "spacing 1e-30": _with(PixelSpacing=["1e-30", 1]), "spacing 1e30": _with(PixelSpacing=["1e30", "1e30"]),
        "one number of spacing": _with(PixelSpacing=[1]), "positions alike": _with(ImagePositionPatient=[0, 0, 0]),
        "positions 1e300": _with(ImagePositionPatient=["1e300", 0, 0]),
        "orientation 0": _with(ImageOrientationPatient=[0] * 6), "orientation parallel": _with(ImageOrientationPatient=[1, 0, 0, 1, 0, 0]),
        "rows 0": _with(Rows=0), "rows 65535": _with(Rows=65535, Columns=65535), "rows of another size": _with(Rows=31),
        "bits 0": _with(BitsAllocated=0), "bits 64": _with(BitsAllocated=64, BitsStored=64), "more bits stored than there are": _with(BitsStored=40),
        "high bit of 200": _with(HighBit=200), "3 samples": _with(SamplesPerPixel=3), "0 samples": _with(SamplesPerPixel=0),
        "photometric unknown": _with(PhotometricInterpretation="PURPLE"), "slope 0": _with(RescaleSlope=0),
        "10^6 frames": _with(NumberOfFrames=10**6), "-1 frames": _with(NumberOfFrames=-1),
        "pixels empty": _with(PixelData=b""), "pixels odd": _with(PixelData=b"\0\0"),
    }.items():  # fmt: skip
        yield _each(
            name,
            change,
            "any"
            if name in ("high bit of 200", "rows of another size", "-1 frames")
            else "refused",
        )
    for name, change in {
        "slope 1e30": _with(RescaleSlope="1e30"), "intercept 1e38": _with(RescaleIntercept="1e38"),
        "slope 1e308": _with(RescaleSlope="1e308"), "slope below 0": _with(RescaleSlope=-2), "modality odd": _with(Modality="X\\Y\n"),
        "signed and not": _with(PixelRepresentation=5), "padding outside": lambda ds: ds.add_new("PixelPaddingValue", "US", 7),
    }.items():  # fmt: skip
        yield _each(name, change, "any")
        yield _each(f"one with {name}", change, "any", one)
    for name, change in {
        "another size": _with(Rows=15, Columns=52), "another orientation": _with(ImageOrientationPatient=[0, 1, 0, 1, 0, 0]),
        "another spacing": _with(PixelSpacing=[7, 7]), "another bit depth": _with(BitsStored=12, HighBit=11),
        "a position far away": _with(ImagePositionPatient=[0, 0, "1e7"]), "another series": _with(SeriesInstanceUID="9.9"),
        "a series of no UID": _with(SeriesInstanceUID=""), "another modality": _with(Modality="CT"),
    }.items():  # fmt: skip
        yield _each(f"one with {name}", change, "any", last)
    for name, text in ODD_NAMES.items():
        if name not in ("surrogate", "nul"):
            yield _each(
                f"described as {name}",
                _with(SeriesDescription=text[:60], PatientName=text[:60]),
                "done",
            )


def _file(
    name: str, spoil: Callable[[Path], Any], source: str = "e.dcm", expect: str = "any"
) -> Case:
    def make(base: Path, folder: Path) -> list[str]:
        path = copied(base, folder, source)
        for file in sorted(path.iterdir()) if path.is_dir() else [path]:
            spoil(file)
        return plan(path.name)

    return Case(name, KIND, make, expect)


def _bytes() -> Iterator[Case]:
    for source in ("e.dcm", "m.dcm", "series"):
        yield _file(f"{source} is empty", lambda p: p.write_bytes(b""), source, "refused")
    yield _file("head alone", lambda p: p.write_bytes(bytes(128) + b"DICM"), expect="refused")
    yield _file("text", lambda p: p.write_text("no image"), expect="refused")
    nested = b"\xfe\xff\x00\xe0\xff\xff\xff\xff" + b"\x28\x00\x00\x30SQ\0\0\xff\xff\xff\xff"
    yield _file(
        "sequences nested",
        lambda p: p.write_bytes(
            p.read_bytes()[:400] + b"\x28\x00\x00\x30SQ\0\0\xff\xff\xff\xff" + nested * 20_000
        ),
        expect="any",
    )
    yield _file(
        "element of 4 GB",
        lambda p: p.write_bytes(p.read_bytes()[:400] + b"\x08\x00\x60\x00OB\0\0\xf0\xff\xff\xff"),
        expect="any",
    )
    yield _file(
        "per-frame groups lost",
        lambda p: _change(p, _without("PerFrameFunctionalGroupsSequence")),
        expect="refused",
    )
    yield _file(
        "shared groups lost",
        lambda p: _change(p, _without("SharedFunctionalGroupsSequence")),
        expect="refused",
    )
    yield _file(
        "more frames than groups",
        lambda p: _change(p, _with(NumberOfFrames=4000)),
        expect="refused",
    )
    for name, changed in {
        "without its private header": lambda ds: ds.__delitem__(0x00291010),
        "of a private header of noise": lambda ds: setattr(ds[0x00291010], "value", b"SV10" + b"\xff" * 400),
        "of 1000 slices": lambda ds: setattr(ds[0x00291010], "value", csa(NumberOfImagesInMosaic=["1000"], SliceNormalVector=["0", "0", "1"])),
        "of -4 slices": lambda ds: setattr(ds[0x00291010], "value", csa(NumberOfImagesInMosaic=["-4"], SliceNormalVector=["0", "0", "1"])),
        "of slices nowhere": lambda ds: setattr(ds[0x00291010], "value", csa(NumberOfImagesInMosaic=["7"], SliceNormalVector=["nan", "0", "1"])),
        "of slices at one place": _with(SpacingBetweenSlices=0, SliceThickness=0),
    }.items():  # fmt: skip
        yield _file(
            f"a mosaic {name}", lambda p, c=changed: _change(p, c), "m.dcm", expect="refused"
        )
    yield _each("a segmentation", _with(SOPClassUID="1.2.840.10008.5.1.4.1.1.66.4", Modality="SEG"))
    yield _each(
        "a dose of no planes",
        _with(SOPClassUID="1.2.840.10008.5.1.4.1.1.481.2", NumberOfFrames=4),
    )
    yield _file("fewer frames than groups", lambda p: _change(p, _with(NumberOfFrames=2)))


def _change(path: Path, change: Change) -> None:
    ds = pydicom.dcmread(path)
    change(ds)
    ds.save_as(path)


def _pixels() -> Iterator[Case]:
    noise = random.Random(1).randbytes(500)
    for name, syntax in {
        "JPEG": "1.2.840.10008.1.2.4.50", "JPEG lossless": "1.2.840.10008.1.2.4.70", "JPEG-LS": "1.2.840.10008.1.2.4.80",
        "JPEG 2000": "1.2.840.10008.1.2.4.90", "RLE": "1.2.840.10008.1.2.5", "MPEG": "1.2.840.10008.1.2.4.100",
        "deflated": "1.2.840.10008.1.2.1.99", "big-endian": "1.2.840.10008.1.2.2", "unknown": "1.2.3.4.5", "no UID": "abc",
        "empty": "",
    }.items():  # fmt: skip

        def change(ds: Any, syntax: str = syntax) -> None:
            ds.PixelData = encapsulate([noise])
            ds["PixelData"].is_undefined_length = True
            ds["PixelData"].VR = "OB"

        def make(
            base: Path, folder: Path, syntax: str = syntax, change: Change = change
        ) -> list[str]:
            series = copied(base, folder, "series")
            for path in series.iterdir():
                _change_syntax(path, change, syntax)
            return plan("series")

        yield Case(
            f"noise as {name}",
            KIND,
            make,
            "any" if name in ("big-endian", "no UID", "empty", "unknown") else "refused",
        )
    bomb = struct.pack("<16I", 1, 64, *[0] * 14) + b"\x81\0" * 4_000_000  # runs of 128 equal bytes
    yield _each("RLE bomb", lambda ds: _rle(ds, bomb))


def _change_syntax(path: Path, change: Change, syntax: str) -> None:
    """Replace the pixels, and then the name of JPEG's syntax by another of any length."""
    ds = pydicom.dcmread(path)
    change(ds)
    usual = b"1.2.840.10008.1.2.4.70"
    ds.file_meta.TransferSyntaxUID = usual.decode()
    ds.save_as(path)
    path.write_bytes(path.read_bytes().replace(usual, syntax.encode().ljust(len(usual), b"\0"), 1))


def _rle(ds: Any, stream: bytes) -> None:
    ds.file_meta.TransferSyntaxUID = "1.2.840.10008.1.2.5"
    ds.PixelData = encapsulate([stream])
    ds["PixelData"].is_undefined_length = True
    ds["PixelData"].VR = "OB"


def _linked(series: Path, there: Path) -> None:
    """Move the last slice elsewhere and leave a link to it."""
    path = max(series.iterdir())
    there.mkdir(exist_ok=True)
    os.symlink(path.rename(there / "slice"), path)


def _folders() -> Iterator[Case]:
    def folder_of(name: str, fill: Callable[[Path], Any], expect: str = "refused") -> Case:
        def make(base: Path, folder: Path) -> list[str]:
            series = copied(base, folder, "series")
            fill(series)
            return plan("series")

        return Case(name, KIND, make, expect)

    def emptied(series: Path) -> None:
        for path in series.iterdir():
            path.unlink()

    yield folder_of("folder empty", emptied)
    yield folder_of("folder of itself", lambda s: os.symlink(".", s / "again"), "done")
    yield folder_of("link to itself", lambda s: os.symlink("x", s / "x"), "done")
    yield folder_of("pipe among them", lambda s: os.mkfifo(s / "pipe"), "done")
    yield folder_of("slice is a link within", lambda s: _linked(s, s / "own"), "done")
    yield folder_of("slice is a link out", lambda s: _linked(s, s.parent / "bait"))
    yield folder_of("endless among them", lambda s: os.symlink("/dev/zero", s / "zero"), "done")
    yield folder_of(
        "10 MB of noise among them",
        lambda s: (s / "noise").write_bytes(os.urandom(10_000_000)),
        "done",
    )
    yield folder_of(
        "deflated twice",
        lambda s: [p.write_bytes(zlib.compress(p.read_bytes())) for p in list(s.iterdir())],
    )
    yield folder_of(
        "newline in names",
        lambda s: [p.rename(s / f"{p.name}\nstereocell: x") for p in list(s.iterdir())],
        "done",
    )
    yield folder_of(
        "no UTF-8 in names",
        lambda s: [os.rename(p, os.fsencode(p) + b"\xff") for p in list(s.iterdir())],
        "done",
    )
    yield folder_of(
        "all alike",
        lambda s: [p.write_bytes((s / "IM0001").read_bytes()) for p in list(s.iterdir())],
    )
