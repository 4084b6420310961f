"""Siemens' mosaics of the scene: all slices in one image, placed by a private header."""

import math
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from support.dicom_series import image, sample, save

SHAPE = (7, 18, 20)  # voxels (z, y, x); the 7 slices are laid out in 3 x 3 places
SPACING = (2.5, 2.0, 2.2)


def csa(**values: list[str]) -> bytes:
    """Return Siemens' private header of version 2 with these elements.

    References: https://nipy.org/nibabel/dicom/siemens_csa.html
    """
    kinds = {"NumberOfImagesInMosaic": b"IS", "SliceNormalVector": b"FD"}
    made = b"SV10" + bytes((4, 3, 2, 1)) + struct.pack("<2I", len(values), 77)
    for name, texts in values.items():
        made += struct.pack(
            "<64si4s3i", name.encode(), len(texts), kinds.get(name, b"LO"), 4, len(texts), 77
        )
        for text in texts:
            content = text.encode() + b"\0"
            made += struct.pack("<4i", *[len(content)] * 4)
            made += content + b"\0" * (-len(content) % 4)
    return made


def write_mosaic(
    path: Path,
    affine: NDArray[np.float64],
    number: int = 1,
    series: str = "1.2.3.4",
    change: Callable[[Any], None] = lambda ds: None,
) -> Path:
    count, rows, columns = SHAPE
    voxels = np.rint(sample(affine, SHAPE)).astype(np.uint16) * number
    side = math.ceil(math.sqrt(count))
    pixels = np.zeros((side * rows, side * columns), np.uint16)
    for k, plane in enumerate(voxels):
        row, column = divmod(k, side)
        pixels[row * rows : (row + 1) * rows, column * columns : (column + 1) * columns] = plane
    corner = affine.copy()  # position of the mosaic, as if it were a slice with the first's middle
    corner[:3, 3] -= (
        affine[:3, 1] * (side - 1) * rows / 2 + affine[:3, 2] * (side - 1) * columns / 2
    )
    ds = image(pixels, corner, 0, number=number, series=series)
    ds.ImageType = ["ORIGINAL", "PRIMARY", "M", "ND", "MOSAIC"]
    ds.SliceThickness, ds.SpacingBetweenSlices = 1.9, SPACING[0]
    normal = affine[:3, 0] / np.linalg.norm(affine[:3, 0])
    block = ds.private_block(0x0029, "SIEMENS CSA HEADER", create=True)
    header = csa(
        NumberOfImagesInMosaic=[str(count)],
        SliceNormalVector=[f"{value:.10f}" for value in normal],
        AcquisitionMatrixText=[f"{rows}*{columns}"],  # without it nibabel sees no mosaic
        PatientName=["DOE^JANE"],
    )
    block.add_new(0x10, "OB", header + b"\0" * (len(header) % 2))
    change(ds)
    return save(ds, path)
