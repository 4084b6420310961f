"""Values by ModalityLUTSequence, compared with pydicom's own."""

from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import pytest
from pydicom.pixels import apply_modality_lut
from pydicom.sequence import Sequence

from stereocell import read
from stereocell.model.errors import SourceError
from support.dicom_reading import whole
from support.dicom_series import grid, write_series

SHAPE = (6, 12, 14)
AFFINE = grid(shape=SHAPE, spacing=(5.0, 4.0, 4.0))
ENTRIES = (np.sqrt(np.arange(600)) * 1000).astype(np.uint16)


def with_table(first: int, kind: str, count: int = len(ENTRIES)) -> Any:
    """Return a change that replaces the rescale by a table whose data have a VR."""

    def change(ds: pydicom.Dataset) -> None:
        del ds.RescaleSlope, ds.RescaleIntercept
        item = pydicom.Dataset()
        signed = "SS" if ds.PixelRepresentation else "US"
        item.add_new("LUTDescriptor", signed, [count, first, 16])
        item.ModalityLUTType = "US"
        data: Any = ENTRIES.tobytes() if kind == "OW" else ENTRIES.tolist()
        item.add_new("LUTData", kind, data)
        ds.ModalityLUTSequence = Sequence([item])

    return change


@pytest.mark.parametrize("kind", ["US", "OW"])
@pytest.mark.parametrize(("first", "dtype"), [(0, np.uint16), (-40, np.int16), (300, np.uint16)])
def test_values_are_those_of_the_table(tmp_path: Path, kind: str, first: int, dtype: Any) -> None:
    paths = write_series(tmp_path / "s", AFFINE, SHAPE, dtype=dtype, change=with_table(first, kind))
    expected = []
    for path in paths:
        ds = pydicom.dcmread(path)
        expected.append(apply_modality_lut(ds.pixel_array, ds))
    dataset = read.open(tmp_path / "s")
    found = whole(dataset)
    assert sorted(found.ravel()) == sorted(np.concatenate(expected).ravel())
    assert any("values of 6 of 6 images are by ModalityLUTSequence" in n for n in dataset.notes)


def test_a_table_for_inverted_images_is_for_the_numbers_as_stored(tmp_path: Path) -> None:
    for photometric in ("MONOCHROME1", "MONOCHROME2"):
        write_series(
            tmp_path / photometric, AFFINE, SHAPE, dtype=np.uint16, photometric=photometric,
            change=with_table(0, "US"),
        )  # fmt: skip
    inverted, plain = (
        whole(read.open(tmp_path / name)).astype(int) for name in ("MONOCHROME1", "MONOCHROME2")
    )
    np.testing.assert_array_equal(inverted, int(ENTRIES.min()) + int(ENTRIES.max()) - plain)


def test_a_table_that_lacks_entries_is_refused(tmp_path: Path) -> None:
    change = with_table(0, "US", count=len(ENTRIES) + 5)
    write_series(tmp_path / "s", AFFINE, SHAPE, dtype=np.uint16, change=change)
    with pytest.raises(SourceError, match="6 of values by a damaged modality table"):
        read.open(tmp_path / "s")
