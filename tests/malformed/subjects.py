"""Intact sources of every format: small, and with a different value in each voxel.

They are written by other libraries than the readers where there are any. Each source states the
ranges in which it holds voxels without a checksum: a byte that changes there can't be noticed.
"""

import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import hdf5plugin
import mrcfile
import nibabel as nib
import nrrd
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pydicom
import SimpleITK as sitk
import tifffile
from numpy.typing import NDArray
from PIL import Image as Pillow
from pydicom.uid import JPEG2000Lossless
from zarr.codecs import GzipCodec

from malformed.base import write_anndata
from support.array_files import write_bdv_xml, write_czi, write_ims, write_lif, write_n5
from support.dicom_series import compress, grid, write_enhanced, write_series
from support.nd2_files import write_nd2
from support.phantoms import write_ome_tiff, write_ome_zarr

SPACING_UM = (0.5, 0.2, 0.25)  # z, y, x
_ranks = np.random.default_rng(7).permutation(6 * 32 * 48)
# each value occurs once
VOXELS: NDArray[np.uint16] = (_ranks + 700).astype(np.uint16).reshape(6, 32, 48)
_BYTES: NDArray[np.uint8] = (VOXELS % 251).astype(np.uint8)
_LABELS = np.arange(1, 7, dtype=np.uint16)
_NM: dict[str, Any] = {"pixelResolution": {"dimensions": [250, 200, 500], "unit": "nm"}}
_PIECE = 12  # voxels of a row that are contiguous in every format, limited by the tiles of CZI
Ranges = list[tuple[int, int]]  # bytes of a file: the first, and the one after the last


@dataclass(frozen=True, slots=True)
class Subject:
    """One source.

    write        writes it into a folder, and returns its path
    format       its title in the table; several subjects may share one
    files        patterns of the files that are changed
    unprotected  returns the ranges of a file that hold voxels without a checksum
    """

    name: str
    format: str
    write: Callable[[Path], Path]
    files: tuple[str, ...] = ("**/*",)
    unprotected: Callable[[Path], Ranges] = lambda _path: []


def _rows(*arrays: NDArray[Any]) -> Callable[[Path], Ranges]:
    """Return a function that finds the rows of arrays in a file, in either byte order."""

    def find(path: Path) -> Ranges:
        content = path.read_bytes()
        found: Ranges = []
        for array in arrays:
            pieces = np.ascontiguousarray(array).reshape(-1, _PIECE)
            for order in "<>":
                for piece in pieces.astype(pieces.dtype.newbyteorder(order)):
                    stored = piece.tobytes()
                    start = content.find(stored)
                    while start >= 0:
                        found.append((start, start + len(stored)))
                        start = content.find(stored, start + 1)
        return found

    return find


def _whole(path: Path) -> Ranges:
    return [] if path.suffix in (".json", ".xml") or path.name.startswith(".z") else [(0, 1 << 60)]


def _image_of_jpeg(path: Path) -> Ranges:
    """Return the range that begins at the first quantisation table: JPEG has no checksum there."""
    return [(path.read_bytes().find(b"\xff\xdb"), 1 << 60)]


def _pixels_of_dicom(path: Path) -> Ranges:
    pixels = bytes(pydicom.dcmread(path).PixelData)
    start = path.read_bytes().rfind(pixels)
    return [(start, start + len(pixels))]


def _chunks_of_hdf5(path: Path) -> Ranges:
    with h5py.File(path) as file:
        stored = file["raw"].id
        chunks = [stored.get_chunk_info(i) for i in range(stored.get_num_chunks())]
    return [(chunk.byte_offset, chunk.byte_offset + chunk.size) for chunk in chunks]


def _arrays_of_hdf5(path: Path) -> Ranges:
    """Return the ranges of contiguous datasets, which hold numbers and the positions of texts."""
    found: Ranges = []

    def add(_: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset) and node.id.get_offset():
            start = node.id.get_offset()
            found.append((start, start + node.id.get_storage_size()))

    with h5py.File(path) as file:
        file.visititems(add)
    return found


def _pages_of_parquet(path: Path) -> Ranges:
    content = path.read_bytes()
    return [(4, len(content) - 8 - int.from_bytes(content[-8:-4], "little"))]


def _zarr(version: str, compressors: Any) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        scale = dict(zip("zyx", SPACING_UM, strict=True))
        return write_ome_zarr(
            folder / "a.ome.zarr",
            [VOXELS[None]],
            axes="czyx",
            version=version,
            scales=[scale],
            channels=[{"label": "CD31", "color": "FF0000"}],
            chunks=(1, 3, 32, 48),
            compressors=compressors,
        )

    return write


def _ome_tiff(**options: Any) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        names = ["CD31"]
        return write_ome_tiff(
            folder / "a.ome.tif", VOXELS, spacing=SPACING_UM, names=names, **options
        )

    return write


