"""Synthetic DICOM series and NIfTI files of one scene whose every point in the patient is known.

This module does not use stereocell. A grid is an affine (4, 4) that maps a column vector
(slice, row, column, 1) to LPS in mm. In every grid, a voxel has the value of `scene` at its place.
"""

from collections.abc import Callable, Iterable, Sequence
from itertools import permutations, product
from pathlib import Path
from typing import Any

import gdcm
import nibabel
import numpy as np
import pydicom
from numpy.typing import NDArray
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
from pydicom.uid import (
    CTImageStorage,
    EnhancedCTImageStorage,
    EnhancedMRImageStorage,
    ExplicitVRLittleEndian,
    JPEGBaseline8Bit,
    JPEGLosslessSV1,
    MRImageStorage,
    PositronEmissionTomographyImageStorage,
    generate_uid,
)

Affine = NDArray[np.float64]
Change = Callable[[pydicom.Dataset], None]
# Bright bodies: centre in LPS mm, sigma in mm, height. Every mirroring or turn changes them.
BODIES = (
    ((9.0, -13.0, 7.0), 5.0, 1000.0),  # in front, to the left, above the middle
    ((-12.0, 4.0, -10.0), 4.0, 500.0),
    ((2.0, 14.0, 12.0), 3.5, 700.0),
)
BRIGHTEST = BODIES[0][0]
_CLASSES = {
    "MR": MRImageStorage,
    "CT": CTImageStorage,
    "PT": PositronEmissionTomographyImageStorage,
}
_ENHANCED = {"MR": EnhancedMRImageStorage, "CT": EnhancedCTImageStorage}


