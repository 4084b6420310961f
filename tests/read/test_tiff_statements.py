"""Orientation, positions of planes and further axes of TIFF, written by tifffile."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from PIL import Image as PillowImage

from stereocell import read
from stereocell.model.errors import UsageError
from stereocell.read import list_series
from support.phantoms import f_phantom
from support.reading import read_voxels

BODY = f_phantom()
OTHER = BODY[:, ::-1]
UM = (0.5, 0.2, 0.25)
MODULO = (
    '<StructuredAnnotations><XMLAnnotation ID="Annotation:0" '
    'Namespace="openmicroscopy.org/omero/dimension/modulo"><Value><Modulo '
    'namespace="http://www.openmicroscopy.org/Schemas/Additions/2011-09">{}</Modulo></Value>'
    "</XMLAnnotation></StructuredAnnotations>"
)


def write_ome(
    path: Path, voxels: Any, *, sizes: dict[str, int] | None = None, depth: str = "0.5",
    planes: str = "", after: str = "", inside: str = "", **options: Any,
) -> Path:  # fmt: skip
    """Write planes (n, y, x) as an OME-TIFF.

    sizes   number of planes along Z, C and T; by default all lie along Z
    depth   PhysicalSizeZ, um; "": not stated
    planes  elements inside of Pixels
    inside  elements inside of Image, after Pixels
    after   elements after Image
    """
    count, y, x = voxels.shape
    held = {"Z": count, "C": 1, "T": 1} | (sizes or {})
    z_size = f'PhysicalSizeZ="{depth}"' if depth else ""
    xml = (
        '<OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><Image ID="Image:0">'
        f'<Pixels ID="Pixels:0" DimensionOrder="XYZCT" Type="uint16" SizeX="{x}" SizeY="{y}" '
        f'SizeZ="{held["Z"]}" SizeC="{held["C"]}" SizeT="{held["T"]}" PhysicalSizeX="0.25" '
        f'PhysicalSizeY="0.2" {z_size}>'
        + "".join(f'<Channel ID="C:{c}" Name="c{c}" SamplesPerPixel="1"/>'
                  for c in range(held["C"]))
        + f"<TiffData/>{planes}</Pixels>{inside}</Image>{after}</OME>"
    )  # fmt: skip
    tifffile.imwrite(
        path, voxels, description=xml.encode(), metadata=None, photometric="minisblack", **options
    )
    return path


def places(values: Any, unit: str = "\u00b5m", times: Any = None) -> str:
    return "".join(
        f'<Plane TheZ="{z}" TheC="0" TheT="0" PositionZ="{value:.4f}" PositionZUnit="{unit}"'
        + (f' DeltaT="{times[z]}"' if times is not None else "") + "/>"
        for z, value in enumerate(values)
    )  # fmt: skip


def upright(stored: Any, orientation: int) -> Any:
    """Return stored planes (z, row, column) turned as TIFF 6.0 states for tag 274, Orientation."""
    row = {1: "t", 2: "t", 3: "b", 4: "b", 5: "l", 6: "r", 7: "r", 8: "l"}[orientation]
    column = {1: "l", 2: "r", 3: "r", 4: "l", 5: "t", 6: "t", 7: "b", 8: "b"}[orientation]
    seen = stored
    if row in "lr":  # stored rows are columns of the image
        seen = seen.swapaxes(1, 2)
        row, column = column, row
    seen = seen[:, ::-1] if row == "b" else seen
    return seen[:, :, ::-1] if column == "r" else seen


@pytest.mark.parametrize("orientation", range(1, 9))
def test_planes_are_turned_by_the_tag_orientation(tmp_path: Path, orientation: int) -> None:
    path = tmp_path / "a.tif"
    tifffile.imwrite(
        path, BODY, photometric="minisblack",
        metadata={"axes": "ZYX", "spacing": 0.5, "unit": "um"}, resolution=(4.0, 5.0),
        extratags=[(274, "H", 1, orientation, True)],
    )  # fmt: skip
    dataset = read.open(path)
    np.testing.assert_array_equal(read_voxels(path), upright(BODY, orientation))
    y, x = (0.2, 0.25) if orientation < 5 else (0.25, 0.2)
    assert dataset.levels[0].spacing_um == pytest.approx((0.5, y, x))
    assert any("Orientation" in note for note in dataset.notes) == (orientation > 1)


@pytest.mark.parametrize("orientation", [3, 4, 6, 8])
@pytest.mark.parametrize("ending", ["tif", "jpg"])
def test_planes_of_a_folder_are_turned_by_the_tag_orientation(
    tmp_path: Path, orientation: int, ending: str
) -> None:
    colour = np.repeat((BODY // 8).astype(np.uint8)[..., None], 3, axis=-1)
    for number, plane in enumerate(BODY):
        path = tmp_path / f"a_z{number:02d}.{ending}"
        if ending == "tif":
            tags: Any = [(274, "H", 1, orientation, True)]
            tifffile.imwrite(path, plane, metadata=None, extratags=tags)
        else:
            exif = PillowImage.Exif()
            exif[274] = orientation
            PillowImage.fromarray(colour[number]).save(path, quality=100, exif=exif)
    dataset = read.open(tmp_path, spacing_um=UM)
    voxels = dataset.read(0, dataset.levels[0].box).voxels.astype(float)
    expected = upright(BODY if ending == "tif" else colour[..., 0], orientation)
    assert np.abs(voxels - expected).max() < (1 if ending == "tif" else 30)
    assert any(f"Orientation {orientation}" in note for note in dataset.notes)


@pytest.mark.parametrize(
    ("function", "expected", "reason"),
    [
        ({"cf": 0, "c0": -32768.0, "c1": 1.0, "vunit": "HU"}, BODY.astype(int) - 32768, "HU"),
        ({"cf": 0, "c0": 0.5, "c1": 0.25, "vunit": "OD"}, BODY * 0.25 + 0.5, "0.5 + 0.25"),
        ({"cf": 0, "c0": 0.0, "c1": 1.0, "vunit": "Gray Value"}, BODY, ""),
        ({"cf": 1, "c0": 0.0, "c1": 1.0, "c2": 2.0, "vunit": "OD"}, BODY, "not a straight line"),
        ({"cf": 20}, BODY, ""),
        ({"cf": 21, "vunit": "Uncalibrated OD"}, BODY, "(Uncalibrated OD) is not a straight line"),
        ({"c0": -1024.0, "c1": 2.0}, BODY * 2.0 - 1024, "-1024 + 2"),
        ({}, BODY, ""),
    ],
)
def test_a_calibration_of_imagej_is_applied(
    tmp_path: Path, function: dict[str, Any], expected: Any, reason: str
) -> None:
    path = tmp_path / "a.tif"
    tifffile.imwrite(
        path, BODY, imagej=True, resolution=(4.0, 5.0),
        metadata={"axes": "ZYX", "spacing": 0.5, "unit": "um", **function},
    )  # fmt: skip
    dataset = read.open(path)
    np.testing.assert_array_equal(read_voxels(path), expected)
    notes = [note for note in dataset.notes if "values:" in note]
    assert len(notes) == bool(reason)
    assert all(reason in note for note in notes)


def test_a_negative_depth_of_imagej_is_a_depth(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    metadata = {"axes": "ZYX", "spacing": -0.5, "unit": "um"}
    tifffile.imwrite(path, BODY, imagej=True, resolution=(4.0, 5.0), metadata=metadata)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx((0.5, 0.2, 0.25))
    assert "ImageJ states -0.5 um" in dataset.notes[0]


def test_pages_of_another_type_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    with tifffile.TiffWriter(path) as writer:
        for z, plane in enumerate(BODY):
            page = plane if z < 8 else (plane // 8).astype(np.uint8)
            writer.write(page, metadata=None, photometric="minisblack")
    notes = read.open(path, spacing_um=UM).notes
    assert any("8 of 16 pages" in note and "uint8" in note for note in notes)


def test_labels_that_name_channels_among_the_slices_are_noted(tmp_path: Path) -> None:
    labels = [f"c:{c}/2 z:{z}/8 - a.nd2" for z in range(1, 9) for c in (1, 2)]
    for given, is_reported in ((labels, True), ([f"z:{z}/16" for z in range(16)], False)):
        path = tmp_path / "a.tif"
        tifffile.imwrite(
            path, BODY, imagej=True, resolution=(4.0, 5.0),
            metadata={"axes": "ZYX", "spacing": 0.5, "unit": "um", "Labels": given},
        )  # fmt: skip
        notes = read.open(path).notes
        assert (
            any("the labels of the slices name 2 channels" in note for note in notes) == is_reported
        )


def test_the_orientation_of_ome_tiff_is_noted_and_not_applied(tmp_path: Path) -> None:
    path = write_ome(tmp_path / "a.ome.tif", BODY, extratags=[(274, "H", 1, 4, True)])
    np.testing.assert_array_equal(read_voxels(path), BODY)
    assert "not applied, as usual for OME-TIFF" in read.open(path).notes[0]


@pytest.mark.parametrize(
    ("depth", "values", "found", "expected"),
    [
        ("1.0", np.arange(16) * 0.6, 0.6, "PositionZ of the planes states 0.6 um"),
        ("", np.arange(16) * 0.6, 0.6, "0.6 um by the planes' PositionZ"),
        ("0", np.arange(16) * 0.6, 0.6, "0.6 um by the planes' PositionZ"),
        ("0.6", 9 - np.arange(16) * 0.6, 0.6, "PositionZ falls from 9 to 0 um"),
        ("1.0", 9 - np.arange(16) * 0.6, 0.6, "PositionZ of the planes states 0.6 um"),
        ("0.5", np.arange(16) ** 2 * 0.1, 0.5, "uneven: steps of 0.1 to 2.9 um"),
        ("0.5", np.abs(np.arange(16) - 4.0), 0.5, "rises and falls"),
        ("0.5", np.arange(16) * 500.0, 0.5, "PhysicalSizeZ is used"),
    ],
)
def test_positions_of_planes_are_compared_with_the_depth(
    tmp_path: Path, depth: str, values: Any, found: float, expected: str
) -> None:
    path = write_ome(tmp_path / "a.ome.tif", BODY, depth=depth, planes=places(values))
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx((found, 0.2, 0.25))
    assert any(expected in note for note in dataset.notes)


@pytest.mark.parametrize(
    "planes",
    [
        places(np.arange(16) * 0.5),
        places(np.arange(16) * 0.5).replace('PositionZUnit="\u00b5m"', ""),
        places(np.arange(16) * 0.5 + np.tile([0.0, 0.003], 8)),
        places(np.arange(16) * 5e-4, "mm"),
        places(np.arange(16), "reference frame"),
        places(np.zeros(16)),
        "",
    ],
)
def test_positions_that_agree_or_are_not_lengths_need_no_note(tmp_path: Path, planes: str) -> None:
    dataset = read.open(write_ome(tmp_path / "a.ome.tif", BODY, planes=planes))
    assert dataset.levels[0].spacing_um == pytest.approx((0.5, 0.2, 0.25))
    assert dataset.notes == ()


def test_positions_without_a_unit_are_compared_and_not_used(tmp_path: Path) -> None:
    planes = places(np.arange(16) * 0.6).replace('PositionZUnit="\u00b5m"', "")
    dataset = read.open(write_ome(tmp_path / "a.ome.tif", BODY, depth="1.0", planes=planes))
    assert dataset.levels[0].spacing_um[0] == 1.0
    assert "PositionZ of the planes (um are assumed) states 0.6 um" in dataset.notes[0]


@pytest.mark.parametrize(("stated", "is_noted"), [("int16", True), ("uint16", False)])
def test_types_of_voxels_that_disagree_are_noted(
    tmp_path: Path, stated: str, is_noted: bool
) -> None:
    path = write_ome(tmp_path / "a.ome.tif", BODY.astype(np.uint16))
    tifffile.tiffcomment(path, tifffile.tiffcomment(path).replace('"uint16"', f'"{stated}"'))
    note = (
        "type of the voxels: the TIFF header states uint16, Type of Pixels states int16: "
        "the TIFF header is used"
    )
    assert (note in read.open(path).notes) is is_noted


def test_planes_at_one_position_whose_time_rises_are_noted(tmp_path: Path) -> None:
    planes = places(np.zeros(16), times=range(16))
    dataset = read.open(write_ome(tmp_path / "a.ome.tif", BODY, planes=planes))
    assert "may be time points" in dataset.notes[0]


ANGLES = MODULO.format('<ModuloAlongZ Type="angle" Unit="degree" Start="0" End="90" Step="90"/>')
STACKS = np.concatenate([BODY, OTHER])
ALTERNATELY = np.stack([BODY, OTHER], axis=1).reshape(32, 48, 36)


@pytest.mark.parametrize(
    ("stored", "expected"), [(STACKS, "after another"), (ALTERNATELY, "alternately")]
)
def test_angles_along_z_are_separate_images(tmp_path: Path, stored: Any, expected: str) -> None:
    path = write_ome(tmp_path / "a.ome.tif", stored, after=ANGLES)
    first = read.open(path)
    np.testing.assert_array_equal(read_voxels(path), BODY)
    np.testing.assert_array_equal(read_voxels(path, series=2), OTHER)
    assert any("2 angles" in note and expected in note for note in first.notes)
    assert first.levels[0].spacing_um == pytest.approx(UM)
    listed = list_series(path)
    assert len(listed) == 2
    assert "angle 90 degree, 16 x 48 x 36 voxels" in listed[1]
    with pytest.raises(UsageError, match="--series: found 3, expected 1 to 2"):
        read.open(path, series=3)


def test_positions_show_how_angles_are_stored(tmp_path: Path) -> None:
    """The two angles show the same image, so the voxels can't decide."""
    stored = np.stack([BODY, BODY + 1], axis=1).reshape(32, 48, 36)
    planes = places(np.repeat(np.arange(16) * 0.5, 2))
    path = write_ome(tmp_path / "a.ome.tif", stored, after=ANGLES, planes=planes)
    np.testing.assert_array_equal(read_voxels(path, series=2), BODY + 1)


