"""Files get neutral names, which keep the parts that readers need and nothing else."""

from pathlib import Path

import numpy as np
import pytest
import SimpleITK

from stereocell import read
from stereocell.inbox.arrange import arrange
from stereocell.inbox.limits import InboxLimits
from stereocell.inbox.names import check_names, is_of_system
from stereocell.inbox.refused import RefusedError
from stereocell.inbox.safe_names import ending_of, group_names, plane_names
from stereocell.inbox.upload import Announced, Upload
from support.identity_search import find
from support.phantoms import f_phantom, write_ome_tiff

LIMITS = InboxLimits(reserve=0)


def arranged(folder: Path, files: dict[str, bytes]) -> Path:
    """Upload files and give them neutral names; return the path of the source to read."""
    announced = Announced(tuple(files), tuple(map(len, files.values())))
    upload = Upload.create(folder, announced)
    upload.write(b"".join(files.values()))
    upload.finish()
    place = folder / arrange(str(folder), LIMITS)
    assert folder / arrange(str(folder), LIMITS) == place  # as after a restart
    return place


@pytest.mark.parametrize(
    ("name", "ending"),
    [
        ("Doe.nii.gz", ".nii.gz"),
        ("Doe.John.1970.NII", ".nii"),
        ("scan.ome.tif", ".ome.tif"),
        ("a.dcm", ".dcm"),
        ("IM0001", ""),
        ("1.2.840.113619", ""),
        ("scan.doe", ""),
        ("a.sld", ".sld"),
    ],
)
def test_only_the_ending_of_a_name_stays(name: str, ending: str) -> None:
    assert ending_of(name) == ending


@pytest.mark.parametrize(
    ("names", "safe"),
    [
        (["Doe_z01.tif", "Doe_z02.tif"], ["x_z01.tif", "x_z02.tif"]),
        (["Doe 1970/ch1_z1.png", "Doe 1970/ch2_z1.png"], ["ch1_z0.png", "ch2_z0.png"]),
        (["Doe_DAPI_1.tif", "Doe_CD31_1.tif"], ["000000.tif", "000001.tif"]),
        (["D\u00f6e_1.tif", "D\u00f6e_2.tif"], ["x_1.tif", "x_2.tif"]),
    ],
)
def test_parts_that_distinguish_planes_stay(names: list[str], safe: list[str]) -> None:
    found = ["/".join(parts) for parts in plane_names(check_names(names, "files"))]
    assert found == safe


def test_keys_of_a_group_stay_and_folders_around_it_go() -> None:
    names = ["Doe/Doe.ome.zarr/zarr.json", "Doe/Doe.ome.zarr/0/c/0/0/0"]
    assert group_names(check_names(names, "files")) == [
        ("specimen.ome.zarr", "zarr.json"),
        ("specimen.ome.zarr", "0", "c", "0", "0", "0"),
    ]
    assert group_names(check_names(["a.dcm"], "files")) is None


def test_a_header_finds_its_data_under_the_new_names(tmp_path: Path) -> None:
    image = SimpleITK.GetImageFromArray(f_phantom(1).astype(np.int16))
    SimpleITK.WriteImage(image, str(tmp_path / "Mustermann.mhd"))
    files = {name: (tmp_path / name).read_bytes() for name in ("Mustermann.mhd", "Mustermann.raw")}
    place = arranged(tmp_path / "upload", files)
    assert place.name == "specimen.mhd"
    assert sorted(read.open(place).levels[0].shape) == sorted(f_phantom(1).shape)
    assert find(place.parent, ["Mustermann"]) == []


def test_files_that_systems_add_are_ignored_and_several_images_are_refused(tmp_path: Path) -> None:
    for name in ("__MACOSX/._a.nii", "a/.DS_Store", "Thumbs.db", "._scan.dcm"):
        assert is_of_system(tuple(name.split("/")))
    image = write_ome_tiff(tmp_path / "f.ome.tif", f_phantom()).read_bytes()
    place = arranged(tmp_path / "one", {"Doe.ome.tif": image, ".DS_Store": b"Doe"})
    assert place.name == "specimen.ome.tif"
    head = b"\x5c\x01\0\0" + bytes(344)
    with pytest.raises(RefusedError, match="found 2 images, expected one specimen"):
        arranged(tmp_path / "two", {"a.nii": head, "b.nii": head})
    with pytest.raises(RefusedError, match="found only files that operating systems add"):
        arranged(tmp_path / "none", {".DS_Store": b"1"})
