"""Files of formats that are not read: the refusal names the format and a remedy."""

import pickle
import sqlite3
import struct
import zipfile
from pathlib import Path

import imagecodecs
import numpy as np
import pytest
import scipy.io
from PIL import Image as Pillow

from stereocell import read
from stereocell.model.errors import SourceError
from stereocell.read.foreign_files import FOREIGN
from stereocell.read.tables import read_table
from support.reading import refusing

VOXELS = np.random.default_rng(0).integers(1, 255, (6, 9, 10), np.uint8)
OLE = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600)
BIOFORMATS = "Fiji opens it by Bio-Formats"


refusal = refusing(read.open)


@pytest.mark.parametrize(
    ("name", "content", "expected", "remedy"),
    [
        ("a.oib", OLE, "Olympus FluoView", BIOFORMATS),
        ("a.oif", "[Version Info]\r\n".encode("utf-16"), "Olympus FluoView", BIOFORMATS),
        ("a.zvi", OLE, "Zeiss AxioVision", BIOFORMATS),
        ("a.oir", b"OLYMPUSRAWFORMAT" + bytes(99), "OIR file of Olympus", BIOFORMATS),
        ("a.dm3", struct.pack(">3I", 3, 500, 1) + b"x" * 99, "DM3 file of Gatan", BIOFORMATS),
        ("a.dm4", struct.pack(">IQI", 4, 500, 1) + b"x" * 99, "DM4 file of Gatan", BIOFORMATS),
        ("a.mnc", b"CDF\x01" + bytes(99), "MINC", "mnc2nii"),
        ("a.nc", b"CDF\x01" + bytes(99), "netCDF-3", "nccopy -k nc4"),
        ("a.am", b"# AmiraMesh BINARY 2.1\n", "Amira mesh", BIOFORMATS),
        ("a.ics", b"\t\nics_version\t2.0\n", "ICS image", BIOFORMATS),
        ("a.vtk", b"# vtk DataFile Version 3.0\n", "VTK", "MetaImage"),
        ("a.vti", b"<?xml version='1.0'?><VTKFile>", "VTK", "ParaView"),
        ("a.mp4", b"\0\0\0\x18ftypmp42" + bytes(99), "video", "ffmpeg -i"),
        ("a.avi", b"RIFF\0\0\0\0AVI LIST", "video", "ffmpeg -i"),
        ("a.7z", b"7z\xbc\xaf\x27\x1c" + bytes(99), "7z archive", "unpack"),
        ("a.rar", b"Rar!\x1a\x07\x01\0" + bytes(99), "rar archive", "unpack"),
        ("a.fits", b"SIMPLE  =                    T", "FITS", BIOFORMATS),
        ("a.xlsx", b"PK\x03\x04" + bytes(26) + b"[Content_Types].xml", "Microsoft Office", ""),
        ("a.xls", OLE, "workbook", "CSV UTF-8"),
        ("a.log", b"[Reconstruction]\nPixel Size (um)=9\n", "settings ([section] and key", ""),
        ("._a.tif", b"\0\x05\x16\x07\0\2\0\0" + bytes(99), "record of macOS", "no `._`"),
    ],
)
def test_the_format_and_the_remedy_are_named(
    tmp_path: Path, name: str, content: bytes, expected: str, remedy: str
) -> None:
    (tmp_path / name).write_bytes(content)
    line = refusal(tmp_path / name)
    assert expected in line
    assert remedy in line
    assert "JSON" not in line


def test_files_that_libraries_write_are_named(tmp_path: Path) -> None:
    (tmp_path / "a.jp2").write_bytes(imagecodecs.jpeg2k_encode(VOXELS[0]))
    assert "JPEG 2000" in refusal(tmp_path / "a.jp2")
    Pillow.fromarray(VOXELS[0]).save(tmp_path / "a.webp")
    assert "WebP image (convert it" in refusal(tmp_path / "a.webp")
    scipy.io.savemat(tmp_path / "five.mat", {"v": VOXELS})
    scipy.io.savemat(tmp_path / "four.mat", {"v": VOXELS[0].astype(float)}, format="4")
    for name in ("five.mat", "four.mat"):
        assert "MATLAB file before 7.3 (save it in MATLAB with -v7.3)" in refusal(tmp_path / name)
    np.savez(tmp_path / "a.npz", v=VOXELS)
    assert "NumPy archive of arrays (tifffile" in refusal(tmp_path / "a.npz")
    for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
        (tmp_path / "a.pkl").write_bytes(pickle.dumps({"v": VOXELS}, protocol=protocol))
        assert "Python pickle, which is never opened" in refusal(tmp_path / "a.pkl")
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("slice.dcm", bytes(200))
    assert "zip archive (unzip it" in refusal(tmp_path / "a.zip")
    sqlite3.connect(tmp_path / "a.db").execute("create table t (a)").connection.close()
    assert "SQLite database" in refusal(tmp_path / "a.db")


@pytest.mark.parametrize("ending", [".gif", ".webp"])
def test_a_folder_of_other_images_is_named(tmp_path: Path, ending: str) -> None:
    for plane, pixels in enumerate(VOXELS):
        Pillow.fromarray(pixels).save(tmp_path / f"s{plane}{ending}")
    assert "image (convert it to TIFF or PNG)" in refusal(tmp_path)


@pytest.mark.parametrize("sidecar", ["", "scan.vgi", "scan.raw.info", "scan.info"])
def test_the_header_that_the_message_suggests_reads_raw_voxels(
    tmp_path: Path, sidecar: str
) -> None:
    VOXELS.astype("<u2").tofile(tmp_path / "scan.raw")
    if sidecar:
        (tmp_path / sidecar).write_text("[representation]\nsize = 10 9 6\n")
    line = refusal(tmp_path / "scan.raw")
    assert (f"described by {sidecar!r}" if sidecar else "if it is a volume") in line
    advised = line.partition("with the lines ")[2].rpartition("), expected")[0].split(", ")
    text = "\n".join(advised).replace("DimSize = X Y Z", "DimSize = 10 9 6")
    text = text.replace("ElementSpacing = X Y Z (mm)", "ElementSpacing = 0.5 0.5 2")
    (tmp_path / "scan.mhd").write_text(text + "\n")
    dataset = read.open(tmp_path / "scan.mhd")
    found = dataset.read(0, dataset.levels[0].box).voxels
    assert sorted(found.ravel().tolist()) == sorted(VOXELS.ravel().tolist())


def test_no_ending_belongs_to_two_formats() -> None:
    endings = [ending for one in FOREIGN for ending in one.endings]
    assert len(endings) == len(set(endings))
    assert all(one.remedy for one in FOREIGN)


@pytest.mark.parametrize("name", ["t.xlsx", "t.ods", "t.rds"])
def test_a_table_of_another_program_is_named(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"PK\x03\x04" + bytes(99))
    with pytest.raises(SourceError, match="save it as CSV UTF-8"):
        read_table(str(tmp_path / name), "", (), "cells")
    with zipfile.ZipFile(tmp_path / "t.csv", "w") as archive:
        archive.writestr("[Content_Types].xml", "<x/>")
    with pytest.raises(SourceError, match="found a document of Microsoft Office, expected a table"):
        read_table(str(tmp_path / "t.csv"), "", (), "cells")
    (tmp_path / "t.csv").write_text("BMI_of_patient,label\n20,1\n")
    assert read_table(str(tmp_path / "t.csv"), "", (), "cells").labels.tolist() == [1]
