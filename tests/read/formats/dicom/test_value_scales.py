"""DICOM values are on the scale that the headers state, and missing statements are noted."""

from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import pytest

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.planning.hounsfield import without_hounsfield
from stereocell.planning.preset_choice import choose_preset
from stereocell.planning.settings import load
from support.dicom_reading import whole
from support.dicom_series import Change, grid, setting, write_series

SHAPE = (6, 12, 14)
AFFINE = grid(shape=SHAPE, spacing=(5.0, 4.0, 4.0))


def opened(folder: Path, change: Change = lambda ds: None, **options: Any) -> read.Dataset:
    write_series(folder / "s", AFFINE, SHAPE, change=change, **options)
    return read.open(folder / "s")


def without_rescale(ds: pydicom.Dataset) -> None:
    del ds.RescaleSlope, ds.RescaleIntercept


def capture(ds: pydicom.Dataset) -> None:
    without_rescale(ds)
    ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.7"


@pytest.mark.parametrize(
    ("change", "options"),
    [
        (without_rescale, {"dtype": np.uint16}),
        (without_rescale, {"dtype": np.int16}),
        (capture, {"dtype": np.uint16}),
        (setting(), {"dtype": np.uint16, "intercept": 0}),  # stored with an offset
        (setting(), {"dtype": np.int16, "intercept": 0}),
        (setting(RescaleType="US"), {"dtype": np.int16, "intercept": -1024}),
    ],
)
def test_a_ct_whose_range_excludes_air_has_no_hounsfield_units(
    tmp_path: Path, change: Change, options: dict[str, Any]
) -> None:
    dataset = opened(tmp_path, change, modality="CT", **options)
    assert dataset.modality == "CT"
    assert not dataset.has_hounsfield_units
    assert sum("states no Hounsfield units" in note for note in dataset.notes) == 1
    assert choose_preset(dataset)[0] == "ct"


@pytest.mark.parametrize(
    ("change", "options"),
    [
        (setting(RescaleType="HU"), {"intercept": -1024}),
        (setting(), {"dtype": np.uint16, "intercept": -1000}),
        (lambda ds: setattr(ds, "PixelData", shifted(ds, -1000)), {"intercept": 0}),
    ],
)
def test_a_ct_whose_scale_or_values_include_air_is_in_hounsfield_units(
    tmp_path: Path, change: Change, options: dict[str, Any]
) -> None:
    dataset = opened(tmp_path, change, modality="CT", **options)
    assert dataset.has_hounsfield_units
    assert dataset.notes == ()


@pytest.mark.parametrize(
    ("kind", "is_reported"), [("JANEDOE", True), ("US", True), ("HOUNSFIELD", False), ("HU", False)]
)
def test_a_rescale_type_other_than_hounsfield_units_is_noted(
    tmp_path: Path, kind: str, is_reported: bool
) -> None:
    dataset = opened(tmp_path, setting(RescaleType=kind), modality="CT", intercept=-1024)
    assert any("RescaleType is" in note for note in dataset.notes) == is_reported
    assert dataset.has_hounsfield_units == (kind != "US")
    assert "JANE" not in "".join(dataset.notes)


def shifted(ds: pydicom.Dataset, by: int) -> bytes:
    return (np.frombuffer(ds.PixelData, np.int16) + by).astype(np.int16).tobytes()


def test_hounsfield_units_without_a_rescale_are_assumed(tmp_path: Path) -> None:
    def change(ds: pydicom.Dataset) -> None:
        without_rescale(ds)
        ds.PixelData = shifted(ds, -1000)

    dataset = opened(tmp_path, change, modality="CT")
    assert dataset.has_hounsfield_units
    (note,) = dataset.notes
    assert note.startswith("Hounsfield units are assumed")