def test_lifetimes_along_time_are_not_time_points(tmp_path: Path) -> None:
    note = MODULO.format(
        '<ModuloAlongT Type="lifetime" Unit="ps"><Label>0</Label><Label>50</Label></ModuloAlongT>'
    )
    path = write_ome(tmp_path / "a.ome.tif", STACKS, sizes={"Z": 16, "T": 2}, after=note)
    dataset = read.open(path, series=2)
    assert dataset.time_points == 1
    np.testing.assert_array_equal(read_voxels(path, series=2), OTHER)


def test_wavelengths_along_c_are_channels_and_phases_are_not(tmp_path: Path) -> None:
    lambdas = MODULO.format('<ModuloAlongC Type="lambda" Start="500" End="510" Step="10"/>')
    path = write_ome(tmp_path / "a.ome.tif", STACKS, sizes={"Z": 16, "C": 2}, after=lambdas)
    assert len(read.open(path).channels) == 2
    phases = MODULO.format('<ModuloAlongC Type="phase" Start="0" End="1" Step="1"/>')
    other = write_ome(tmp_path / "b.ome.tif", STACKS, sizes={"Z": 16, "C": 2}, after=phases)
    assert [one.name for one in read.open(other, series=2).channels] == ["c1"]
    np.testing.assert_array_equal(read_voxels(other, series=2), OTHER)


