"""The sound files that cases spoil: small volumes in every format, and a build of one of them."""

from pathlib import Path

import numpy as np

from support import dicom_mosaics
from support.dicom_series import grid, write_enhanced, write_f_nifti, write_series
from support.phantoms import f_phantom, write_ome_tiff, write_ome_zarr

SHAPE = (16, 48, 36)
DICOM_SHAPE = (6, 30, 26)
SPACING = (0.5, 0.2, 0.2)


def write_base(folder: Path) -> None:
    """Write them all but the build.

    v5.zarr, v4.zarr   two channels, F and G, in chunks; OME-Zarr 0.5 and 0.4
    f.ome.tif          strips and zlib; t.ome.tif: tiles
    f.nii, f.nii.gz    one volume
    series/, e.dcm     DICOM: a series and one enhanced file; m.dcm: a mosaic of slices
    """
    both = np.stack([f_phantom(), f_phantom()[::-1]])
    labels = [{"label": "F", "color": "FF0000"}, {"label": "G", "color": "00FF00"}]
    scale = [dict(zip("zyx", SPACING, strict=True))]
    for name, version in (("v5.zarr", "0.5"), ("v4.zarr", "0.4")):
        write_ome_zarr(
            folder / name,
            [both],
            axes="czyx",
            version=version,
            scales=scale,
            channels=labels,
            chunks=(1, 8, 24, 18),
        )
    write_ome_tiff(folder / "f.ome.tif", f_phantom(), spacing=SPACING, names=["F"])
    write_ome_tiff(folder / "t.ome.tif", f_phantom(), names=["F"], tile=(16, 16), levels=2)
    for name in ("f.nii", "f.nii.gz"):
        write_f_nifti(folder / name, f_phantom(), SPACING)
    write_series(folder / "series", grid(shape=DICOM_SHAPE), DICOM_SHAPE)
    write_enhanced(folder / "e.dcm", grid(shape=(4, 8, 9)), (4, 8, 9))
    mosaic = grid(shape=dicom_mosaics.SHAPE, spacing=dicom_mosaics.SPACING)
    dicom_mosaics.write_mosaic(folder / "m.dcm", mosaic)


BUILD = (
    ["plan", "v5.zarr", "-o", "out", "--grid", "2x1"],
    ["units", "out", "--workers", "0"],
    ["stage", "out", "--workers", "0"],
    ["bundle", "out", "--workers", "0"],
)
