"""NIfTI files of known voxels."""

from pathlib import Path
from typing import Any

import nibabel
import numpy as np
from numpy.typing import NDArray

RAS = np.diag([-1.0, -1.0, 1.0, 1.0])  # LPS to RAS, or RAS to LPS


def write(
    path: Path,
    affine_lps: NDArray[np.float64],
    voxels: NDArray[Any],
    form: str = "sform",
    unit: str = "mm",
) -> Path:
    """Write voxels (slice, row, column) as NIfTI, which stores the first index as the fastest.

    affine_lps  from voxel indices to LPS, in `unit`
    form        the header's field that holds the affine: sform or qform; others: neither
    """
    nifti = nibabel.Nifti1Image(voxels, None)
    nifti.header.set_xyzt_units(unit)
    if form == "sform":
        nifti.header.set_sform(RAS @ affine_lps, 1)
        nifti.header["pixdim"][1:4] = np.linalg.norm(affine_lps[:3, :3], axis=0)
    elif form == "qform":
        nifti.header.set_qform(RAS @ affine_lps, 1)
    nibabel.save(nifti, path)
    return path
