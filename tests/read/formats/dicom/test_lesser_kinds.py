"""A note reports that a source has no plain images but only phases, projections and the like."""

from itertools import product
from pathlib import Path

import pytest

from stereocell import read
from support.dicom_kinds import AFFINE, SHAPE, image_type, write_kind
from support.dicom_series import Change, setting, write_series
from support.exhaustive import sweep


def derived(*words: str) -> Change:
    return setting(ImageType=["DERIVED", "SECONDARY", *words])


# modality, change of the headers, change of a better image, beginning of the note
ALONE: dict[str, tuple[str, Change, Change, str]] = {
    "phase": ("MR", image_type("P", "ND"), image_type("M", "ND"), "phase images: no magnitude is"),
    "real": ("MR", image_type("R_IR"), image_type("M_IR"), "real parts of a complex signal: no m"),
    "imaginary": ("MR", image_type("I"), image_type("M"), "imaginary parts of a complex signal: "),
    "opposed phase": (
        "MR", image_type("M", "OPP_PHASE"), image_type("M", "IN_PHASE"),
        "opposed-phase images: no in-phase or water images are here",
    ),
    "fat": (
        "MR", image_type("M", "FAT"), image_type("M", "WATER"),
        "fat images: no in-phase or water images are here",
    ),
    "projection": (
        "CT", derived("MIP"), setting(),
        "maximum intensity projections: no original images are here",
    ),
    "subtraction": (
        "MR", derived("SUBTRACT"), image_type("M"), "subtraction images: no original images are",
    ),
    "map": ("MR", derived("ADC"), image_type("M"), "parametric maps: no original images are here"),
    "localizer": (
        "MR", image_type("LOCALIZER"), image_type("M"),
        "localizers (scouts): no original images are here",
    ),
    "derived": (
        "MR", derived("XYZ"), image_type("XYZ"),
        "derived images (ImageType DERIVED): no original images are here",
    ),
    "uncorrected": (
        "PT", setting(CorrectedImage=["DECY", "SCAT"]), setting(CorrectedImage=["DECY", "ATTN"]),
        "PET images without attenuation correction: no corrected images are here",
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "beside"),
    sweep(
        product(ALONE, ("alone", "same series", "other series")),
        kept=[
            *product(ALONE, ["alone"]),
            *product(("phase", "projection", "uncorrected"), ["same series"]),
            *product(("opposed phase", "localizer"), ["other series"]),
        ],
    ),
)
def test_a_kind_is_noted_if_the_images_that_it_belongs_to_are_absent(
    tmp_path: Path, name: str, beside: str
) -> None:
    modality, change, better, note = ALONE[name]
    write_kind(tmp_path, 100, change, modality=modality)
    if beside == "same series":
        write_kind(tmp_path, 300, better, modality=modality, first_number=30)
    if beside == "other series":
        write_series(tmp_path / "other", AFFINE, SHAPE, series="1.2.9", change=better,
                     modality=modality)  # fmt: skip
    for series in range(1 + len(read.list_series(tmp_path))):
        notes = read.open(tmp_path, series=series).notes
        assert sum(one.startswith(note) for one in notes) == (beside == "alone")
    assert "XYZ" not in "".join(notes)


def test_acquired_images_have_no_such_note(tmp_path: Path) -> None:
    write_kind(tmp_path, 100, image_type("M", "ND"))
    assert read.open(tmp_path).notes == ()


def test_an_image_of_another_modality_does_not_count_as_magnitude(tmp_path: Path) -> None:
    write_kind(tmp_path, 100, image_type("P"))
    small = range(4)
    write_series(tmp_path / "c", AFFINE, SHAPE, indices=small, series="1.2.9", modality="CT")
    notes = read.open(tmp_path, series=2).notes
    assert any(one.startswith("phase images: no magnitude is here") for one in notes)