def scene(lps_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the brightness at points (..., 3), LPS mm: Gaussian blobs, 0 far away from them."""
    total = np.zeros(lps_mm.shape[:-1])
    for centre, sigma, height in BODIES:
        squared = ((lps_mm - np.array(centre)) ** 2).sum(axis=-1)
        total += height * np.exp(-squared / (2 * sigma**2))
    return total


def setting(**values: object) -> Change:
    """Return a function that sets elements of a DICOM header by their keywords."""

    def change(ds: pydicom.Dataset) -> None:
        for name, value in values.items():
            setattr(ds, name, value)

    return change


def turn(axis: Sequence[float], degrees: float) -> NDArray[np.float64]:
    """Return a rotation matrix (3, 3) about an axis (Rodrigues)."""
    x, y, z = np.array(axis, np.float64) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


PLANES = {  # directions in LPS of growing slice, row and column index
    "axial": ((0, 0, 1), (0, 1, 0), (1, 0, 0)),
    "coronal": ((0, 1, 0), (0, 0, -1), (1, 0, 0)),
    "sagittal": ((-1, 0, 0), (0, 0, -1), (0, 1, 0)),
}


def grid(
    plane: str = "axial",
    shape: tuple[int, int, int] = (22, 30, 26),
    spacing: tuple[float, float, float] = (2.5, 2.0, 2.2),
    rotation: NDArray[np.float64] | None = None,
    shift: Sequence[float] = (0.0, 0.0, 0.0),
) -> Affine:
    """Return the affine of a grid whose middle is the origin, moved by `shift` (mm).

    The direction of the slices is the cross product of the row and column directions, or the
    opposite, as PLANES states.
    """
    axes = np.array(PLANES[plane], np.float64).T
    if rotation is not None:
        axes = rotation @ axes
    affine = np.eye(4)
    affine[:3, :3] = axes * spacing
    affine[:3, 3] = shift - affine[:3, :3] @ (np.array(shape) - 1) / 2
    return affine


ORIENTATIONS = [  # for each stored axis, the axis of LPS along which it runs, and the sign
    (order, signs) for order in permutations(range(3)) for signs in product((1, -1), repeat=3)
]
# Contains each order of the axes and each choice of signs at least once.
FEW_ORIENTATIONS = [*ORIENTATIONS[::7], ORIENTATIONS[41]]


def oriented(order: Sequence[int], signs: Sequence[int], shape: Sequence[int]) -> Affine:
    """Return the affine of a grid whose middle is the origin.

    order  for each stored axis (slice, row, column), the index of the LPS axis along which it runs
    signs  1 or -1 for each stored axis; -1: it runs against the LPS axis
    """
    affine = np.eye(4)
    affine[:3, :3] = 0
    for stored, (axis, sign) in enumerate(zip(order, signs, strict=True)):
        affine[axis, stored] = sign * (2.5, 2.2, 2.0)[stored]
    affine[:3, 3] = -affine[:3, :3] @ (np.array(shape) - 1) / 2
    return affine


def tilted(affine: Affine, shape: tuple[int, int, int], degrees: float) -> Affine:
    """Return a grid whose slices drift along their rows as under a tilted gantry."""
    sheared = affine.copy()
    row = affine[:3, 1] / np.linalg.norm(affine[:3, 1])
    drift = np.tan(np.radians(degrees)) * np.linalg.norm(affine[:3, 0])
    sheared[:3, 0] += drift * row
    sheared[:3, 3] -= drift * row * (shape[0] - 1) / 2
    return sheared


def places(affine: Affine, shape: Sequence[int]) -> NDArray[np.float64]:
    """Return the LPS coordinates of every voxel, mm, (*shape, 3)."""
    index = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    return index @ affine[:3, :3].T + affine[:3, 3]


def sample(affine: Affine, shape: Sequence[int]) -> NDArray[np.float64]:
    """Return the scene's values at the voxels of a grid, float64 of this shape."""
    return scene(places(affine, shape))


def image(
    pixels: NDArray[Any],
    affine: Affine,
    slice_index: float,
    *,
    modality: str = "MR",
    series: str = "1.2.3.4",
    reference: str = "1.2.3.9",
    number: int = 1,
    slope: float | None = 1.0,
    intercept: float | None = 0.0,
    bits: int | None = None,
    photometric: str = "MONOCHROME2",
) -> FileDataset:
    """Return one slice of stored values."""
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = _CLASSES[modality]
    meta.MediaStorageSOPInstanceUID = generate_uid()
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    ds = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
    ds.SOPClassUID, ds.SOPInstanceUID = (
        meta.MediaStorageSOPClassUID,
        meta.MediaStorageSOPInstanceUID,
    )
    ds.Modality, ds.SeriesInstanceUID, ds.FrameOfReferenceUID = modality, series, reference
    ds.StudyInstanceUID, ds.InstanceNumber = "1.2.3.8", number
    ds.SliceThickness = ds.SpacingBetweenSlices = pydicom.valuerep.DSfloat(gap_mm(affine), True)
    position, orientation, spacing = _geometry(affine, slice_index)
    ds.ImagePositionPatient, ds.ImageOrientationPatient = position, orientation
    ds.PixelSpacing = spacing
    if slope is not None:
        ds.RescaleSlope, ds.RescaleIntercept = slope, intercept
    _fill_pixels(ds, pixels, bits, photometric)
    return ds


def gap_mm(affine: Affine) -> float:
    """Return the distance of neighbouring slices along their normal."""
    normal = np.cross(affine[:3, 2], affine[:3, 1])
    return abs(float(normal @ affine[:3, 0]) / float(np.linalg.norm(normal)))


def _geometry(affine: Affine, slice_index: float) -> tuple[list[Any], list[Any], list[Any]]:
    rows, columns = (float(np.linalg.norm(affine[:3, k])) for k in (1, 2))
    position = affine[:3, 3] + slice_index * affine[:3, 0]
    orientation = [*(affine[:3, 2] / columns), *(affine[:3, 1] / rows)]
    decimal = pydicom.valuerep.DSfloat
    return (
        [decimal(v, auto_format=True) for v in position.tolist()],
        [decimal(v, auto_format=True) for v in np.array(orientation).tolist()],
        [decimal(rows, auto_format=True), decimal(columns, auto_format=True)],
    )


def _fill_pixels(ds: Dataset, pixels: NDArray[Any], bits: int | None, photometric: str) -> None:
    allocated = 8 * pixels.dtype.itemsize
    ds.SamplesPerPixel, ds.PhotometricInterpretation = 1, photometric
    ds.Rows, ds.Columns = pixels.shape[-2:]
    ds.BitsAllocated, ds.BitsStored, ds.HighBit = (
        allocated,
        bits or allocated,
        (bits or allocated) - 1,
    )
    ds.PixelRepresentation = int(pixels.dtype.kind == "i")
    ds["PixelData"] = pydicom.DataElement(
        "PixelData", "OB" if allocated == 8 else "OW", pixels.tobytes()
    )


def save(ds: FileDataset, path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    ds.save_as(path, enforce_file_format=True)
    return path


def write_series(
    folder: Path,
    affine: Affine,
    shape: tuple[int, int, int] = (22, 30, 26),
    *,
    indices: Iterable[float] | None = None,
    dtype: Any = np.int16,
    name: Callable[[int], str] = "IM{:04d}".format,
    seed: int = 0,
    change: Callable[[FileDataset], None] = lambda ds: None,
    **options: Any,
) -> list[Path]:
    """Write one file a slice, in a shuffled order of names; return them by slice.

    indices  positions of the slices, in slice distances; a fraction lies between two slices
    """
    chosen = list(range(shape[0]) if indices is None else indices)
    order = np.random.default_rng(seed).permutation(len(chosen))
    series = options.pop("series", None) or generate_uid()
    paths = []
    for place, k in enumerate(chosen):
        start = affine.copy()
        start[:3, 3] += k * affine[:3, 0]
        pixels = np.rint(sample(start, (1, *shape[1:]))[0]).astype(dtype)
        ds = image(pixels, affine, k, series=series, number=place + 1, **options)
        change(ds)
        paths.append(save(ds, folder / name(int(order[place]) + 1)))
    return paths


def write_enhanced(
    path: Path,
    affine: Affine,
    shape: tuple[int, int, int],
    modality: str = "MR",
    seed: int | None = 0,
) -> Path:
    """Write an enhanced multi-frame image; its frames are shuffled, or in spatial order (None).

    All frames share the orientation and the spacing; each has its own position and rescale. Slopes
    alternate between 1 and 2, intercepts between 0, -10 and -20. Rescaled values are the scene's.
    """
    ds = image(np.zeros(shape[1:], np.uint16), affine, 0, modality=modality, slope=None)
    ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = _ENHANCED[modality]
    for tag in ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing"):
        del ds[tag]
    order = np.arange(shape[0])
    if seed is not None:
        order = np.random.default_rng(seed).permutation(shape[0])
    frames, groups = [], []
    for frame, k in enumerate(order.tolist()):
        start = affine.copy()
        start[:3, 3] += k * affine[:3, 0]
        slope, intercept = 1 + frame % 2, -10 * (frame % 3)
        values = sample(start, (1, *shape[1:]))[0]
        frames.append(np.rint((values - intercept) / slope).astype(np.uint16))
        position, orientation, spacing = _geometry(affine, k)
        group, place, rescale = Dataset(), Dataset(), Dataset()
        place.ImagePositionPatient = position
        rescale.RescaleSlope, rescale.RescaleIntercept, rescale.RescaleType = slope, intercept, "US"
        content = Dataset()
        content.InStackPositionNumber, content.StackID = k + 1, "1"
        content.DimensionIndexValues = [1, k + 1]
        group.FrameContentSequence = [content]
        group.PlanePositionSequence, group.PixelValueTransformationSequence = [place], [rescale]
        groups.append(group)
    shared, turned, measures = Dataset(), Dataset(), Dataset()
    turned.ImageOrientationPatient, measures.PixelSpacing = orientation, spacing
    gap = pydicom.valuerep.DSfloat(gap_mm(affine), True)
    measures.SliceThickness = measures.SpacingBetweenSlices = gap
    shared.PlaneOrientationSequence, shared.PixelMeasuresSequence = [turned], [measures]
    ds.SharedFunctionalGroupsSequence, ds.PerFrameFunctionalGroupsSequence = [shared], groups
    ds.NumberOfFrames = shape[0]
    organization, stack, position_in = Dataset(), Dataset(), Dataset()
    organization.DimensionOrganizationUID = "1.2.3.7"
    stack.DimensionIndexPointer, stack.FunctionalGroupPointer = 0x00209056, 0x00209111
    position_in.DimensionIndexPointer, position_in.FunctionalGroupPointer = 0x00209057, 0x00209111
    for item in (stack, position_in):
        item.DimensionOrganizationUID = "1.2.3.7"
    ds.DimensionOrganizationSequence = [organization]
    ds.DimensionIndexSequence = [stack, position_in]
    ds.PixelData = np.stack(frames).tobytes()
    return save(ds, path)


def write_f_dicom(
    folder: Path, voxels: NDArray[Any], spacing_um: tuple[float, float, float]
) -> None:
    """Write voxels whose axes are anterior, inferior, left as sagittal slices, of no known kind.

    The first voxel lies at the patient's origin. Stored are slices from left to right, rows
    downwards, columns from anterior to posterior.
    """
    z, y, x = (value / 1000 for value in spacing_um)
    depth, _, width = voxels.shape
    affine = np.eye(4)
    affine[:3, :3] = np.array([(-x, 0, 0), (0, 0, -y), (0, z, 0)]).T
    affine[:3, 3] = ((width - 1) * x, -(depth - 1) * z, 0)
    stored = voxels[::-1, :, ::-1].transpose(2, 1, 0)
    for k, plane in enumerate(stored):
        ds = image(np.ascontiguousarray(plane), affine, k, number=k + 1)
        ds.Modality = "OT"
        save(ds, folder / f"{k:03d}.dcm")


def write_f_nifti(path: Path, voxels: NDArray[Any], spacing_um: tuple[float, float, float]) -> None:
    """Write the voxels of `write_f_dicom` at the same position, as NIfTI.

    Its axes are stored as (left, superior, posterior), and lengths are in um.
    """
    z, y, x = spacing_um
    depth, height, _ = voxels.shape
    affine = np.eye(4)  # to right, anterior, superior
    affine[:3, :3] = np.array([(-x, 0, 0), (0, 0, y), (0, -z, 0)]).T
    affine[:3, 3] = (0, (depth - 1) * z, -(height - 1) * y)
    nifti = nibabel.Nifti1Image(voxels[::-1, ::-1].transpose(2, 1, 0), affine)
    nifti.header.set_xyzt_units("micron")
    nibabel.save(nifti, path)


def compress(path: Path, syntax: str) -> None:
    """Rewrite a file in a compressed syntax: by GDCM for JPEG, by pydicom's encoders else."""
    codes = {
        JPEGBaseline8Bit: gdcm.TransferSyntax.JPEGBaselineProcess1,
        JPEGLosslessSV1: gdcm.TransferSyntax.JPEGLosslessProcess14_1,
    }
    if syntax not in codes:
        ds = pydicom.dcmread(path)
        ds.compress(syntax, generate_instance_uid=False)
        ds.save_as(path)
        return
    reader = gdcm.ImageReader()
    reader.SetFileName(str(path))
    assert reader.Read()
    change = gdcm.ImageChangeTransferSyntax()
    change.SetTransferSyntax(gdcm.TransferSyntax(codes[syntax]))
    change.SetInput(reader.GetImage())
    assert change.Change()
    writer = gdcm.ImageWriter()
    writer.SetFileName(str(path))
    writer.SetFile(reader.GetFile())
    writer.SetImage(change.GetOutput())
    assert writer.Write()
