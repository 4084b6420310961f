"""NRRD, MetaImage, MRC and Imaris that state one thing twice: the note, and the value used."""

from pathlib import Path
from typing import Any

import h5py
import mrcfile
import numpy as np
import pytest
import SimpleITK as sitk

from stereocell import read
from stereocell.model.errors import SourceError
from support.array_files import SIZE_UM, characters, write_ims
from support.dicom_reading import whole
from support.phantoms import f_phantom

NRRD_HEAD = "NRRD0005\ntype: uint16\ndimension: 3\nsizes: 36 48 16\nendian: little\nencoding: raw\n"
META_HEAD = "ObjectType = Image\nNDims = 3\nDimSize = 36 48 16\nElementType = MET_USHORT\n"
TURNED = "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0"
ORIGIN = "space origin: (0,0,0)"
SLICER = "as Slicer and ITK do in a patient's space"


def write_nrrd(path: Path, *lines: str, encoding: str = "utf-8") -> Path:
    text = NRRD_HEAD + "\n".join(lines) + "\n\n"
    path.write_bytes(text.encode(encoding) + f_phantom().astype("<u2").tobytes())
    return path


def write_meta(path: Path, *lines: str) -> Path:
    text = META_HEAD + "\n".join(lines) + "\nElementDataFile = LOCAL\n"
    path.write_bytes(text.encode() + f_phantom().astype("<u2").tobytes())
    return path


def spacing_notes(dataset: read.Dataset) -> list[str]:
    return [note for note in dataset.notes if note.startswith("voxel spacing")]


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
@pytest.mark.parametrize("unit", ["\u00b5m", "microns", "micrometer", "Micrometres", "um"])
@pytest.mark.parametrize("field", ["units", "space units"])
def test_each_spelling_of_the_micrometre_is_recognised(
    tmp_path: Path, encoding: str, unit: str, field: str
) -> None:
    lengths = "spacings: 0.25 0.2 0.5"
    if field == "space units":
        lengths = "space dimension: 3\nspace directions: (0.25,0,0) (0,0.2,0) (0,0,0.5)"
    units = " ".join([f'"{unit}"'] * 3)
    path = write_nrrd(tmp_path / "a.nrrd", lengths, f"{field}: {units}", encoding=encoding)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx((0.5, 0.2, 0.25))
    assert dataset.notes == ()


def test_the_greek_mu_of_nrrd_is_a_micro(tmp_path: Path) -> None:
    units = 'units: "\u03bcm" "\u03bcm" "\u03bcm"'
    dataset = read.open(write_nrrd(tmp_path / "a.nrrd", "spacings: 1 2 3", units))
    assert dataset.levels[0].spacing_um == (3, 2, 1)


def test_units_may_differ_from_axis_to_axis(tmp_path: Path) -> None:
    path = write_nrrd(tmp_path / "a.nrrd", "spacings: 250 200 0.5", 'units: "nm" "nm" "um"')
    assert read.open(path).levels[0].spacing_um == pytest.approx((0.5, 0.2, 0.25))
    lines = (
        "space: LPS",
        "space directions: (250,0,0) (0,200,0) (0,0,0.5)",
        'space units: "um" "um" "mm"',
    )
    dataset = read.open(write_nrrd(tmp_path / "b.nrrd", *lines))
    assert dataset.levels[0].spacing_um == pytest.approx((200, 500, 250))  # anterior first


@pytest.mark.parametrize(
    ("units", "reason"), [("", SLICER), ('space units: "pixel" "pixel" "pixel"\n', "'pixel'")]
)
def test_a_unit_that_a_patient_s_nrrd_lacks_is_an_assumption(
    tmp_path: Path, units: str, reason: str
) -> None:
    lines = ("space: LPS", f"{units}space directions: (1,0,0) (0,1,0) (0,0,2)", ORIGIN)
    (note,) = read.open(write_nrrd(tmp_path / "a.nrrd", *lines)).notes
    assert note.startswith("unit of length: not stated, mm is assumed")
    assert reason in note


def test_spacings_that_contradict_the_directions_are_reported(tmp_path: Path) -> None:
    lines = ("space directions: (0.25,0,0) (0,0.2,0) (0,0,0.5)", "space dimension: 3")
    lines += ("spacings: 0.25 0.2 2", 'space units: "um" "um" "um"')
    dataset = read.open(write_nrrd(tmp_path / "a.nrrd", *lines))
    assert dataset.levels[0].spacing_um == pytest.approx((0.5, 0.2, 0.25))
    (note,) = spacing_notes(dataset)
    assert "space directions states 0.25, 0.2, 0.5" in note
    assert "spacings states 0.25, 0.2, 2" in note


