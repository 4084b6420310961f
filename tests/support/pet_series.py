"""Synthetic PET series: the scene and a constant, stored with a scale of its own for each slice."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pydicom

from support.dicom_series import Affine, grid, image, sample, save

SHAPE = (10, 12, 14)
AFFINE: Affine = grid(shape=SHAPE, spacing=(3.0, 2.0, 2.2))


def write_pet(
    folder: Path,
    add: float = 0.0,
    *,
    first: int = 1,
    indices: Iterable[float] = range(10),
    series: str = "1.2.3",
    **values: Any,
) -> None:
    """Write slices whose values are the scene's values plus `add`, in Bq/ml.

    first   instance number of the first slice
    values  elements by keyword; None: the element is absent; a function gets the slice's number,
            from 0, and returns the element
    """
    stated = {
        "Units": "BQML",
        "SeriesType": ["STATIC", "IMAGE"],
        "CorrectedImage": ["DECY", "ATTN", "SCAT"],
        "FrameReferenceTime": 1000.0,
        **values,
    }
    for place, k in enumerate(indices):
        start = AFFINE.copy()
        start[:3, 3] += k * AFFINE[:3, 0]
        scene = sample(start, (1, *SHAPE[1:]))[0] + add
        slope = pydicom.valuerep.DSfloat(float(scene.max() + 1) / 32767, auto_format=True)
        pixels = np.rint(scene / float(slope)).astype(np.int16)
        number = first + place
        ds = image(pixels, AFFINE, k, modality="PT", series=series, number=number, slope=slope)
        for name, value in stated.items():
            if value is not None:
                setattr(ds, name, value(place) if callable(value) else value)
        save(ds, folder / f"{series}-{number:04d}")