@pytest.mark.parametrize("preset", ["ct", "ct-bone"])
def test_levels_and_window_of_the_preset_are_dropped_and_the_users_kept(preset: str) -> None:
    flags = {"iso_values": {"0": 700.0}, "windows": {"0": "100:900"}}
    settings = without_hounsfield(load(preset, None, flags=flags))
    assert settings.iso_values == {"0": 700.0}
    assert settings.windows == {"0": "100:900"}
    assert settings.surface == load(preset, None, flags={}).surface


def test_the_plan_of_a_ct_without_hounsfield_units_has_no_level_of_the_preset(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    opened(tmp_path, without_rescale, modality="CT")
    out = tmp_path / "out"
    assert main(["plan", str(tmp_path / "s"), "-o", str(out), "--preset", "ct"]) == 0
    assert "states no Hounsfield units" in capfd.readouterr().err
    assert "-300" not in (out / "plan.json").read_text("utf-8")


def test_slopes_that_differ_are_noted(tmp_path: Path) -> None:
    def change(ds: pydicom.Dataset) -> None:
        ds.RescaleSlope = ds.InstanceNumber * 0.5

    notes = opened(tmp_path, change).notes
    assert "RescaleSlope differs between images (0.5 to 3): each image has its own" in notes


def test_images_without_a_rescale_among_others_are_noted(tmp_path: Path) -> None:
    def change(ds: pydicom.Dataset) -> None:
        if ds.InstanceNumber < 3:
            without_rescale(ds)

    assert any("2 of 6 images state no rescale" in note for note in opened(tmp_path, change).notes)


@pytest.mark.parametrize(
    ("units", "words"),
    [
        ("BQML", "becquerels per millilitre"),
        ("CNTS", "counts, not"),
        ("JANE", "in an unknown unit"),
    ],
)
def test_the_unit_of_pet_is_noted(tmp_path: Path, units: str, words: str) -> None:
    notes = opened(tmp_path, setting(Modality="PT", Units=units)).notes
    assert any(f"PET values are {words}" in note for note in notes)
    assert "JANE" not in "".join(notes)


def mapping(slope: float, intercept: float) -> list[pydicom.Dataset]:
    item = pydicom.Dataset()
    item.RealWorldValueSlope, item.RealWorldValueIntercept = slope, intercept
    return [item]


def test_a_real_world_mapping_is_the_scale_if_there_is_no_rescale(tmp_path: Path) -> None:
    plain = whole(opened(tmp_path / "a", without_rescale))

    def change(ds: pydicom.Dataset) -> None:
        without_rescale(ds)
        ds.RealWorldValueMappingSequence = mapping(0.25, 3.0)

    mapped = opened(tmp_path / "b", change)
    assert np.allclose(whole(mapped), plain * 0.25 + 3.0)
    assert any("by RealWorldValueMapping (slope 0.25, intercept 3)" in n for n in mapped.notes)


@pytest.mark.parametrize("is_same", [True, False])
def test_a_real_world_mapping_that_contradicts_the_rescale_is_noted(
    tmp_path: Path, is_same: bool
) -> None:
    scale = (1.0, 0.0) if is_same else (0.25, 3.0)
    dataset = opened(tmp_path, setting(RealWorldValueMappingSequence=mapping(*scale)))
    matching = [note for note in dataset.notes if "RealWorldValueMapping states 0.25, 3" in note]
    assert len(matching) == len(dataset.notes) == (not is_same)


def test_the_scale_slope_of_philips_is_noted(tmp_path: Path) -> None:
    def change(ds: pydicom.Dataset) -> None:
        block = ds.private_block(0x2005, "Philips MR Imaging DD 001", create=True)
        block.add_new(0x0E, "FL", 0.125)

    assert any("scale slope of 0.125 (2005,100e)" in n for n in opened(tmp_path, change).notes)


def test_a_ct_without_a_rescale_is_in_hounsfield_units_if_the_user_states_so(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    opened(tmp_path, without_rescale, modality="CT")
    out = tmp_path / "out"
    command = ["plan", str(tmp_path / "s"), "-o", str(out), "--preset", "ct", "--as", "hounsfield"]
    assert main(command) == 0
    assert "-300" in (out / "plan.json").read_text("utf-8")
