"""A series that holds several kinds of frames is divided into one volume for each kind."""

from collections.abc import Callable, Iterable
from itertools import product
from pathlib import Path

import numpy as np
import pydicom
import pytest
import SimpleITK

from stereocell import read
from stereocell.model.errors import SourceError, UsageError
from support.dicom_kinds import AFFINE, SHAPE, added, image_type, private, write_kind
from support.dicom_reading import whole
from support.dicom_series import Change, grid, setting, write_enhanced, write_series
from support.exhaustive import sweep

PARTS: dict[str, tuple[Change, Change]] = {
    "Siemens": (image_type("P", "ND"), image_type("M", "ND")),
    "Philips": (image_type("PHASE MAP", "P", "FFE"), image_type("M_FFE", "M", "FFE")),
    "Philips's prefix": (image_type("P_SE", "SE"), image_type("M_SE", "SE")),
    "the standard": (
        setting(ComplexImageComponent="PHASE"),
        setting(ComplexImageComponent="MAGNITUDE"),
    ),
    "GE": (
        private(0x43, "GEMS_PARM_01", 0x2F, "SS", 1),
        private(0x43, "GEMS_PARM_01", 0x2F, "SS", 0),
    ),
    "GE of unknown VR": (
        private(0x43, "GEMS_PARM_01", 0x2F, "UN", b"\1\0"),
        private(0x43, "GEMS_PARM_01", 0x2F, "UN", b"\0\0"),
    ),
}


@pytest.mark.parametrize("maker", PARTS)
def test_magnitude_is_built_and_phase_is_a_separate_series(tmp_path: Path, maker: str) -> None:
    phase, magnitude = PARTS[maker]
    write_kind(tmp_path, 100, phase)
    write_kind(tmp_path, 300, magnitude, first_number=20)
    first, second = read.list_series(tmp_path)
    assert "MR, magnitude, axial, 10 x 12 x 14" in first
    assert "MR, phase, axial, 10 x 12 x 14" in second
    dataset = read.open(tmp_path)
    assert (dataset.time_points, whole(dataset).min(), added(tmp_path, 2)) == (1, 300, 100)
    note = "10 images of the same series (phase), because they are of another kind; --series 2"
    assert any(note in one for one in dataset.notes)


def test_real_and_imaginary_parts_follow_the_magnitude(tmp_path: Path) -> None:
    for add, word in ((10, "I"), (20, "R"), (30, "M"), (40, "P")):
        write_kind(tmp_path, add, image_type(word), first_number=add)
    lines = read.list_series(tmp_path)
    assert "magnitude" in lines[0]
    assert lines[1].split(", ")[1] == "real part"
    assert sorted(line.split(", ")[1] for line in lines[2:]) == ["imaginary part", "phase"]


def test_without_a_magnitude_the_real_part_is_built(tmp_path: Path) -> None:
    for add, word in ((10, "I"), (20, "R")):
        write_kind(tmp_path, add, image_type(word), first_number=add)
    assert added(tmp_path) == 20


def test_a_separate_phase_series_follows_a_smaller_magnitude_series(tmp_path: Path) -> None:
    write_series(tmp_path / "p", AFFINE, SHAPE, series="1.2.4", change=image_type("P"))
    small = grid(shape=(6, 12, 14))
    write_series(tmp_path / "m", small, (6, 12, 14), series="1.2.5", change=image_type("M"))
    assert "magnitude, axial, 6 x" in read.list_series(tmp_path)[0]


ROLES = {
    ("AXIAL", "MIP"): "maximum intensity projection",
    ("AXIAL", "CT_SOM5 MIP"): "maximum intensity projection",
    ("MIN_IP",): "minimum intensity projection",
    ("PROJECTION IMAGE",): "projection",
    ("MPR",): "reformatted",
    ("REFORMATTED", "AVERAGE"): "reformatted",
    ("ADC",): "parametric map",
    ("SCREEN SAVE",): "screen save",
}
FEW, ALL = (0.5, 3.5, 6.5), range(10)


@pytest.mark.parametrize(
    ("words", "indices"),
    sweep(product(ROLES, (FEW, ALL)), kept=[*product(ROLES, [FEW]), (("ADC",), ALL)]),
)
def test_derived_images_are_not_mixed_with_the_originals(
    tmp_path: Path, words: tuple[str, ...], indices: Iterable[float]
) -> None:
    write_kind(tmp_path, 100, setting(ImageType=["ORIGINAL", "PRIMARY", "AXIAL"]))
    derived = setting(ImageType=["DERIVED", "SECONDARY", *words])
    write_kind(tmp_path, 900, derived, indices=indices, first_number=50)
    dataset = read.open(tmp_path)
    assert dataset.levels[0].shape == (12, 10, 14)
    assert whole(dataset).min() == 100
    assert any(f"({ROLES[words]}), because" in note for note in dataset.notes)
    assert not any("uneven" in note for note in dataset.notes)


