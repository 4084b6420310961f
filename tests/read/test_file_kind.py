"""A file that is not of its stated kind is refused in one line, the same for every format."""

import gzip
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import mrcfile
import numpy as np
import pytest
import zarr

from stereocell import read
from stereocell.model.errors import SourceError
from support.array_files import write_bdv_xml, write_czi, write_ims, write_lif, write_n5
from support.dicom_series import write_f_nifti
from support.phantoms import f_phantom, write_ome_tiff

NAMES = (
    *("a.tif", "a.ome.tiff", "a.lsm", "a.h5", "a.ims", "a.mrc", "a.rec", "a.map.gz", "a.nii"),
    *("a.nii.gz", "a.hdr", "a.nrrd", "a.nhdr", "a.mha", "a.mhd", "a.czi", "a.lif", "a.nd2"),
    *("a.dcm", "a.png", "a.zarr", "a.n5", "a.companion.ome"),
)
LFS = b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 12\n"
NIFTI, NAMED = "NIfTI or Analyze", ": if it really is that, rename it to end in"
STUBS = {
    "pointer of Git LFS": (LFS, "`git lfs pull` gets the file"),
    "HTML page": (b"\n<!DOCTYPE html>\n<html><body>Log in</body></html>", "download it again"),
    "empty file": (b"", "copy or download it again"),
    "JSON": (b'{"message": "Not Found"}', "a server's error"),
    "XML error": (b"<?xml version='1.0'?><Error><Code>AccessDenied</Code></Error>", "download"),
    "zip archive": (b"PK\x03\x04" + bytes(600), "unzip it"),
    "PDF document": (b"%PDF-1.7\n" + bytes(600), "PDF"),
}


def _read_whole(path: Path, **options: Any) -> None:
    dataset = read.open(path, **options)
    dataset.read(0, dataset.levels[0].box)


def refusal(path: Path) -> str:
    with pytest.raises(SourceError) as caught:
        _read_whole(path)
    line = str(caught.value)
    assert line.startswith(f"{path}: ")
    assert "\n" not in line
    assert "expected " in line
    return line


@pytest.mark.parametrize("stub", list(STUBS))
@pytest.mark.parametrize("name", NAMES)
def test_a_stub_in_place_of_a_file_is_named(tmp_path: Path, name: str, stub: str) -> None:
    content, remedy = STUBS[stub]
    (tmp_path / name).write_bytes(content)
    line = refusal(tmp_path / name)
    assert stub in line
    assert remedy in line