def test_a_further_axis_of_another_image_or_size_is_not_used(tmp_path: Path) -> None:
    three = MODULO.format('<ModuloAlongZ Type="angle" Start="0" End="4" Step="1"/>')
    path = write_ome(tmp_path / "a.ome.tif", STACKS, after=three)
    assert read.open(path).levels[0].shape == (32, 48, 36)
    assert "5 angles, by which 32 planes along z can't be divided" in read.open(path).notes[0]


def test_a_plain_tiff_is_one_series(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, BODY, imagej=True, resolution=(4.0, 5.0),
                     metadata={"axes": "ZYX", "spacing": 0.5, "unit": "um"})  # fmt: skip
    assert len(list_series(path)) == 1
    with pytest.raises(UsageError, match="--series: found 2, expected 1, the only one"):
        read.open(path, series=2)
    np.testing.assert_array_equal(read_voxels(path, series=1), BODY)


@pytest.mark.parametrize(("unit", "is_reported"), [("CENTIMETER", True), ("INCH", False)])
def test_the_resolution_in_the_tags_is_compared_with_the_ome_xml(
    tmp_path: Path, unit: str, is_reported: bool
) -> None:
    per_um = 1e4 if unit == "CENTIMETER" else 25400.0
    same = (per_um / 0.25, per_um / 0.2)  # pixels per cm along x and y
    path = write_ome(tmp_path / "a.ome.tif", BODY, resolution=same, resolutionunit=unit)
    assert read.open(path).notes == ()
    half = (per_um / 0.25, per_um / 0.1)
    path = write_ome(tmp_path / "b.ome.tif", BODY, resolution=half, resolutionunit=unit)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx(UM)
    beginning = "voxel spacing along y: PhysicalSize of the OME-XML states 0.2 um"
    assert [note.startswith(beginning) for note in dataset.notes] == [True] * is_reported