def test_derived_images_that_are_not_named_so_are_distinguished_by_their_origin(
    tmp_path: Path,
) -> None:
    write_kind(tmp_path, 900, setting(ImageType=["DERIVED", "SECONDARY", "XYZ"]))
    write_kind(tmp_path, 100, setting(ImageType=["ORIGINAL", "PRIMARY", "XYZ"]), first_number=50)
    assert added(tmp_path) == 100
    assert "XYZ" not in "".join((*read.list_series(tmp_path), *read.open(tmp_path).notes))


PROPERTIES: dict[str, tuple[Change, Change, str]] = {
    "kernel": (setting(ConvolutionKernel="B30f"), setting(ConvolutionKernel="B70f"), "kernel B70f"),
    "energy": (setting(KVP=80), setting(KVP=140), "140 kV"),
    "monoenergetic": (
        setting(MonoenergeticEnergyEquivalent=40.0),
        setting(MonoenergeticEnergyEquivalent=70.0),
        "70 keV",
    ),
    "contrast": (setting(), setting(ContrastBolusAgent="Jane's"), "with contrast agent"),
    "b-value": (setting(DiffusionBValue=0.0), setting(DiffusionBValue=800.0), "b 800 s/mm2"),
    "b-value of Siemens": (
        private(0x19, "SIEMENS MR HEADER", 0x0C, "IS", "0"),
        private(0x19, "SIEMENS MR HEADER", 0x0C, "IS", "800"),
        "b 800 s/mm2",
    ),
    "b-value of GE": (
        private(0x43, "GEMS_PARM_01", 0x39, "IS", [0, 1, 0, 0]),
        private(0x43, "GEMS_PARM_01", 0x39, "IS", [1000000800, 1, 0, 0]),
        "b 800 s/mm2",
    ),
    "b-value of Philips": (
        private(0x2001, "Philips Imaging DD 001", 0x03, "FL", 0.0),
        private(0x2001, "Philips Imaging DD 001", 0x03, "FL", 800.0),
        "b 800 s/mm2",
    ),
    "echo time": (setting(EchoTime=4.92), setting(EchoTime=7.38), "echo time 7.38 ms"),
    "echo number": (setting(EchoNumbers=1), setting(EchoNumbers=2), "echo 2"),
    "inversion time": (setting(InversionTime=700), setting(InversionTime=2500), "2500 ms"),
    "flip angle": (setting(FlipAngle=5), setting(FlipAngle=26), "flip angle 26 degrees"),
    "Dixon": (image_type("M", "WATER"), image_type("M", "FAT"), "fat"),
}


@pytest.mark.parametrize(
    ("name", "shift"),
    sweep(
        product(PROPERTIES, (0.0, 0.5)),
        kept=[*product(PROPERTIES, [0.0]), ("kernel", 0.5), ("echo time", 0.5)],
    ),
)
def test_a_property_separates_slices_at_equal_positions_and_interleaved_ones(
    tmp_path: Path, name: str, shift: float
) -> None:
    modality = "CT" if name in ("kernel", "energy", "monoenergetic", "contrast") else "MR"
    first, second, words = PROPERTIES[name]
    write_kind(tmp_path, 100, first, modality=modality)
    indices = [index + shift for index in range(10 - (shift > 0))]
    write_kind(tmp_path, 300, second, indices=indices, modality=modality, first_number=30)
    lines = read.list_series(tmp_path)
    assert len(lines) == 2
    assert sum(words in line for line in lines) == 1
    number = 1 + next(i for i, line in enumerate(lines) if words in line)
    first_shown = read.open(tmp_path, series=1)
    shown = [float(whole(one).min()) for one in (first_shown, read.open(tmp_path, series=2))]
    assert shown == ([300, 100] if number == 1 else [100, 300])
    assert first_shown.levels[0].spacing_um[1] == pytest.approx(3000)
    assert "Jane" not in "".join((*lines, *first_shown.notes))


@pytest.mark.parametrize("change", [setting(AcquisitionNumber=2), setting()])
def test_interleaved_acquisitions_are_two_series(tmp_path: Path, change: Change) -> None:
    write_kind(tmp_path, 100, setting(AcquisitionNumber=1) if change.__closure__ else setting())
    write_kind(tmp_path, 300, change, indices=[k + 0.5 for k in range(9)], first_number=30)
    assert len(read.list_series(tmp_path)) == 2
    assert (added(tmp_path), added(tmp_path, 2)) == (100, 300)