def _imagej(folder: Path) -> Path:
    about = {"axes": "ZYX", "spacing": SPACING_UM[0], "unit": "um"}
    resolution = (1 / SPACING_UM[2], 1 / SPACING_UM[1])
    tifffile.imwrite(folder / "a.tif", VOXELS, imagej=True, metadata=about, resolution=resolution)
    return folder / "a.tif"


def _labels(folder: Path) -> Path:
    labels = _LABELS.repeat(1536).reshape(6, 32, 48)
    about = {"axes": "ZYX", "spacing": SPACING_UM[0], "unit": "um"}
    resolution = (1 / SPACING_UM[2], 1 / SPACING_UM[1])
    tifffile.imwrite(folder / "a.tif", labels, imagej=True, metadata=about, resolution=resolution)
    return folder / "a.tif"


def _planes(suffix: str, voxels: NDArray[Any]) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / "planes").mkdir()
        for z, plane in enumerate(voxels):
            Pillow.fromarray(plane).save(folder / "planes" / f"a_z{z:02}{suffix}")
        return folder / "planes"

    return write


def _fix_identity(ds: Any, number: int) -> None:
    """Replace random UIDs, so that a file has the same bytes each time."""
    ds.SOPInstanceUID = ds.file_meta.MediaStorageSOPInstanceUID = f"1.2.826.0.1.{1000 + number}"
    for name in ("StudyInstanceUID", "SeriesInstanceUID", "FrameOfReferenceUID"):
        if name in ds:
            setattr(ds, name, "1.2.826.0.2.1001")


def _dicom(syntax: str = "") -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        shape = (6, 32, 48)

        def change(ds: Any) -> None:
            number = int(ds.InstanceNumber)
            _fix_identity(ds, number)
            ds.PixelData = VOXELS[number - 1].astype("<i2").tobytes()

        for path in write_series(folder / "series", grid(shape=shape), shape, change=change):
            if syntax:
                compress(path, syntax)
        return folder / "series"

    return write


def _enhanced(folder: Path) -> Path:
    path = folder / "a.dcm"
    write_enhanced(path, grid(shape=(6, 32, 48)), (6, 32, 48))
    ds = pydicom.dcmread(path)
    _fix_identity(ds, 1)
    ds.PixelData = VOXELS.astype("<i2").tobytes()
    ds.save_as(path)
    return path


def _nifti(name: str, kind: Any = nib.Nifti1Image) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        affine = np.diag([*SPACING_UM[::-1], 1.0])
        stored = VOXELS.astype(np.int16).transpose(2, 1, 0)
        image = kind(stored, affine)
        if hasattr(image.header, "set_xyzt_units"):
            image.header.set_xyzt_units("micron")
        nib.save(image, folder / name)
        return folder / name

    return write


def _hdf5(**options: Any) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        with h5py.File(folder / "a.h5", "w") as file:
            stored = file.create_dataset("raw", data=VOXELS, **options)
            stored.attrs["element_size_um"] = SPACING_UM
        return folder / "a.h5"

    return write


def _ims(folder: Path) -> Path:
    return write_ims(folder / "a.ims", np.stack([VOXELS, VOXELS[::-1] + 4000]))


_IMS = np.stack([VOXELS, VOXELS + 4000])
_IMS_ROWS = [(_IMS + t)[..., :: 2**k, :: 2**k] for k in (0, 1) for t in (0, 1)]


