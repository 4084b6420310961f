"""The sound files that cases spoil: small volumes in every format, and a build of one of them."""

from pathlib import Path

import h5py
import mrcfile
import nrrd
import numpy as np
import SimpleITK as sitk

from support import dicom_mosaics
from support.array_files import write_czi, write_ims, write_lif, write_n5
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
    f.h5, f.ims, f.n5, f.nrrd, f.mha, f.mrc, f.czi, f.lif
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
    write_arrays(folder)


def write_arrays(folder: Path) -> None:
    """Write the letter F in the formats of arrays and of makers."""
    with h5py.File(folder / "f.h5", "w") as file:
        file["raw"] = f_phantom()
        file["raw"].attrs["element_size_um"] = SPACING
    write_ims(folder / "f.ims", np.stack([f_phantom(), f_phantom()]))
    write_n5(folder / "f.n5", pixelResolution={"dimensions": [0.2, 0.2, 0.5], "unit": "um"})
    directions = np.diag(SPACING[::-1])
    header = {"space": "left-posterior-superior", "space directions": directions, "encoding": "raw"}
    nrrd.write(str(folder / "f.nrrd"), f_phantom(), header, index_order="C")
    image = sitk.GetImageFromArray(f_phantom())
    image.SetSpacing(SPACING[::-1])
    sitk.WriteImage(image, str(folder / "f.mha"))
    with mrcfile.new(folder / "f.mrc") as file:
        file.set_data(f_phantom())
        file.set_volume()
        file.voxel_size = 4.0
    write_czi(folder / "f.czi", {None: f_phantom()[None, None]})
    write_lif(folder / "f.lif", {"a": ("ZYX", f_phantom())})


BUILD = (
    ["plan", "v5.zarr", "-o", "out", "--grid", "2x1"],
    ["units", "out", "--workers", "0"],
    ["stage", "out", "--workers", "0"],
    ["bundle", "out", "--workers", "0"],
)
