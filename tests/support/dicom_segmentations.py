"""DICOM segmentations as highdicom writes them, of MR images of the scene."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import highdicom
import pydicom
from numpy.typing import NDArray
from pydicom.sr.codedict import codes
from pydicom.sr.coding import Code

from support.dicom_series import Affine, grid, write_series

SPACING = (2.5, 2.0, 2.2)  # mm between slices, rows, columns


def complete(ds: Any) -> None:
    """Add the elements that a segmentation copies from its images."""
    ds.PatientName, ds.PatientID, ds.PatientBirthDate, ds.PatientSex = "DOE^JANE", "J1", "", ""
    ds.StudyID, ds.StudyDate, ds.StudyTime, ds.AccessionNumber = "", "", "", ""
    ds.ReferringPhysicianName = ""
    ds.SliceThickness = ds.SpacingBetweenSlices = SPACING[0]


def write_segmentation(
    folder: Path,
    kind: str,
    voxels: NDArray[Any],
    change: Callable[[Any], None] = lambda _: None,
    *,
    omit_empty: bool = False,
    types: Sequence[Code] = (codes.SCT.Lung,),
    affine: Affine | None = None,
) -> Path:
    """Write `images` and `seg.dcm` to a folder; return the path of the latter.

    kind        SegmentationType
    voxels      (slices, rows, columns, segments), uint8, or fractions from 0 to 1
    change      edits the file
    omit_empty  planes without a segment are left out
    types       types of the segments, used in turn; the segments' texts contain the name JANE
    affine      from voxels to LPS in mm; None: axial slices with SPACING
    """
    z, y, x, count = voxels.shape
    affine = grid(shape=(z, y, x), spacing=SPACING) if affine is None else affine
    files = write_series(folder / "images", affine, (z, y, x), change=complete)
    described = [
        highdicom.seg.SegmentDescription(
            number,
            f"left lung of JANE {number}",
            codes.SCT.Organ,
            types[(number - 1) % len(types)],
            highdicom.seg.SegmentAlgorithmTypeValues.MANUAL,
            display_color=highdicom.color.CIELabColor(100, 0, 0) if number == 1 else None,
        )
        for number in range(1, count + 1)
    ]
    found = highdicom.seg.Segmentation(
        [pydicom.dcmread(path) for path in files],
        voxels,
        highdicom.seg.SegmentationTypeValues[kind],
        described,
        highdicom.UID(),
        1,
        highdicom.UID(),
        1,
        "maker",
        "model",
        "1",
        "0",
        omit_empty_frames=omit_empty,
    )
    change(found)
    path = folder / "seg.dcm"
    found.save_as(path)
    return path