@pytest.mark.parametrize(("kind", "added"), [("node", 0), ("cell", 1)])
def test_the_ends_of_axes_give_the_spacing_by_their_centering(
    tmp_path: Path, kind: str, added: int
) -> None:
    ends = [(n - 1 + added) * s for n, s in zip((36, 48, 16), (0.25, 0.2, 0.5), strict=True)]
    maxs = " ".join(str(end) for end in ends)
    lines = (f"axis mins: 0 0 0\naxis maxs: {maxs}", f"centerings: {kind} {kind} {kind}")
    path = write_nrrd(tmp_path / "a.nrrd", *lines, 'units: "um" "um" "um"')
    assert read.open(path).levels[0].spacing_um == pytest.approx((0.5, 0.2, 0.25))
    path = write_nrrd(
        tmp_path / "b.nrrd", *lines, 'units: "um" "um" "um"', "spacings: 0.25 0.2 0.6"
    )
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx((0.6, 0.2, 0.25))
    assert "the range of axis mins and maxs states 0.25, 0.2, 0.5" in spacing_notes(dataset)[0]


def test_the_range_before_a_nrrd_was_mapped_is_reported(tmp_path: Path) -> None:
    lines = ("spacings: 1 1 1", 'units: "um" "um" "um"', "old min: -1000", "old max: 3000")
    (note,) = read.open(write_nrrd(tmp_path / "a.nrrd", *lines)).notes
    assert "old min -1000 and old max 3000" in note


def test_a_left_handed_space_is_reported(tmp_path: Path) -> None:
    lines = ("space: 3D-left-handed", "space directions: (1,0,0) (0,1,0) (0,0,1)")
    path = write_nrrd(tmp_path / "a.nrrd", *lines, 'space units: "um" "um" "um"')
    assert any("left-handed" in note for note in read.open(path).notes)


@pytest.mark.parametrize(
    ("lines", "field"),
    [
        (("ElementSize = 9 9 9", "ElementSpacing = 0.5 0.7 2"), "ElementSpacing"),
        (
            (
                "ElementSpacing = 0.5 0.7 2",
                "Orientation = -1 0 0 0 -1 0 0 0 1",
                "Rotation = 0 1 0 -1 0 0 0 0 1",
            ),
            "TransformMatrix",
        ),
        (("ElementSpacing = 0.5 0.7 2", "Offset = 1 1 1", "Origin = 3 3 3"), "Offset"),
        (
            (
                "ElementSpacing = 0.5 0.7 2",
                "ElementByteOrderMSB = True",
                "BinaryDataByteOrderMSB = False",
            ),
            "BinaryDataByteOrderMSB",
        ),
    ],
)
def test_names_of_a_field_that_disagree_are_reported_and_read_as_in_itk(
    tmp_path: Path, lines: tuple[str, ...], field: str
) -> None:
    path = write_meta(tmp_path / "a.mha", *lines)
    dataset = read.open(path)
    assert any(note.startswith(f"field {field}: ") for note in dataset.notes)
    again = sitk.ReadImage(str(path))
    sitk.WriteImage(again, str(tmp_path / "b.nrrd"))
    expected = read.open(tmp_path / "b.nrrd")
    np.testing.assert_array_equal(whole(dataset), whole(expected))
    assert dataset.levels == expected.levels
    np.testing.assert_allclose(dataset.placement, expected.placement)


def test_a_repeated_field_is_reported_and_read_as_in_itk(tmp_path: Path) -> None:
    path = write_meta(tmp_path / "a.mha", "ElementSpacing = 1 1 2", "ElementSpacing = 1 1 5")
    dataset = read.open(path)
    spacing_um = tuple(1000 * mm for mm in sitk.ReadImage(str(path)).GetSpacing())
    assert sorted(dataset.levels[0].spacing_um) == sorted(spacing_um) == [1000, 1000, 5000]
    (note,) = [note for note in dataset.notes if note.startswith("field ElementSpacing")]
    assert "its last line states 1, 1, 5, an earlier line states 1, 1, 2" in note


def test_a_repeated_field_with_one_value_needs_no_note(tmp_path: Path) -> None:
    lines = (TURNED, "ElementSpacing = 1 1 2")
    assert read.open(write_meta(tmp_path / "a.mha", *lines, "ElementSpacing = 1.0 1 2")).notes == ()