@pytest.mark.parametrize("number", ["AcquisitionNumber", "InstanceNumber"])
def test_interleaved_acquisitions_of_thin_slices_are_one_volume(
    tmp_path: Path, number: str
) -> None:
    for start in (0, 1):
        change = setting(SliceThickness=3.0, AcquisitionNumber=start + 1)
        if number == "InstanceNumber":
            change = setting(SliceThickness=3.0)
        write_kind(tmp_path / f"{start}", 0, change, indices=range(start, 10, 2),
                   first_number=1 + 20 * start)  # fmt: skip
    assert read.open(tmp_path).levels[0].shape == (12, 10, 14)


def test_acquisitions_above_each_other_are_one_volume(tmp_path: Path) -> None:
    def change(ds: pydicom.Dataset) -> None:
        ds.AcquisitionNumber = 1 + (ds.InstanceNumber > 5)
        ds.ConvolutionKernel = "H31s" if ds.InstanceNumber > 5 else "H60s"

    write_kind(tmp_path, 0, change, modality="CT")
    assert read.open(tmp_path).levels[0].shape == (12, 10, 14)


def test_an_acquisition_for_each_slice_is_one_volume(tmp_path: Path) -> None:
    write_kind(tmp_path, 0, lambda ds: setattr(ds, "AcquisitionNumber", ds.InstanceNumber))
    assert len(read.list_series(tmp_path)) == 1


def test_a_kernel_in_free_text_is_counted_and_not_shown(tmp_path: Path) -> None:
    write_kind(tmp_path, 100, setting(ConvolutionKernel="JANE DOE"))
    write_kind(tmp_path, 300, setting(ConvolutionKernel="JOHN DOE"), first_number=30)
    first, second = read.list_series(tmp_path)
    assert "kernel no. 1" in first
    assert "kernel no. 2" in second
    assert "DOE" not in first + second


PHASES: dict[str, Callable[[int], Change]] = {
    "TemporalPositionIdentifier": lambda time: setting(TemporalPositionIdentifier=time + 1),
    "NominalPercentageOfCardiacPhase": lambda t: setting(NominalPercentageOfCardiacPhase=10.0 * t),
    "TriggerTime": lambda time: setting(TriggerTime=25.0 * time),
    "AcquisitionNumber": lambda time: setting(AcquisitionNumber=time + 1),
    "InstanceNumber": lambda time: setting(),
}


@pytest.mark.parametrize(
    ("name", "rest"),
    sweep(
        product(PHASES, (range(8), range(3, 10))),
        kept=[*product(PHASES, [range(8)]), ("TriggerTime", range(3, 10))],
    ),
)
@pytest.mark.slow
def test_an_incomplete_last_time_point_is_noted_and_complete_ones_are_kept(
    tmp_path: Path, name: str, rest: range
) -> None:
    for time, indices in enumerate((range(10), range(10), rest)):
        write_kind(tmp_path, 100 * (time + 1), PHASES[name](time), indices=indices,
                   first_number=1 + 10 * time)  # fmt: skip
    dataset = read.open(tmp_path)
    assert dataset.time_points == 2
    assert [whole(dataset).min(), added(tmp_path, time=1)] == [100, 200]
    note = f"1 of 3 time points ({name}), because slices are missing ({len(rest)} of 10 are"
    assert any(note in one for one in dataset.notes)
    assert "incomplete time point 3" in read.list_series(tmp_path)[1]
    assert added(tmp_path, series=2) == 300
    with pytest.raises(UsageError, match="--time: found 2, expected 0 to 1"):
        read.open(tmp_path, time=2)


def test_a_contrast_phase_that_covers_a_part_is_a_separate_series(tmp_path: Path) -> None:
    write_kind(tmp_path, 100, setting(AcquisitionNumber=1), modality="CT")
    write_kind(tmp_path, 400, setting(AcquisitionNumber=2), indices=range(5, 10), modality="CT",
               first_number=30)  # fmt: skip
    assert (added(tmp_path), added(tmp_path, series=2)) == (100, 400)


def test_time_points_are_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    for time in (1, 0):
        change = setting(TemporalPositionIdentifier=time + 1)
        write_kind(tmp_path, 100 * (time + 1), change, first_number=50 - 20 * time)
    assert [added(tmp_path, time=time) for time in (0, 1)] == [100, 200]


def enhanced_kinds(path: Path, describe: Callable[[pydicom.Dataset, int], None]) -> Path:
    """Write an enhanced MR image of two frames at each position, the second 50 brighter."""
    ds = pydicom.dcmread(write_enhanced(path, AFFINE, SHAPE))
    groups = []
    for kind in (1, 0):
        for group in ds.PerFrameFunctionalGroupsSequence:
            copy = pydicom.Dataset.from_json(group.to_json())
            copy.PixelValueTransformationSequence[0].RescaleIntercept += 50 * kind
            describe(copy, kind)
            groups.append(copy)
    ds.PerFrameFunctionalGroupsSequence = groups
    ds.NumberOfFrames, ds.PixelData = 20, ds.PixelData * 2
    ds.save_as(path)
    return path


