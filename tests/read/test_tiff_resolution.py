"""The resolution in the tags of TIFF, compared with the voxel size in a program's metadata."""

from pathlib import Path

import pytest
import tifffile

from stereocell import read
from support.phantoms import f_phantom

BODY, UM = f_phantom(), (0.5, 0.2, 0.25)


@pytest.mark.parametrize(
    ("per_unit", "resolution_unit"), [(1e4, "CENTIMETER"), (1.0, "NONE"), (1.0, "INCH")]
)
def test_the_resolution_of_tifffile_s_file_is_in_the_unit_of_its_tag(
    tmp_path: Path, per_unit: float, resolution_unit: str
) -> None:
    """An inch in the tags is not a length of voxels, so the unit in the description counts."""
    path = tmp_path / "a.tif"
    tifffile.imwrite(
        path, BODY, photometric="minisblack",
        metadata={"axes": "ZYX", "unit": "um", "spacing": 0.5},
        resolution=(per_unit / 0.25, per_unit / 0.2), resolutionunit=resolution_unit,
    )  # fmt: skip
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx(UM)
    assert dataset.notes == ()


def test_imagej_s_unit_that_contradicts_that_of_the_resolution_is_noted(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    tifffile.imwrite(
        path, BODY, imagej=True, metadata={"axes": "ZYX", "unit": "um", "spacing": 0.5},
        resolution=(1e4 / 0.25, 1e4 / 0.2), resolutionunit="CENTIMETER",
    )  # fmt: skip
    notes = read.open(path).notes
    assert any("the TIFF tag XResolution states 0.25 um" in note for note in notes)


def test_the_resolution_in_the_tags_is_compared_with_the_microscope_s(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    plane = {"id": "spatial-calibration-state", "type": "bool", "value": "true"}
    sides = [("units", "string", "um"), ("x", "float", "0.25"), ("y", "float", "0.2")]
    props = [plane, *({"id": f"spatial-calibration-{n}", "type": t, "value": v}
                      for n, t, v in sides)]  # fmt: skip
    texts = (" ".join(f'{key}="{value}"' for key, value in one.items()) for one in props)
    text = "".join(f"<prop {each}/>" for each in texts)
    xml = f"<MetaData><PlaneInfo>{text}</PlaneInfo></MetaData>"
    tifffile.imwrite(
        path, BODY, description=xml, metadata=None, photometric="minisblack",
        resolution=(1e4 / 0.5, 1e4 / 0.2), resolutionunit="CENTIMETER", software="MetaSeries",
    )  # fmt: skip
    notes = read.open(path, spacing_um=UM).notes
    assert any("XResolution states 0.5 um" in note for note in notes)
    assert not any("YResolution" in note for note in notes)


def test_the_voxel_size_of_the_image_that_is_read_counts(tmp_path: Path) -> None:
    """The first image of the file is smaller, and has another voxel size."""
    with tifffile.TiffWriter(tmp_path / "a.tif") as file:
        for factor, voxels in ((10, BODY[:, :8, :8]), (1, BODY)):
            file.write(
                voxels, photometric="minisblack", resolutionunit="CENTIMETER",
                resolution=(1e4 / 0.25 / factor, 1e4 / 0.2 / factor),
                metadata={"axes": "ZYX", "unit": "um", "spacing": 0.5 * factor},
            )  # fmt: skip
    assert read.open(tmp_path / "a.tif").levels[0].spacing_um == pytest.approx(UM)