def test_a_spacing_that_nrrd_states_twice_is_refused(tmp_path: Path) -> None:
    lines = ("space: LPS", "spacings: 1 1 2", "spacings: 1 1 5")
    with pytest.raises(SourceError, match="spacings"):
        read.open(write_nrrd(tmp_path / "a.nrrd", *lines))


def test_a_scale_in_the_matrix_is_reported_and_applied_as_in_itk(tmp_path: Path) -> None:
    lines = ("TransformMatrix = 2 0 0 0 2 0 0 0 2", "ElementSpacing = 1 1 2")
    path = write_meta(tmp_path / "a.mha", *lines)
    dataset = read.open(path)
    image = sitk.ReadImage(str(path))
    origin, end = (image.TransformIndexToPhysicalPoint(at) for at in ((0, 0, 0), (0, 0, 1)))
    assert max(dataset.levels[0].spacing_um) == 1000 * (end[2] - origin[2]) == 4000
    (note,) = spacing_notes(dataset)
    assert "TransformMatrix times ElementSpacing states 2, 2, 4 mm" in note
    assert "only ElementSpacing states 1, 1, 2 mm" in note


def test_names_of_a_field_that_agree_need_no_note(tmp_path: Path) -> None:
    lines = (TURNED, "Rotation = 1.0 0 0 0 1 0 0 0 1")
    lines += ("ElementSpacing = 1 1 1", "ElementSize = 1.0 1.0 1.0")
    lines += ("AnatomicalOrientation = RAI", "ElementToIntensityFunctionSlope = 1")
    assert read.open(write_meta(tmp_path / "a.mha", *lines)).notes == ()


def test_an_anatomical_orientation_that_contradicts_the_matrix_is_reported(tmp_path: Path) -> None:
    lines = (TURNED, "AnatomicalOrientation = LAI")
    path = write_meta(tmp_path / "a.mha", *lines, "ElementSpacing = 1 1 1")
    (note,) = read.open(path).notes
    assert "TransformMatrix states R, A, I, AnatomicalOrientation states L, A, I" in note


@pytest.mark.parametrize(("unit", "per"), [("um", 1), ("mm", 1000), ("cm", 10_000)])
def test_metaimage_s_unit_of_length_is_followed(tmp_path: Path, unit: str, per: float) -> None:
    lines = (f"DistanceUnits = {unit}", TURNED)
    dataset = read.open(write_meta(tmp_path / "a.mha", *lines, "ElementSpacing = 1.2 1.3 1.4"))
    found = sorted(dataset.levels[0].spacing_um)
    assert found == pytest.approx([1.2 * per, 1.3 * per, 1.4 * per])
    assert bool(spacing_notes(dataset)) == (unit == "um")  # the volume is too small for a patient


def test_a_scale_of_values_that_itk_does_not_apply_is_reported(tmp_path: Path) -> None:
    lines = (TURNED, "ElementToIntensityFunctionSlope = 2")
    dataset = read.open(write_meta(tmp_path / "a.mha", *lines, "ElementSpacing = 1 1 1"))
    assert "ElementToIntensityFunctionSlope 2" in dataset.notes[0]
    assert whole(dataset).max() == f_phantom().max()


def test_a_number_of_dimensions_that_contradicts_the_sizes_is_refused(tmp_path: Path) -> None:
    path = write_meta(tmp_path / "a.mha", "ElementSpacing = 1 1 1")
    path.write_bytes(path.read_bytes().replace(b"NDims = 3", b"NDims = 4"))
    with pytest.raises(SourceError, match="NDims: found 4, expected 3, the number of sizes"):
        read.open(path)


def test_the_modality_of_a_metaimage_is_known(tmp_path: Path) -> None:
    path = write_meta(tmp_path / "a.mha", "Modality = MET_MOD_CT", "ElementSpacing = 1 1 1")
    assert read.open(path).modality == "CT"


def write_mrc(path: Path, voxels: Any = None, **fields: Any) -> Path:
    with mrcfile.new(path, overwrite=True) as file:
        file.set_data(f_phantom().astype(np.int16) if voxels is None else voxels)
        file.set_volume()
        file.voxel_size = (4.0, 8.0, 10.0)
        for name, value in fields.items():
            file.header[name] = value
    return path


def test_a_sampling_of_another_size_than_the_map_is_reported(tmp_path: Path) -> None:
    dataset = read.open(write_mrc(tmp_path / "a.mrc", mx=72))
    (note,) = spacing_notes(dataset)
    assert "cella.x by mx 72 states 2 Angstrom, cella.x by 36 voxels states 4 Angstrom" in note
    assert dataset.levels[0].spacing_um[2] == pytest.approx(2e-4)


