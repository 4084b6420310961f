"""Files of a folder, and pages of a TIFF file, that state different things, written by tifffile."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile

from stereocell import read
from stereocell.model.errors import SourceError
from support.phantoms import f_phantom
from support.reading import whole

BODY = f_phantom()
UM = (0.5, 0.2, 0.25)
HU = {"cf": 0, "c0": -1024.0, "c1": 2.0, "vunit": "HU"}
GDAL = (
    '<GDALMetadata><Item name="SCALE" sample="0" role="scale">{}</Item>'
    '<Item name="OFFSET" sample="0" role="offset">-1024</Item></GDALMetadata>'
)


def write_planes(folder: Path, **of_half: Any) -> Path:
    """Write each plane of BODY into a TIFF file, like ImageJ.

    of_half  options of tifffile for the second half of the planes, such as another resolution
    """
    folder.mkdir(exist_ok=True)
    for z, plane in enumerate(BODY):
        options: dict[str, Any] = {"resolution": (4.0, 5.0), "metadata": {"unit": "um"}}
        if 2 * z >= len(BODY):
            options |= of_half
        tifffile.imwrite(folder / f"a_z{z:02d}.tif", plane, imagej=True, **options)
    return folder


def write_stacks(folder: Path, stacks: list[Any], metadata: list[dict[str, Any]]) -> Path:
    folder.mkdir(exist_ok=True)
    for channel, (stack, own) in enumerate(zip(stacks, metadata, strict=True)):
        tifffile.imwrite(
            folder / f"a_c{channel}.tif", stack, imagej=True, resolution=(4.0, 5.0),
            metadata={"axes": "ZYX", "unit": "um", "spacing": 0.5, **own},
        )  # fmt: skip
    return folder


def test_calibrations_of_planes_are_applied_file_by_file(tmp_path: Path) -> None:
    dataset = read.open(write_planes(tmp_path, metadata={"unit": "um", **HU}), spacing_um=UM)
    expected = BODY.astype(np.float32)
    expected[len(BODY) // 2 :] = 2 * expected[len(BODY) // 2 :] - 1024
    np.testing.assert_array_equal(whole(dataset), expected)
    assert any("8 of 16 planes: values: ImageJ's calibration" in one for one in dataset.notes)


def test_pixel_sizes_of_planes_are_compared(tmp_path: Path) -> None:
    metadata = {"unit": "um", "spacing": 0.5}
    path = write_planes(tmp_path, resolution=(2.0, 5.0), metadata=metadata)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx(UM)
    assert any(
        "along x: a_z00.tif states 0.25 um, a_z08.tif states 0.5 um" in one for one in dataset.notes
    )


def test_planes_whose_zero_is_white_are_noted_and_not_mixed(tmp_path: Path) -> None:
    for z, plane in enumerate(BODY):
        path = tmp_path / f"a_z{z:02d}.tif"
        tifffile.imwrite(path, plane, photometric="miniswhite", metadata=None)
    assert any("0 is white" in note for note in read.open(tmp_path, spacing_um=UM).notes)
    tifffile.imwrite(tmp_path / "a_z00.tif", BODY[0], photometric="minisblack", metadata=None)
    with pytest.raises(SourceError, match="0 for white in 15 of 16 planes"):
        read.open(tmp_path, spacing_um=UM)


@pytest.mark.parametrize("unit", ["\u00b5m", ""])
def test_planes_of_ome_tiff_have_the_size_and_place_of_their_xml(tmp_path: Path, unit: str) -> None:
    for z, plane in enumerate(BODY):
        tifffile.imwrite(
            tmp_path / f"a_z{z:02d}.ome.tif", plane,
            metadata={
                "axes": "YX", "PhysicalSizeX": 0.25, "PhysicalSizeY": 0.2, "PhysicalSizeZ": 1.0,
                "Plane": {"PositionZ": [0.5 * z]}
                | ({"PositionZUnit": [unit]} if unit else {}),
            },
        )  # fmt: skip
    dataset = read.open(tmp_path)
    assert dataset.levels[0].spacing_um == pytest.approx((0.5 if unit else 1.0, 0.2, 0.25))
    assert any("PositionZ of the planes" in note for note in dataset.notes)
    np.testing.assert_array_equal(whole(dataset), BODY)


def test_calibrations_of_stacks_are_applied_channel_by_channel(tmp_path: Path) -> None:
    dataset = read.open(write_stacks(tmp_path, [BODY, BODY], [HU, {}]))
    np.testing.assert_array_equal(whole(dataset, 0), 2 * BODY.astype(np.float32) - 1024)
    np.testing.assert_array_equal(whole(dataset, 1), BODY)
    assert any("'a_c0.tif': values: ImageJ's calibration" in note for note in dataset.notes)


def test_voxel_sizes_of_stacks_are_compared(tmp_path: Path) -> None:
    dataset = read.open(write_stacks(tmp_path, [BODY, BODY], [{}, {"spacing": 1.0}]))
    assert dataset.levels[0].spacing_um == pytest.approx(UM)
    assert any("a_c1.tif states 1 um: a_c0.tif is used" in note for note in dataset.notes)


def test_stacks_of_different_depth_are_refused_with_their_sizes(tmp_path: Path) -> None:
    path = write_stacks(tmp_path, [BODY, BODY[:8]], [{}, {}])
    with pytest.raises(SourceError, match=r"found 8 x 48 x 36 voxels .* expected 16 x 48 x 36"):
        read.open(path)


def test_pages_of_different_orientation_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    with tifffile.TiffWriter(path) as writer:
        for z, plane in enumerate(BODY):
            tags: Any = [(274, "H", 1, 1 if z < 8 else 4, True)]
            writer.write(plane, metadata=None, photometric="minisblack", extratags=tags)
    with pytest.raises(SourceError, match="Orientation: found 1 in 8 and 4 in 8 of 16 pages"):
        read.open(path, spacing_um=UM)


def test_a_page_among_others_whose_zero_is_white_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    with tifffile.TiffWriter(path) as writer:
        for z, plane in enumerate(BODY):
            kind = "miniswhite" if z == 5 else "minisblack"
            writer.write(plane, metadata=None, photometric=kind)
    with pytest.raises(SourceError, match="PhotometricInterpretation: found 1 in 15 and 0 in 1"):
        read.open(path, spacing_um=UM)


@pytest.mark.parametrize("slope", [2, 0.5])
def test_the_scale_of_gdal_is_applied(tmp_path: Path, slope: float) -> None:
    path = tmp_path / "a.tif"
    tifffile.imwrite(
        path, BODY, photometric="minisblack", metadata=None,
        extratags=[(42112, "s", 0, GDAL.format(slope), True)],
    )  # fmt: skip
    dataset = read.open(path, spacing_um=UM)
    np.testing.assert_array_equal(whole(dataset), slope * BODY.astype(np.float32) - 1024)
    assert any(f"SCALE {slope:g} and OFFSET -1024 of GDAL" in note for note in dataset.notes)


def test_the_missing_value_of_gdal_is_not_a_measurement(tmp_path: Path) -> None:
    stored = BODY.astype(np.float32) + 5
    stored[3, :4] = -9999
    path = tmp_path / "a.tif"
    tifffile.imwrite(
        path, stored, photometric="minisblack", metadata=None,
        extratags=[(42113, "s", 0, "-9999", True)],
    )  # fmt: skip
    dataset = read.open(path, spacing_um=UM)
    assert whole(dataset).min() == BODY.min() + 5
    assert any("GDAL_NODATA -9999" in note for note in dataset.notes)


@pytest.mark.parametrize(
    ("step_um", "unit", "expected"),
    [
        (2.0, "\u00b5m", "differs by up to 30 um (120 voxels): the planes are not shifted along x"),
        (0.002, "mm", "differs by up to 30 um (120 voxels)"),
        (0.005, "\u00b5m", ""),
        (2.0, "reference frame", ""),
    ],
)
def test_planes_that_lie_beside_each_other_are_noted(
    tmp_path: Path, step_um: float, unit: str, expected: str
) -> None:
    path = tmp_path / "a.ome.tif"
    aside = {"PositionX": [step_um * n for n in range(16)], "PositionXUnit": [unit] * 16}
    sizes = {"PhysicalSizeX": 0.25, "PhysicalSizeY": 0.2, "PhysicalSizeZ": 0.5}
    tifffile.imwrite(path, BODY, metadata={"axes": "ZYX", "Plane": aside, **sizes})
    notes = read.open(path).notes
    assert len(notes) == bool(expected)
    assert all("PositionX" in note and expected in note for note in notes)


def test_files_of_planes_that_lie_beside_each_other_are_noted(tmp_path: Path) -> None:
    sizes = {"PhysicalSizeX": 0.25, "PhysicalSizeY": 0.2, "PhysicalSizeZ": 0.5}
    for number, plane in enumerate(BODY):
        aside = {"PositionY": [float(number)], "PositionYUnit": ["\u00b5m"]}
        tifffile.imwrite(
            tmp_path / f"a_z{number:02d}.tif", plane, ome=True,
            metadata={"axes": "YX", "Plane": aside, **sizes},
        )  # fmt: skip
    (note,) = [note for note in read.open(tmp_path).notes if "PositionY" in note]
    assert "differs by up to 15 um (75 voxels)" in note