def test_a_field_that_imagej_s_description_holds_twice_is_reported(tmp_path: Path) -> None:
    lines = ["ImageJ=1.54f", "images=16", "slices=16", "unit=um", "spacing=0.5", "spacing=2"]
    path = tmp_path / "a.tif"
    tifffile.imwrite(
        path, BODY, description="\n".join(lines), metadata=None, resolution=(4.0, 5.0),
        photometric="minisblack",
    )  # fmt: skip
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx((2.0, 0.2, 0.25))
    (note,) = dataset.notes
    assert "spacing of ImageJ's description: its last line states 2, an earlier" in note


@pytest.mark.parametrize(
    ("z", "y", "x", "expected"),
    [
        ("1", "0.5", "0.0005", "pixels 1000 times as long along y as along x"),
        ("1000", "0.5", "0.5", "slices 1e+03 um apart along z with pixels of 0.5 um"),
        ("0.001", "0.5", "0.5", "slices 0.001 um apart"),
        ("100", "0.5", "0.5", ""),
        ("1", "5", "0.5", ""),
    ],
)
def test_voxels_far_longer_along_one_axis_are_questioned(
    tmp_path: Path, z: str, y: str, x: str, expected: str
) -> None:
    sizes = {f"PhysicalSize{axis}": float(um) for axis, um in zip("ZYX", (z, y, x), strict=True)}
    path = tmp_path / "a.ome.tif"
    tifffile.imwrite(path, BODY, metadata={"axes": "ZYX", **sizes})
    notes = read.open(path).notes
    assert len(notes) == bool(expected)
    assert all(expected in note and "is the unit of one of them wrong?" in note for note in notes)
    assert read.open(path, spacing_um=UM).notes == ()