def test_a_stack_whose_cell_is_the_whole_depth_is_reported(tmp_path: Path) -> None:
    dataset = read.open(write_mrc(tmp_path / "a.mrc", ispg=0, mz=1))
    assert "voxel spacing along z: cella.z by mz 1 states 160 Angstrom" in spacing_notes(dataset)[0]


def test_one_angstrom_exactly_may_be_unknown(tmp_path: Path) -> None:
    dataset = read.open(write_mrc(tmp_path / "a.mrc", cella=(36.0, 48.0, 16.0)))
    assert "exactly 1 Angstrom" in spacing_notes(dataset)[0]


@pytest.mark.parametrize(("factor", "is_reported"), [(1, False), (2, True)])
def test_a_pixel_size_of_the_camera_that_differs_is_reported(
    tmp_path: Path, factor: float, is_reported: bool
) -> None:
    kind = mrcfile.dtypes.get_ext_header_dtype(b"FEI1")
    extended = np.zeros(16, kind)
    extended["Metadata size"] = kind.itemsize
    extended["Pixel size X"], extended["Pixel size Y"] = factor * 4e-10, factor * 8e-10
    path = write_mrc(tmp_path / "a.mrc")
    with mrcfile.open(path, "r+") as file:
        file.set_extended_header(extended)
        file.header.exttyp = b"FEI1"
    notes = spacing_notes(read.open(path))
    assert len(notes) == 2 * is_reported
    assert all("the pixel size in FEI's extended header states" in note for note in notes)


