"""A DICOM series of several kinds of frames, each with a constant that is added to the scene."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pydicom

from stereocell import read
from support.dicom_reading import whole
from support.dicom_series import Change, grid, setting, write_series

SHAPE = (10, 12, 14)
AFFINE = grid(shape=SHAPE, spacing=(3.0, 2.0, 2.2))


def image_type(*words: str) -> Change:
    return setting(ImageType=["ORIGINAL", "PRIMARY", *words])


def private(group: int, creator: str, element: int, vr: str, value: Any) -> Change:
    def change(ds: pydicom.Dataset) -> None:
        ds.private_block(group, creator, create=True).add_new(element, vr, value)

    return change


def write_kind(
    folder: Path,
    add: float,
    change: Change,
    *,
    indices: Iterable[float] = range(10),
    modality: str = "MR",
    first_number: int = 1,
) -> None:
    """Write slices of series 1.2.3 whose values are the scene's values plus `add`."""

    def changed(ds: pydicom.Dataset) -> None:
        ds.InstanceNumber += first_number - 1
        change(ds)

    write_series(
        folder / f"{add:g}",
        AFFINE,
        SHAPE,
        indices=indices,
        series="1.2.3",
        intercept=add,
        change=changed,
        modality=modality,
    )


def added(folder: Path, series: int = 0, time: int = 0) -> float:
    """Return the constant by which the voxels that are read exceed the scene.

    The scene is 0 at its edge, so the constant is the smallest voxel.
    """
    return float(whole(read.open(folder, series=series, time=time)).min())
