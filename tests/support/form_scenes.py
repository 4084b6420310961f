"""One scene each of fluorescence, CT and MR, small enough to be drawn by software in every form."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from support import nifti_files, phantoms

SHAPE = (56, 64, 64)  # slices, rows, columns
PRESETS = {"fluorescence": "cycif", "ct": "ct", "mr": "mri"}
_MM, _UM = 3.0, 0.4  # voxel spacing of a body, and of a microscope


def _inside(
    *bodies: tuple[tuple[float, float, float], tuple[float, float, float]],
) -> NDArray[np.float64]:
    """Return the share of each voxel that lies in ellipsoids, 0 to 1, blurred by 0.8 voxels.

    bodies  middle and half axes of each ellipsoid, in voxels (z, y, x)
    """
    grid = np.indices(SHAPE, dtype=np.float64)
    solid = np.zeros(SHAPE, bool)
    for middle, half in bodies:
        solid |= sum(((g - m) / h) ** 2 for g, m, h in zip(grid, middle, half, strict=True)) < 1
    return np.asarray(ndimage.gaussian_filter(solid.astype(np.float64), 0.8))


def _head() -> NDArray[np.float64]:
    """Return a head with a nose and ears."""
    skull = ((28.0, 32.0, 32.0), (22.0, 24.0, 19.0))
    nose = ((24.0, 8.0, 32.0), (5.0, 5.0, 3.5))
    ears = [((26.0, 32.0, x), (5.0, 4.0, 3.0)) for x in (12.0, 52.0)]
    return _inside(skull, nose, *ears)


def write(folder: Path) -> dict[str, Path]:
    """Write the scenes; return the file of each, by its name."""
    rng = np.random.default_rng(0)
    folder.mkdir(parents=True, exist_ok=True)
    affine = np.diag([_MM, _MM, _MM, 1.0])
    cells = _inside(
        ((28.0, 24.0, 24.0), (12.0, 14.0, 13.0)),
        ((30.0, 46.0, 40.0), (11.0, 10.0, 12.0)),
        ((24.0, 18.0, 50.0), (8.0, 9.0, 8.0)),
    )
    light = rng.poisson(60 + 900 * cells).astype(np.uint16)
    scales = [dict.fromkeys("zyx", _UM)]
    # A test reads the values of a slice from its picture, and ignores blue pixels.
    grey = [{"label": "cells", "color": "FFFFFF"}]
    files = {
        "fluorescence": phantoms.write_ome_zarr(
            folder / "cells.ome.zarr", [light], scales=scales, channels=grey
        )
    }
    head = _head()
    hu = -1000 + 1040 * head + rng.normal(0, 12, SHAPE)
    brain = _inside(((28.0, 33.0, 32.0), (16.0, 18.0, 13.0)))
    signal = 200 * head + 60 * brain
    magnitude = np.hypot(signal + rng.normal(0, 7, SHAPE), rng.normal(0, 7, SHAPE))
    for name, voxels in (("ct", hu), ("mr", magnitude)):
        upright = voxels.round().astype(np.int16).transpose(2, 1, 0)[:, ::-1, ::-1]
        files[name] = nifti_files.write(folder / f"{name}.nii.gz", affine, upright)
    return files
