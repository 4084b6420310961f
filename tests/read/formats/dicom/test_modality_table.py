"""Values after a Modality LUT equal those of pydicom's own function."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import pytest
from pydicom.dataset import Dataset
from pydicom.pixels import apply_modality_lut
from pydicom.uid import ImplicitVRLittleEndian

from stereocell import read
from stereocell.model.errors import SourceError
from support.dicom_kinds import AFFINE, SHAPE
from support.dicom_reading import whole
from support.dicom_series import write_series


def table(values: Any, first: int = 0, depth: int = 16, vr: str = "US") -> list[Dataset]:
    """Return a Modality LUT Sequence of one table; its first entry is for the value `first`."""
    item = Dataset()
    count = len(values) % (1 << 16)
    item.add_new("LUTDescriptor", "SS" if first < 0 else "US", [count, first, depth])
    item.ModalityLUTType = "US"
    data = np.asarray(values, "<u2")
    item.add_new("LUTData", vr, data.tobytes() if vr == "OW" else data.tolist())
    return [item]


def rising(top: int = 1100, step: int = 3) -> Any:
    return np.arange(top) * step % 40000


def write(folder: Path, change: Callable[[Dataset], None], **options: Any) -> list[Path]:
    return write_series(folder, AFFINE, SHAPE, slope=None, change=change, **options)


def greys_of_pydicom(paths: list[Path]) -> list[int]:
    """Return the sorted values of all voxels of the slices, as pydicom applies the table."""
    datasets = [pydicom.dcmread(path) for path in paths]
    return sorted(int(v) for ds in datasets for v in apply_modality_lut(ds.pixel_array, ds).flat)


@pytest.mark.parametrize("vr", ["US", "OW"])
@pytest.mark.parametrize("first", [0, -5, 40])
def test_the_table_is_applied_to_the_values(tmp_path: Path, vr: str, first: int) -> None:
    def change(ds: Dataset) -> None:
        ds.ModalityLUTSequence = table(rising(), first, vr=vr)

    paths = write(tmp_path, change, dtype=np.int16)
    dataset = read.open(tmp_path)
    assert sorted(whole(dataset).ravel().tolist()) == greys_of_pydicom(paths)
    assert any("of 10 images come from a table (ModalityLUTSequence)" in n for n in dataset.notes)


def test_each_table_is_applied_to_its_own_slice(tmp_path: Path) -> None:
    def change(ds: Dataset) -> None:
        ds.ModalityLUTSequence = table(rising(step=ds.InstanceNumber))

    paths = write(tmp_path, change)
    dataset = read.open(tmp_path)
    assert sorted(whole(dataset).ravel().tolist()) == greys_of_pydicom(paths)
    assert any("from separate tables (ModalityLUTSequence)" in note for note in dataset.notes)


def test_a_file_of_implicit_vr_has_the_same_values(tmp_path: Path) -> None:
    def change(ds: Dataset) -> None:
        ds.ModalityLUTSequence = table(rising(), vr="OW")

    paths = write(tmp_path, change)
    explicit = whole(read.open(tmp_path))
    for path in paths:
        ds = pydicom.dcmread(path)
        ds.file_meta.TransferSyntaxUID = ImplicitVRLittleEndian
        ds.save_as(path, implicit_vr=True)
    assert np.array_equal(whole(read.open(tmp_path)), explicit)


def test_a_table_of_65536_entries_states_0_entries(tmp_path: Path) -> None:
    def change(ds: Dataset) -> None:
        ds.ModalityLUTSequence = table(np.arange(1 << 16)[::-1].copy(), vr="OW")

    paths = write(tmp_path, change, dtype=np.uint16)
    assert sorted(whole(read.open(tmp_path)).ravel().tolist()) == greys_of_pydicom(paths)


def test_inverted_images_are_inverted_after_the_table(tmp_path: Path) -> None:
    def change(ds: Dataset) -> None:
        ds.ModalityLUTSequence = table(rising())

    paths = write(tmp_path, change, photometric="MONOCHROME1")
    expected = sorted(65535 - value for value in greys_of_pydicom(paths))
    assert sorted(whole(read.open(tmp_path)).ravel().tolist()) == expected


def test_the_table_takes_precedence_over_a_rescale_with_a_note(tmp_path: Path) -> None:
    def change(ds: Dataset) -> None:
        ds.ModalityLUTSequence = table(rising())
        if ds.InstanceNumber == 3:
            ds.RescaleSlope, ds.RescaleIntercept = 2, -1000

    paths = write(tmp_path, change)
    dataset = read.open(tmp_path)
    assert sorted(whole(dataset).ravel().tolist()) == greys_of_pydicom(paths)
    assert any("1 of 10 images states RescaleSlope and" in note for note in dataset.notes)


def test_a_ct_with_a_table_has_no_hounsfield_units(tmp_path: Path) -> None:
    def change(ds: Dataset) -> None:
        ds.ModalityLUTSequence = table(rising())

    write(tmp_path, change, modality="CT")
    assert any("states no Hounsfield units" in note for note in read.open(tmp_path).notes)


def test_an_empty_sequence_counts_as_no_table(tmp_path: Path) -> None:
    write_series(
        tmp_path / "s", AFFINE, SHAPE, change=lambda ds: setattr(ds, "ModalityLUTSequence", [])
    )
    assert read.open(tmp_path / "s").levels[0].shape == (12, 10, 14)


@pytest.mark.parametrize("fault", ["short", "no data", "depth"])
def test_a_damaged_table_is_refused_with_a_remedy(tmp_path: Path, fault: str) -> None:
    def change(ds: Dataset) -> None:
        ds.ModalityLUTSequence = table(rising(), depth=8 if fault == "depth" else 16)
        item = ds.ModalityLUTSequence[0]
        if fault == "short":
            item.LUTDescriptor = [2000, 0, 16]
        if fault == "no data":
            del item.LUTData

    write(tmp_path, change)
    with pytest.raises(SourceError, match=r"modality table that is damaged.*RescaleSlope"):
        read.open(tmp_path)