def item(**values: object) -> list[pydicom.Dataset]:
    found = pydicom.Dataset()
    setting(**values)(found)
    return [found]


ENHANCED: dict[str, tuple[Callable[[pydicom.Dataset, int], None], str]] = {
    "phase": (
        lambda group, kind: setting(
            MRImageFrameTypeSequence=item(
                FrameType=["ORIGINAL", "PRIMARY", "VOLUME", "NONE"],
                ComplexImageComponent=("MAGNITUDE", "PHASE")[kind],
            )
        )(group),
        "phase",
    ),
    "projection": (
        lambda group, kind: setting(
            MRImageFrameTypeSequence=item(VolumeBasedCalculationTechnique=("NONE", "MAX_IP")[kind])
        )(group),
        "maximum intensity projection",
    ),
    "echo": (
        lambda group, kind: setting(MREchoSequence=item(EffectiveEchoTime=(5.0, 9.0)[kind]))(group),
        "echo time 9 ms",
    ),
    "b-value": (
        lambda group, kind: setting(MRDiffusionSequence=item(DiffusionBValue=(0.0, 9e2)[kind]))(
            group
        ),
        "b 900 s/mm2",
    ),
}


@pytest.mark.parametrize("name", ENHANCED)
def test_frames_of_an_enhanced_image_are_divided_by_kind(tmp_path: Path, name: str) -> None:
    describe, words = ENHANCED[name]
    path = enhanced_kinds(tmp_path / "e.dcm", describe)
    lines = read.list_series(path)
    assert len(lines) == 2
    assert words in lines[1]
    difference = whole(read.open(path, series=2)) - whole(read.open(path))
    assert np.array_equal(np.unique(difference), [50])


def test_time_points_of_an_enhanced_image_are_in_the_order_of_their_indices(
    tmp_path: Path,
) -> None:
    def describe(group: pydicom.Dataset, kind: int) -> None:
        group.FrameContentSequence[0].TemporalPositionIndex = kind + 1

    path = enhanced_kinds(tmp_path / "e.dcm", describe)
    difference = whole(read.open(path, time=1)) - whole(read.open(path))
    assert np.array_equal(np.unique(difference), [50])


def test_scouts_of_a_ct_do_not_make_a_volume(tmp_path: Path) -> None:
    """This holds even for two in the same direction, one behind the other."""
    scout = setting(ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"])
    write_kind(tmp_path, 0, scout, indices=[0, 5], modality="CT")
    with pytest.raises(SourceError, match=r"localizers \(scouts\) of a CT are projections"):
        read.open(tmp_path)


def test_a_localizer_of_mr_follows_the_other_series(tmp_path: Path) -> None:
    """The localizer has more voxels than the other series, and would make a volume."""
    write_series(tmp_path / "l", AFFINE, SHAPE, series="1.2.4", change=image_type("LOCALIZER"))
    small = grid("coronal", shape=(5, 12, 14))
    write_series(tmp_path / "m", small, (5, 12, 14), series="1.2.5", change=image_type("M"))
    first, second = read.list_series(tmp_path)
    assert "magnitude, coronal, 5 x" in first
    assert "localizer, axial, 10 x" in second


def test_kinds_in_files_of_itk_are_distinguished(tmp_path: Path) -> None:
    writer = SimpleITK.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    for number, (word, value) in enumerate((("P", 40), ("M", 90))):
        for k in range(4):
            plane = SimpleITK.GetImageFromArray(np.full((8, 9), value, np.int16))
            plane.SetSpacing((2.0, 2.0))
            for tag, text in {
                "0008|0016": "1.2.840.10008.5.1.4.1.1.4",
                "0008|0018": f"1.2.3.{number}.{k + 1}",
                "0020|000e": "1.2.3.9",
                "0020|0052": "1.2.3.8",
                "0008|0060": "MR",
                "0008|0008": f"ORIGINAL\\PRIMARY\\{word}",
                "0020|0032": f"0\\0\\{3 * k}",
                "0020|0037": "1\\0\\0\\0\\1\\0",
                "0020|0013": f"{4 * number + k + 1}",
            }.items():
                plane.SetMetaData(tag, text)
            writer.SetFileName(str(tmp_path / f"{number}{k}.dcm"))
            writer.Execute(plane)
    assert [line.split(", ")[1] for line in read.list_series(tmp_path)] == ["magnitude", "phase"]
    assert np.unique(whole(read.open(tmp_path))).tolist() == [90]
