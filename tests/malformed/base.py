"""The intact files that cases damage: small volumes in every format, and a build of one of them."""

import shutil
from pathlib import Path
from typing import Any

import h5py
import mrcfile
import nrrd
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import SimpleITK as sitk
import tifffile
import zarr
from numpy.typing import NDArray

from support import dicom_mosaics
from support.array_files import write_czi, write_ims, write_lif, write_n5
from support.dicom_segmentations import write_segmentation
from support.dicom_series import grid, write_enhanced, write_f_nifti, write_series
from support.phantoms import f_phantom, write_ome_tiff, write_ome_zarr

SHAPE = (16, 48, 36)
DICOM_SHAPE = (6, 30, 26)
SPACING = (0.5, 0.2, 0.2)


def write_base(folder: Path) -> None:
    """Write all files except the build.

    v5.zarr, v4.zarr   two channels, F and G, in chunks; OME-Zarr 0.5 and 0.4
    f.ome.tif          strips and zlib; t.ome.tif: tiles
    f.nii, f.nii.gz    one volume
    series/, e.dcm     DICOM: a series and one enhanced file; m.dcm: a mosaic of slices
    f.h5, f.ims, f.n5, f.nrrd, f.mha, f.mrc, f.czi, f.lif
    cells.tif          labels on f.ome.tif; seg.dcm: a DICOM segmentation of two segments
    t.parquet, t.h5ad, t.zarr   tables of two objects
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
    write_objects(folder)


def cells_phantom() -> NDArray[np.uint16]:
    """Eight touching boxes, numbered from 1, surrounded by background, (z, y, x)."""
    labels = np.zeros(SHAPE, np.uint16)
    for number, corner in enumerate(np.ndindex(2, 2, 2), start=1):
        z, y, x = (2 + 6 * corner[0], 4 + 20 * corner[1], 4 + 14 * corner[2])
        labels[z : z + 6, y : y + 20, x : x + 14] = number
    return labels


def write_objects(folder: Path) -> None:
    """Write a label map, tables of its objects, and a DICOM segmentation."""
    tifffile.imwrite(folder / "cells.tif", cells_phantom(), photometric="minisblack")
    pq.write_table(
        pa.table({"label": [1, 2], "a": [0.5, 1.5], "kind": ["T", "B"]}), folder / "t.parquet"
    )
    with h5py.File(folder / "t.h5ad", "w") as file:
        write_anndata(file, h5py.string_dtype())
    write_anndata(zarr.open_group(folder / "t.zarr", mode="w"), str)
    voxels = np.zeros((4, 12, 12, 2), np.uint8)
    voxels[:, 2:7, 2:9, 0] = voxels[1:, 7:11, 3:9, 1] = 1
    made = folder / "made"
    write_segmentation(made, "BINARY", voxels)
    (made / "seg.dcm").rename(folder / "seg.dcm")
    shutil.rmtree(made)


def write_anndata(group: Any, text: Any) -> None:
    """Write the table of two objects in AnnData's layout."""

    def put(to: Any, name: str, values: Any) -> None:
        create = to.create_array if hasattr(to, "create_array") else to.create_dataset
        held = np.asarray(values)
        is_text = held.dtype.kind == "U"
        array = create(name, shape=held.shape, dtype=text if is_text else held.dtype)
        array[...] = held.astype(object) if is_text else held

    obs = group.create_group("obs")
    obs.attrs["column-order"] = ["label", "a"]
    put(obs, "label", [1, 2])
    put(obs, "a", [0.5, 1.5])
    var = group.create_group("var")
    var.attrs["_index"] = "_index"
    put(var, "_index", ["CD3", "CD8"])
    put(group, "X", [[1.0, 2.0], [3.0, 4.0]])


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
