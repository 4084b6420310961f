"""A source comes from a stranger: files that it names are read only if they lie in its own folder.

Each bait is a sound file, so a reader that opens it succeeds, and the test fails.
"""

import json
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pydicom
import pytest

from conftest import Server
from malformed.tiff_cases import behind_comment, with_prefix, write_tiff, xml
from stereocell import read
from stereocell.cli.__main__ import main
from support.dicom_series import grid, write_f_nifti, write_series
from support.phantoms import f_phantom, write_ome_tiff, write_ome_zarr
from support.reading import read_levels, refusing

SHAPE = (6, 30, 26)
_ID = "urn:uuid:00000000-0000-0000-0000-00000000000{}"


refusal = refusing(read_levels)


def tiff_of(path: Path, name: str, written: Callable[[str], str] = str) -> Path:
    """Write an OME-TIFF whose OME-XML says that the planes lie in the file `name`.

    written  changes the OME-XML
    """
    planes = f'<TiffData IFD="0" PlaneCount="4"><UUID FileName="{name}">{_ID.format(1)}</UUID>'
    text = xml(inside=f"{planes}</TiffData>").replace("<OME ", f'<OME UUID="{_ID.format(2)}" ')
    path.parent.mkdir(exist_ok=True)
    write_tiff(path, written(text))
    return path


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A source's folder, with an apostrophe in its name. Beside it, `other` holds a sound TIFF."""
    (tmp_path / "other").mkdir()
    write_tiff(tmp_path / "other" / "secret.ome.tif")
    folder = tmp_path / "Ann's data"
    folder.mkdir()
    return folder


@pytest.mark.parametrize("name", ["../other/secret.ome.tif", "{}/other/secret.ome.tif"])
def test_planes_in_a_tiff_elsewhere_are_refused(home: Path, name: str) -> None:
    source = tiff_of(home / "x.ome.tif", name.format(home.parent))
    assert (home / name.format(home.parent)).is_file()
    line = refusal(source)
    assert f"UUID FileName '{name.format(home.parent)}'" in line
    assert f"expected a file in {home} or below" in line


@pytest.mark.parametrize("written", [behind_comment, with_prefix])
@pytest.mark.parametrize("name", ["x.ome.tif", "my scan.tif"])
def test_planes_elsewhere_are_refused_however_the_file_names_its_kind(
    home: Path, name: str, written: Callable[[str], str]
) -> None:
    source = tiff_of(home / name, "../other/secret.ome.tif", written)
    assert "UUID FileName '../other/secret.ome.tif'" in refusal(source)


def test_no_file_is_opened_for_a_text_that_only_ends_like_ome_xml(home: Path) -> None:
    write_tiff(home.parent / "other" / "secret.ome.tif", strip=b"\7" * 512)
    source = tiff_of(home / "x.tif", "../other/secret.ome.tif", lambda text: "scan 1\n" + text)
    dataset = read.open(source, spacing_um=(1, 1, 1))
    own = np.arange(16 * 16, dtype="<u2").reshape(16, 16)
    assert (dataset.read(0, dataset.levels[0].box, 0).voxels == own).all()


def test_a_link_out_of_a_tiff_s_folder_is_refused(home: Path) -> None:
    (home / "b.ome.tif").symlink_to("../other/secret.ome.tif")
    assert "other/secret.ome.tif" in refusal(tiff_of(home / "x.ome.tif", "b.ome.tif"))


def test_planes_in_a_pipe_are_refused_and_not_waited_for(home: Path) -> None:
    os.mkfifo(home / "b.ome.tif")
    assert "'b.ome.tif': found a folder, device or pipe" in refusal(
        tiff_of(home / "x.ome.tif", "b.ome.tif")
    )


def test_the_files_of_a_set_are_found(home: Path) -> None:
    (home / "own").mkdir()
    write_tiff(home / "own" / "b.ome.tif")
    (home / "link.ome.tif").symlink_to("own/b.ome.tif")
    read_levels(tiff_of(home / "x.ome.tif", "own/b.ome.tif"))
    read_levels(tiff_of(home / "x.ome.tif", "link.ome.tif"))


def test_a_set_is_found_by_a_link_to_it(home: Path) -> None:
    write_tiff(home / "b.ome.tif")
    tiff_of(home / "x.ome.tif", "b.ome.tif")
    link = home.parent / "mine.ome.tif"
    link.symlink_to(home / "x.ome.tif")
    read_levels(link)


def test_a_file_that_moved_is_known_by_its_own_id(home: Path) -> None:
    planes = f'<TiffData IFD="0" PlaneCount="4"><UUID FileName="/old/x.ome.tif">{_ID.format(2)}'
    text = xml(inside=f"{planes}</UUID></TiffData>")
    write_tiff(home / "x.ome.tif", text.replace("<OME ", f'<OME UUID="{_ID.format(2)}" '))
    read_levels(home / "x.ome.tif")


