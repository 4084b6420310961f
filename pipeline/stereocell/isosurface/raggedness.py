"""Raggedness of an iso-surface: the share of it that disappears when the field is smoothed again.

Bodies keep their surface; surface that noise frayed, or made, disappears. Measured with a further
smoothing by a sigma of one finest spacing: nuclei lost .01 of their surface, vessels .00 to .02,
packed membranes .01 to .18, tubes and membranes one to two voxels thick at most .35, cells of a
real brain, few voxels wide, .14 and .25; noise without structure .15 to 1 (.30 and more unless it
was blurred widely), tiles where a stain is absent .36 to .44, a real brain's autofluorescence .20
to .36.

The ranges overlap: blurred noise is smooth too, but no steeper at its level than elsewhere, which
its sharpness shows. So both are judged together (isosurface/isovalue.py). Two other measures were
tried on the same fields and dropped, since each fails on one kind alone: the share of components
that are specks (.36 and .57 of the brain's cells, .86 of its autofluorescence, but .83 to .92 in
packed membranes, one body and few specks), and the share of the surface that is on specks (.03 and
.05 of the cells', .05 and .11 of the autofluorescence's, .0003 of that of noise whose components
have joined).
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

SMOOTHING = 1.0  # sigma in finest spacings; with 2, cells few voxels wide lose half of their area


def find_raggedness(
    field: NDArray[np.float32], level: float, spacing_um: tuple[float, float, float]
) -> float:
    """Return the share of the surface of {field > level} that smoothing removes, 0..1.

    field       float32 (z, y, x), voxel values
    level       voxel values
    spacing_um  (z, y, x)

    The result is 1 if no voxel lies above the level.
    """
    before = _area(field > level, spacing_um)
    if before == 0:
        return 1.0
    sigma = SMOOTHING * min(spacing_um) / np.asarray(spacing_um)
    # no overflow: a mean lies between its values
    smoothed = ndimage.gaussian_filter(field, sigma, mode="nearest", truncate=3.0)
    return max(0.0, 1.0 - _area(smoothed > level, spacing_um) / before)


def _area(inside: NDArray[np.bool_], spacing_um: tuple[float, float, float]) -> float:
    """Return the area of the faces between voxels inside and outside, in um^2."""
    z, y, x = spacing_um
    faces = (y * x, z * x, z * y)
    ends = [
        np.count_nonzero(np.diff(inside, axis=axis)) if inside.shape[axis] > 1 else 0
        for axis in range(3)
    ]
    return float(sum(count * face for count, face in zip(ends, faces, strict=True)))