@pytest.mark.parametrize("name", [n for n in NAMES if n != "a.rec"])
def test_zeros_are_reported_as_an_unfinished_copy(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(bytes(20_000))
    assert "zeros (a copy or a download that did not finish" in refusal(tmp_path / name)


@pytest.mark.parametrize("content", [b"", LFS, b"<html>", b"{}"])
@pytest.mark.parametrize("name", ["a.nii.gz", "a.hdr.gz", "a.mrc.gz"])
def test_the_content_of_a_compressed_file_is_checked(
    tmp_path: Path, name: str, content: bytes
) -> None:
    (tmp_path / name).write_bytes(gzip.compress(content))
    line = refusal(tmp_path / name)
    kinds = {b"": "nothing", LFS: "a pointer of Git LFS", b"<html>": "an HTML page", b"{}": "JSON"}
    assert f"a gzip file of {kinds[content]}" in line


def _tiff(path: Path) -> None:
    write_ome_tiff(path.with_name("t.ome.tif"), f_phantom()).rename(path)


def _nifti(path: Path) -> None:
    write_f_nifti(path.with_name("n.nii"), f_phantom(), (0.5, 0.2, 0.2))
    path.with_name("n.nii").rename(path)


def _packed_nifti(path: Path) -> None:
    write_f_nifti(path.with_name("n.nii.gz"), f_phantom(), (0.5, 0.2, 0.2))
    path.with_name("n.nii.gz").rename(path)


@pytest.mark.parametrize(
    ("make", "name", "expected"),
    [
        (_tiff, "a.mrc", f"found a TIFF file, expected MRC{NAMED} .tif"),
        (_tiff, "a.nii.gz", "found a TIFF file, expected NIfTI or Analyze, packed by gzip: if"),
        (_tiff, "a.mha", "found a TIFF file, expected MetaImage: if"),
        (_tiff, "a.ims", "found a TIFF file, expected Imaris: if"),
        (_tiff, "a.dcm", None),  # any content may end in .dcm, so the content decides
        (_nifti, "a.nii.gz", f"found a NIfTI file, expected {NIFTI}, packed by gzip{NAMED} .nii"),
        (_packed_nifti, "a.nii", f"NIfTI file (gunzip it), expected {NIFTI}{NAMED} .nii.gz"),
        (_nifti, "a.tif", "found a NIfTI file, expected TIFF: if"),
    ],
)  # fmt: skip
def test_a_file_with_the_wrong_ending_is_refused_with_the_right_one(
    tmp_path: Path, make: Callable[[Path], None], name: str, expected: str | None
) -> None:
    path = tmp_path / name
    make(path)
    if expected is None:
        read.open(path)
        return
    assert expected in refusal(path)
    ending = expected.rpartition("name it ")[2]
    if ending.startswith("."):
        renamed = path.rename(tmp_path / f"b{ending}")
        assert read.open(renamed).levels[0].shape == f_phantom().shape


@pytest.mark.parametrize("name", ["zarr.json", "c/0/0/0"])
def test_git_lfs_pointers_in_a_zarr_are_named(tmp_path: Path, name: str) -> None:
    path = tmp_path / "a.zarr"
    zarr.create_array(str(path), data=f_phantom(), chunks=(4, 24, 18))
    (path / name).write_bytes(LFS)
    with pytest.raises(SourceError, match="found a pointer of Git LFS"):
        _read_whole(path, spacing_um=(1, 1, 1))


@pytest.mark.parametrize("name", ["attributes.json", "0/0/0"])
def test_git_lfs_pointers_in_an_n5_are_named(tmp_path: Path, name: str) -> None:
    path = write_n5(tmp_path / "a.n5")
    (path / name).write_bytes(LFS)
    with pytest.raises(SourceError, match="found a pointer of Git LFS"):
        _read_whole(path, spacing_um=(1, 1, 1))


def test_a_container_that_an_xml_names_is_checked(tmp_path: Path) -> None:
    write_bdv_xml(tmp_path, "a.h5", "nm")
    (tmp_path / "a.h5").write_bytes(LFS)
    (xml,) = tmp_path.glob("*.xml")
    with pytest.raises(SourceError, match=r"a\.h5: found a pointer of Git LFS"):
        read.open(xml)


def test_a_broken_link_is_refused_with_its_target(tmp_path: Path) -> None:
    (tmp_path / "a.tif").symlink_to("gone.tif")
    assert "a.tif: a link to gone.tif, which doesn't exist" in refusal(tmp_path / "a.tif")


def test_a_folder_without_a_format_is_refused_with_its_content(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="found an empty folder"):
        read.open(tmp_path)
    for number in range(3):
        (tmp_path / f"{number}.dcm").write_bytes(LFS)
    with pytest.raises(SourceError, match=r"3 not DICOM \(the first is a pointer of Git LFS"):
        read.open(tmp_path)


@pytest.mark.parametrize(
    ("head", "expected"),
    [
        (b"CDF\x02\0\0\0\0", "a netCDF-3 file (`nccopy -k nc4 IN OUT` makes netCDF-4)"),
        (b"MATLAB 5.0 MAT-file", "save it in MATLAB with -v7.3"),
        (b"\x89PNG\r\n\x1a\n", "one plane"),
    ],
)
def test_files_of_other_programs_are_refused_with_a_remedy(
    tmp_path: Path, head: bytes, expected: str
) -> None:
    path = tmp_path / f"a.{'png' if b'PNG' in head else 'mat'}"
    path.write_bytes(head + bytes(600))
    assert expected in refusal(path)


def test_hdf5_without_a_volume_is_refused_with_its_content(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["flat"] = f_phantom()[0]
        file["names"] = "x"
    line = refusal(tmp_path / "a.h5")
    assert "found no volume but /flat (48, 36) " in line
    assert "/names () object" in line


def test_an_mrc_that_ends_in_its_header_is_refused_with_the_byte(tmp_path: Path) -> None:
    with mrcfile.new(tmp_path / "a.mrc") as file:
        file.set_data(f_phantom().astype(np.float32))
    (tmp_path / "b.mrc").write_bytes((tmp_path / "a.mrc").read_bytes()[:500])
    assert "cut short at byte 500" in refusal(tmp_path / "b.mrc")


def test_hdf5_after_a_users_block_is_recognised(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["raw"] = f_phantom()
        file["raw"].attrs["element_size_um"] = (1.0, 1.0, 1.0)
    assert path.read_bytes()[:8] == bytes(8)
    dataset = read.open(path)
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, f_phantom())


def test_a_folder_of_git_lfs_pointers_is_refused(tmp_path: Path) -> None:
    for z in range(3):
        (tmp_path / f"plane_{z}.png").write_bytes(LFS)
    with pytest.raises(SourceError, match="pointer of Git LFS"):
        read.open(tmp_path)


@pytest.mark.parametrize("ending", [".czi", ".lif", ".h5", ".ims"])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_file_that_ends_too_soon_is_refused_with_the_byte(
    tmp_path: Path, ending: str, share: float
) -> None:
    path = tmp_path / f"a{ending}"
    if ending == ".czi":
        write_czi(path, {None: f_phantom()[None, None]})
    elif ending == ".lif":
        write_lif(path, {"a": ("ZYX", f_phantom())})
    elif ending == ".ims":
        write_ims(path, np.stack([f_phantom()] * 2))
    else:
        with h5py.File(path, "w") as file:
            file.create_dataset("raw", data=f_phantom(), chunks=(4, 24, 18))
            file["raw"].attrs["element_size_um"] = (1.0, 1.0, 1.0)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    assert f"cut short at byte {int(share * len(content))}" in refusal(path)