def test_the_command_refuses_in_one_line(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = tiff_of(home / "x.ome.tif", "../other/secret.ome.tif")
    assert main(["plan", str(source), "-o", str(home.parent / "out")]) == 1
    printed = capsys.readouterr().err
    assert printed.startswith(f"stereocell: {source}: OME-XML: UUID FileName")
    assert printed.count("\n") == 1
    assert not (home.parent / "out").exists()


def zarr_of(folder: Path, version: str) -> Path:
    return write_ome_zarr(folder / "v.zarr", [f_phantom()], version=version, chunks=(8, 24, 18))


@pytest.mark.parametrize("moved", ["zarr.json", "0", "0/zarr.json", "0/c", "0/c/1/1/1"])
def test_links_out_of_a_zarr_are_refused(home: Path, moved: str) -> None:
    source = zarr_of(home, "0.5")
    bait = (source / moved).rename(home / "moved")
    (source / moved).symlink_to(bait)
    assert f"leads to {bait}" in refusal(source)


@pytest.mark.parametrize("moved", [".zattrs", "0", "0/.zarray", "0/0/0/0"])
def test_links_out_of_a_zarr_of_0_4_are_refused(home: Path, moved: str) -> None:
    source = zarr_of(home, "0.4")
    bait = (source / moved).rename(home / "moved")
    (source / moved).symlink_to(bait)
    assert f"leads to {bait}" in refusal(source)


def test_links_within_a_zarr_are_followed(home: Path) -> None:
    source = zarr_of(home, "0.5")
    (source / "0").rename(source / "finest")
    (source / "0").symlink_to("finest")
    (home / "mine.zarr").symlink_to(source)
    read_levels(home / "mine.zarr")


@pytest.mark.parametrize("path", ["../b.zarr/0", "{}/b.zarr/0", "..\\b.zarr\\0"])
def test_a_level_of_another_zarr_is_refused(home: Path, path: str) -> None:
    source = zarr_of(home, "0.5")
    shutil.copytree(source, home / "b.zarr")
    assert "level" in refusal(with_level(source, path.format(home)))


@pytest.mark.parametrize("path", ["%2e%2e/b.zarr/0", "%252e%252e/b.zarr/0", "..%2Fb.zarr/0"])
def test_a_level_out_of_an_address_is_refused(
    home: Path, serve: Callable[[Path], Server], path: str
) -> None:
    source = zarr_of(home, "0.5")
    shutil.copytree(source, home / "b.zarr")
    with_level(source, path)
    server = serve(home)
    assert "leads out of the address" in refusal(f"{server.url}/v.zarr")
    assert not server.gets("b.zarr")


def with_level(source: Path, path: str) -> Path:
    """Change the path of a group's first level."""
    content = json.loads((source / "zarr.json").read_text("utf-8"))
    content["attributes"]["ome"]["multiscales"][0]["datasets"][0]["path"] = path
    (source / "zarr.json").write_text(json.dumps(content))
    return source


def test_slices_by_symbolic_links_out_of_the_folder_are_refused_without_their_names(
    home: Path,
) -> None:
    paths = sorted(write_series(home / "s", grid(shape=SHAPE), SHAPE))
    bait = paths[2].rename(home / "Doe^Jane.dcm")
    paths[2].symlink_to(bait)
    line = refusal(home / "s")
    assert "file 3 of 6 in the order of names: found a link that leads out of the folder" in line
    assert "Doe" not in line
    assert paths[2].name not in line


def test_slices_by_symbolic_links_within_the_folder_are_read(home: Path) -> None:
    paths = sorted(write_series(home / "s", grid(shape=SHAPE), SHAPE))
    (home / "s" / "annex").mkdir()
    for path in paths:
        path.symlink_to(path.rename(home / "s" / "annex" / path.name))
    (home / "link").symlink_to("s")
    assert read.open(home / "s").levels[0].shape == read.open(home / "link").levels[0].shape
    assert sorted(read.open(home / "s").levels[0].shape) == sorted(SHAPE)


def test_a_dicomdir_s_references_are_not_followed(home: Path) -> None:
    bait = write_series(home / "s", grid(shape=SHAPE), SHAPE)[0]
    record = pydicom.Dataset()
    record.DirectoryRecordType = "IMAGE"
    with pydicom.config.disable_value_validation():
        record.ReferencedFileID = ["..", "s", bait.name]
    directory = pydicom.Dataset()
    directory.DirectoryRecordSequence = [record]
    directory.file_meta = pydicom.dataset.FileMetaDataset()
    directory.file_meta.MediaStorageSOPClassUID = pydicom.uid.MediaStorageDirectoryStorage
    directory.file_meta.MediaStorageSOPInstanceUID = pydicom.uid.generate_uid()
    directory.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    alone = home / "alone"
    alone.mkdir()
    directory.save_as(alone / "DICOMDIR", enforce_file_format=True)
    for source in (alone, alone / "DICOMDIR"):
        assert "no DICOM image" in refusal(source)
    directory.save_as(home / "s" / "DICOMDIR", enforce_file_format=True)
    assert read.open(home / "s").notes == ("file left out: 1 without pixels",)


@pytest.mark.parametrize("name", ["x.ome.tif", "x.nii", "x.nii.gz", "x.dcm", "x.zarr"])
@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_a_pipe_or_a_device_is_refused_as_a_source(home: Path, name: str, kind: str) -> None:
    path = home / name
    os.mkfifo(path) if kind == "pipe" else path.symlink_to("/dev/zero")
    assert re.search(r"found a folder, device or pipe, expected a regular file$", refusal(path))


def test_a_source_named_by_a_link_is_the_user_s_own_choice(home: Path) -> None:
    write_ome_tiff(home.parent / "other" / "v.ome.tif", f_phantom())
    write_f_nifti(home.parent / "other" / "v.nii", f_phantom(), (0.5, 0.2, 0.2))
    for name in ("v.ome.tif", "v.nii"):
        (home / name).symlink_to(home.parent / "other" / name)
        read_levels(home / name)
    assert np.prod(read.open(home / "v.nii").levels[0].shape) == f_phantom().size