def _n5(packing: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        return write_n5(folder / "a.n5", VOXELS, {"type": packing}, **_NM)

    return write


def _bdv(folder: Path) -> Path:
    with h5py.File(folder / "a.h5", "w") as file:
        for setup in range(2):
            file[f"s{setup:02}/resolutions"] = np.array([[1.0, 1, 1]])
            file[f"s{setup:02}/subdivisions"] = np.array([[16, 16, 16]])
            cells = (VOXELS + 4000 * setup).astype(np.int16)
            file[f"t00000/s{setup:02}/0/cells"] = cells
    write_bdv_xml(folder, "a.h5", "nm")
    return folder / "b.xml"


def _nrrd(encoding: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        header = {
            "space": "left-posterior-superior",
            "space directions": np.diag(SPACING_UM[::-1]),
            "encoding": encoding,
        }
        nrrd.write(str(folder / "a.nrrd"), VOXELS, header, index_order="C")
        return folder / "a.nrrd"

    return write


def _metaimage(name: str, is_packed: bool) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        image = sitk.GetImageFromArray(VOXELS)
        image.SetSpacing(SPACING_UM[::-1])
        sitk.WriteImage(image, str(folder / name), is_packed)
        return folder / name

    return write


def _mrc(folder: Path) -> Path:
    with mrcfile.new(folder / "a.mrc") as file:
        file.set_data(VOXELS)
        file.set_volume()
        file.voxel_size = 4.0
    return folder / "a.mrc"


def _czi(folder: Path) -> Path:
    return write_czi(folder / "a.czi", {None: VOXELS[None, None]})


def _lif(folder: Path) -> Path:
    return write_lif(folder / "a.lif", {"a": ("ZYX", VOXELS)})


def _nd2(is_packed: bool) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        write_nd2(folder / "a.nd2", VOXELS[None, None, :, None], SPACING_UM, is_packed=is_packed)
        return folder / "a.nd2"

    return write


def _parquet(folder: Path) -> Path:
    count = 60
    columns = {"label": range(1, count + 1), "area": [n / 7 for n in range(count)]}
    table = pa.table({**columns, "kind": [f"type {n % 5}" for n in range(count)]})
    pq.write_table(table, folder / "a.parquet")
    return folder / "a.parquet"


def _h5ad(folder: Path) -> Path:
    with h5py.File(folder / "a.h5ad", "w") as file:
        write_anndata(file, h5py.string_dtype())
    return folder / "a.h5ad"


def all_subjects() -> Sequence[Subject]:
    return (
        Subject("Blosc", "OME-Zarr 0.4", _zarr("0.4", "auto"), unprotected=_whole),
        Subject("zstd", "OME-Zarr 0.5", _zarr("0.5", "auto"), unprotected=_whole),
        Subject("gzip", "OME-Zarr 0.5", _zarr("0.5", [GzipCodec()])),
        Subject("strips, deflate", "OME-TIFF", _ome_tiff()),
        Subject("tiles, deflate", "OME-TIFF", _ome_tiff(tile=(16, 16), levels=2)),
        Subject("uncompressed", "OME-TIFF", _ome_tiff(compression=None), unprotected=_rows(VOXELS)),
        Subject("ImageJ", "TIFF", _imagej, unprotected=_rows(VOXELS)),
        Subject("labels", "TIFF", _labels, unprotected=_rows(_LABELS.repeat(12))),
        Subject("TIFF", "planes", _planes(".tif", VOXELS), unprotected=_rows(VOXELS)),
        Subject("PNG", "planes", _planes(".png", VOXELS)),
        Subject("JPEG", "planes", _planes(".jpg", _BYTES), unprotected=_image_of_jpeg),
        Subject("series", "DICOM", _dicom(), unprotected=_pixels_of_dicom),
        Subject("JPEG 2000", "DICOM", _dicom(JPEG2000Lossless), unprotected=_pixels_of_dicom),
        Subject("enhanced", "DICOM", _enhanced, unprotected=_pixels_of_dicom),
        Subject(".nii", "NIfTI", _nifti("a.nii"), unprotected=_rows(VOXELS)),
        Subject(".nii.gz", "NIfTI", _nifti("a.nii.gz")),
        Subject(
            "pair", "Analyze", _nifti("a.img", nib.Spm99AnalyzeImage), unprotected=_rows(VOXELS)
        ),
        Subject("contiguous", "Imaris", _ims, unprotected=_rows(*_IMS_ROWS)),
        Subject("contiguous", "HDF5", _hdf5(), unprotected=_rows(VOXELS)),
        Subject("gzip", "HDF5", _hdf5(chunks=(3, 16, 24), compression="gzip")),
        Subject(
            "Blosc",
            "HDF5",
            _hdf5(chunks=(3, 32, 48), **hdf5plugin.Blosc()),
            unprotected=_chunks_of_hdf5,
        ),
        Subject("gzip", "N5", _n5("gzip")),
        Subject("raw", "N5", _n5("raw"), unprotected=_whole),
        Subject("HDF5", "BigDataViewer", _bdv, unprotected=_rows(VOXELS, VOXELS + 4000)),
        Subject("raw", "NRRD", _nrrd("raw"), unprotected=_rows(VOXELS)),
        Subject("gzip", "NRRD", _nrrd("gzip")),
        Subject("raw", "MetaImage", _metaimage("a.mhd", False), unprotected=_rows(VOXELS)),
        Subject("zlib", "MetaImage", _metaimage("a.mha", True)),
        Subject("raw", "MRC", _mrc, unprotected=_rows(VOXELS)),
        Subject("uncompressed", "CZI", _czi, unprotected=_rows(VOXELS)),
        Subject("raw", "LIF", _lif, unprotected=_rows(VOXELS)),
        Subject("uncompressed", "ND2", _nd2(is_packed=False), unprotected=_rows(VOXELS)),
        Subject("zlib", "ND2", _nd2(is_packed=True)),
        Subject("snappy", "Parquet (table)", _parquet, unprotected=_pages_of_parquet),
        Subject("contiguous", "AnnData (table)", _h5ad, unprotected=_arrays_of_hdf5),
    )


def files_of(subject: Subject, folder: Path) -> Iterator[Path]:
    """Yield the files of a written subject that mutations change, in a fixed order."""
    found = {path for pattern in subject.files for path in folder.glob(pattern)}
    yield from sorted(path for path in found if path.is_file() and path.stat().st_size > 1)


def copy_of(folder: Path, to: Path) -> None:
    shutil.copytree(folder, to, dirs_exist_ok=True)