@pytest.mark.parametrize(
    ("fields", "dtype", "words"),
    [
        ({}, np.int8, ""),
        ({"nversion": 0, "dmin": 0, "dmax": 60}, np.int8, "bytes of mode 0: not stated, signed"),
        ({"nversion": 0, "dmin": 0, "dmax": 200}, np.uint8, ""),
        ({"dmin": 0, "dmax": 200}, np.uint8, "dmax 200 states unsigned"),
    ],
)
def test_the_sign_of_bytes_follows_the_header(
    tmp_path: Path, fields: dict[str, Any], dtype: Any, words: str
) -> None:
    path = write_mrc(tmp_path / "a.mrc", (f_phantom() // 9).astype(np.int8), **fields)
    dataset = read.open(path)
    assert dataset.stored_dtype == dtype
    assert (
        any(words in note for note in dataset.notes)
        if words
        else not any("mode 0" in note for note in dataset.notes)
    )


def test_extents_of_imaris_that_contradict_the_microscope_are_reported(tmp_path: Path) -> None:
    path = write_ims(tmp_path / "a.ims", f_phantom()[None].repeat(2, 0))
    assert read.open(path).notes == ("2 time points; building --time 0",)
    with h5py.File(path, "a") as file:
        info = file["DataSetInfo/Image"]
        info.attrs["RecordingEntryPlaneSpacing"] = characters("2.5")
        info.attrs["RecordingEntrySampleSpacing"] = characters("0.25")
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    (note,) = spacing_notes(dataset)
    assert "the extent by 16 voxels states 0.5 um, RecordingEntryPlaneSpacing states 2.5" in note


def test_a_size_of_imaris_s_metadata_that_differs_is_reported(tmp_path: Path) -> None:
    path = write_ims(tmp_path / "a.ims", f_phantom()[None].repeat(2, 0))
    with h5py.File(path, "a") as file:
        file["DataSetInfo/Image"].attrs["Z"] = characters("8")
    assert "the extent by Z 8 of DataSetInfo states 1 um" in spacing_notes(read.open(path))[0]


def test_imaris_without_a_unit_or_a_calibration_is_an_assumption(tmp_path: Path) -> None:
    path = write_ims(tmp_path / "a.ims", f_phantom()[None].repeat(2, 0))
    with h5py.File(path, "a") as file:
        del file["DataSetInfo/Image"].attrs["Unit"]
    assert any("um is assumed, as in files of Imaris" in note for note in read.open(path).notes)
    with h5py.File(path, "a") as file:
        for axis, size in enumerate((36, 48, 16)):
            file["DataSetInfo/Image"].attrs[f"ExtMin{axis}"] = characters("0")
            file["DataSetInfo/Image"].attrs[f"ExtMax{axis}"] = characters(str(size))
    assert "exactly 1 um" in spacing_notes(read.open(path))[0]


def test_voxels_after_those_that_a_header_describes_are_reported(tmp_path: Path) -> None:
    lengths = "ElementSpacing = 0.5 0.7 2"
    paths = [
        write_nrrd(tmp_path / "a.nrrd", "spacings: 1 1 1", 'units: "um" "um" "um"'),
        write_meta(tmp_path / "a.mha", lengths),
        tmp_path / "a.nii",
        tmp_path / "a.mrc",
    ]
    sitk.WriteImage(sitk.GetImageFromArray(f_phantom()), str(paths[2]))
    with mrcfile.new(paths[3]) as file:
        file.set_data(f_phantom())
        file.voxel_size = 4.0
    plane = f_phantom()[:, 0].nbytes  # the smallest plane
    for path in paths:
        whole = path.read_bytes()
        for rest, is_reported in ((plane - 1, False), (plane, True)):
            path.write_bytes(whole + bytes(rest))
            expected = f"left out: {rest:,} bytes behind the voxels"
            assert any(expected in note for note in read.open(path).notes) == is_reported, path


def test_segments_of_slicer_are_objects_with_their_names(tmp_path: Path) -> None:
    image = sitk.GetImageFromArray((f_phantom() > 0).astype(np.uint8) * 3)
    for key, value in {"ID": "Segment_1", "LabelValue": "3", "Name": "liver",
                       "Color": "1 0 0"}.items():  # fmt: skip
        image.SetMetaData(f"Segment0_{key}", value)
    sitk.WriteImage(image, str(tmp_path / "a.seg.nrrd"))
    dataset = read.open(tmp_path / "a.seg.nrrd")
    assert dataset.labels == "segments of 3D Slicer in its header"
    assert dataset.objects.names == {3: "liver"}
    assert dataset.objects.colors == {3: (1.0, 0.0, 0.0)}


@pytest.mark.parametrize("stated", [None, "(nan,nan,nan)", "(3,4,5)"])
def test_a_place_in_the_patient_that_is_not_stated_is_noted(
    tmp_path: Path, stated: str | None
) -> None:
    lines = ["space: left-posterior-superior", "space directions: (1,0,0) (0,1,0) (0,0,1)"]
    lines += [] if stated is None else [f"space origin: {stated}"]
    notes = read.open(write_nrrd(tmp_path / "a.nrrd", *lines)).notes
    found = [note for note in notes if note.startswith("place of the first voxel in the patient")]
    reason = "is absent" if stated is None else "holds no numbers"
    expected = f"patient: not stated, 0, 0, 0 mm is assumed, since space origin {reason}"
    assert [note.endswith(expected) for note in found] == [True] * (stated != "(3,4,5)")


@pytest.mark.parametrize("lines", [("Offset = 3 4 5",), ()])
def test_a_metaimage_without_an_offset_is_noted_only_in_a_patient(
    tmp_path: Path, lines: tuple[str, ...]
) -> None:
    turned = ("TransformMatrix = 1 0 0 0 1 0 0 0 1",)
    for matrix, is_noted in ((turned, not lines), ((), False)):
        path = write_meta(tmp_path / "a.mha", "ElementSpacing = 1 1 1", *lines, *matrix)
        assert any("since Offset is absent" in note for note in read.open(path).notes) == is_noted


def test_axes_of_an_mrc_that_are_not_stated_are_noted(tmp_path: Path) -> None:
    with mrcfile.new(tmp_path / "a.mrc") as file:
        file.set_data(f_phantom().astype(np.int16))
        file.set_volume()
        file.voxel_size = 2.0
    stated = read.open(tmp_path / "a.mrc")
    with mrcfile.open(tmp_path / "a.mrc", mode="r+") as file:
        for name in ("mapc", "mapr", "maps"):
            file.header[name] = 0
    dataset = read.open(tmp_path / "a.mrc")
    (note,) = set(dataset.notes) - set(stated.notes)
    assert note.endswith("not stated, x, y, z is assumed, as in most files")
    np.testing.assert_array_equal(whole(dataset), whole(stated))


def test_a_size_that_imaris_does_not_state_is_noted(tmp_path: Path) -> None:
    path = write_ims(tmp_path / "a.ims", np.stack([f_phantom()] * 2), pad=2)
    stated = read.open(path).notes
    with h5py.File(path, "r+") as file:
        for axis in "ZYX":
            del file["DataSet/ResolutionLevel 0/TimePoint 0/Channel 0"].attrs[f"ImageSize{axis}"]
    assert read.open(path).notes == stated  # /DataSetInfo/Image repeats the size
    with h5py.File(path, "r+") as file:
        for axis in "ZYX":
            del file["DataSetInfo/Image"].attrs[axis]
    (note,) = set(read.open(path).notes) - set(stated)
    assert note.endswith(
        "not stated, 18, 50, 38 voxels is assumed, the size of the dataset with its padding"
    )
