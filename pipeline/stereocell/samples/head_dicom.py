"""The sample `mri`: the head phantom as a DICOM series of sagittal slices, of a made-up patient.

The series has the usual properties of a scanner's series. The grid is turned by a few degrees
against the patient, as ImageOrientationPatient states. The voxels are the phantom's own, so that
its truth lies on the same grid. File names and instance numbers are not in the order of positions,
and SliceThickness differs from the spacing. The bytes are the same each time: they contain no
current date, and UIDs are hashes of the seed and of a name.

References: DICOM PS3.3 A.4 (MR Image IOD); PS3.5 B.2 (UUID derived UIDs).
"""

import re
from io import BytesIO
from pathlib import Path
from uuid import UUID, uuid5

import numpy as np
from numpy.typing import NDArray
from pydicom import dcmread
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.errors import InvalidDicomError
from pydicom.filewriter import dcmwrite
from pydicom.uid import UID, ExplicitVRLittleEndian, MRImageStorage

from stereocell.model.errors import UsageError
from stereocell.samples.head import HeadPhantom, make_head
from stereocell.samples.place import EXPECTED, is_there
from stereocell.storage.atomic_write import replacing_folder
from stereocell.storage.folder_names import names_in_folder
from stereocell.storage.overwriting import require_free

_UIDS = UUID("9c5b0d0e-3f5e-5a0c-8e0f-6d1c1d6f2a74")  # namespace for the UIDs of this sample
PATIENT = "Ovoidsen^Emmeline"
IDENTITY = {  # tags of the made-up patient
    "PatientName": PATIENT,
    "PatientID": "PHANTOM-1974-0613",
    "PatientBirthDate": "19740613",
    "PatientSex": "O",
    "StudyDate": "20010203",
    "StudyTime": "040506",
    "AccessionNumber": "ACC-PHANTOM-77",
    "ReferringPhysicianName": "Cassini^Giovanna",
    "InstitutionName": "Paraboloid Hospital",
    "StationName": "HYPERBOLA2",
    "StudyDescription": "Quadrics of the head",
    "SeriesDescription": "T1w sagittal phantom",
}
# Degrees by which the head is turned about the axes (left, posterior, superior).
TURN_DEG = (4.0, -3.0, 6.0)
ISOCENTRE_MM = (3.0, -12.0, 21.0)  # mm, LPS position of the middle of the grid
_FILE = re.compile(r"IM\d{4}\.dcm")  # names of the sample's files
SLICE_THICKNESS_MM = 5.0  # mm; intentionally differs from the spacing of this series


def write_head(path: Path, *, seed: int = 0) -> None:
    """Write the phantom of `seed` to the folder `path`. An existing equal sample stays.

    Raises UsageError for a seed below 0, OutputError if the folder holds other content or can't be
    written.
    """
    if seed < 0:
        raise UsageError(f"--seed is {seed}, expected 0 or more")
    _require_free(path, seed)
    write_dicom(path, make_head(seed=seed), seed=seed)


def write_dicom(path: Path, head: HeadPhantom, *, seed: int = 0) -> None:
    """Write one file per sagittal slice into the folder `path`, in an order shuffled by `seed`.

    Raises OutputError if the folder holds other content or can't be written.
    """
    files = _files(head, seed)
    if is_there(path, files):
        return
    with replacing_folder(path) as folder:
        for name, content in files.items():
            (folder / name).write_bytes(content)


def _require_free(path: Path, seed: int) -> None:
    """Raise OutputError if a folder holds other files, before the sample is computed.

    The UID of the series in the first file depends on the seed, and so identifies the sample.
    """
    names = names_in_folder(path)
    is_ours = not path.is_file() and all(_FILE.fullmatch(name) for name in names)
    if is_ours and names:
        try:
            head = dcmread(path / names[0], specific_tags=["SeriesInstanceUID"])
            is_ours = head.SeriesInstanceUID == _uid(seed, "series")
        except (OSError, InvalidDicomError, AttributeError):
            is_ours = False
    require_free(path, expected=EXPECTED, is_ours=is_ours)


def affine_of(head: HeadPhantom) -> NDArray[np.float64]:
    """Return the (4, 4) matrix that maps columns (slice, row, column, 1) to LPS, mm.

    Slices run to the patient's left, rows down, columns to the back.
    """
    z, y, x = (length / 1000 for length in head.spacing_um)
    depth, height, width = head.voxels.shape
    axes = _turn(TURN_DEG) @ np.array([(1.0, 0, 0), (0, 0, -1.0), (0, 1.0, 0)]).T
    affine = np.eye(4)
    affine[:3, :3] = axes * (x, y, z)
    middle = np.array([width - 1, height - 1, depth - 1]) / 2
    affine[:3, 3] = np.array(ISOCENTRE_MM) - affine[:3, :3] @ middle
    return affine


def _turn(degrees: tuple[float, float, float]) -> NDArray[np.float64]:
    """Return the rotation (3, 3) by angles in degrees about x, then y, then z."""
    turn = np.eye(3)
    for axis, angle in enumerate(np.radians(degrees)):
        a, b = [k for k in range(3) if k != axis]
        step = np.eye(3)
        step[a, a] = step[b, b] = np.cos(angle)
        step[b, a] = np.sin(angle) * (-1 if axis == 1 else 1)
        step[a, b] = -step[b, a]
        turn = step @ turn
    return turn


def _files(head: HeadPhantom, seed: int) -> dict[str, bytes]:
    """Return the contents of the DICOM files, one for each slice, by file name."""
    affine = affine_of(head)
    # Slices are stored as (slice, row, column), which run to the left, down and to the back.
    stored = head.voxels[::-1].transpose(2, 1, 0)
    numbers = np.random.default_rng(seed).permutation(len(stored)) + 1
    files = {}
    for k, (number, pixels) in enumerate(zip(numbers.tolist(), stored, strict=True)):
        ds = _image(pixels, affine, k, number, seed)
        buffer = BytesIO()
        dcmwrite(buffer, ds, enforce_file_format=True)
        files[f"IM{number:04d}.dcm"] = buffer.getvalue()
    return dict(sorted(files.items()))


def _image(
    pixels: NDArray[np.uint16], affine: NDArray[np.float64], k: int, number: int, seed: int
) -> Dataset:
    ds = Dataset()
    ds.file_meta = FileMetaDataset()
    ds.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    ds.file_meta.MediaStorageSOPClassUID = ds.SOPClassUID = MRImageStorage
    ds.file_meta.MediaStorageSOPInstanceUID = ds.SOPInstanceUID = _uid(seed, f"image {k}")
    ds.file_meta.ImplementationClassUID = UID(f"2.25.{_UIDS.int}")
    ds.file_meta.ImplementationVersionName = "STEREOCELL"
    for name, value in IDENTITY.items():
        setattr(ds, name, value)
    ds.StudyInstanceUID, ds.SeriesInstanceUID = _uid(seed, "study"), _uid(seed, "series")
    ds.FrameOfReferenceUID, ds.PositionReferenceIndicator = _uid(seed, "frame"), ""
    ds.StudyID, ds.SeriesNumber, ds.InstanceNumber = "1", 1, number
    ds.Modality, ds.Manufacturer, ds.PatientPosition = "MR", "StereoCell", "HFS"
    ds.ImageType = ["DERIVED", "PRIMARY", "OTHER"]
    ds.ScanningSequence, ds.SequenceVariant, ds.ScanOptions = "RM", "NONE", ""
    ds.MRAcquisitionType, ds.EchoTime, ds.EchoTrainLength = "3D", "", ""
    ds.SliceThickness = SLICE_THICKNESS_MM
    rows, columns = (float(np.linalg.norm(affine[:3, axis])) for axis in (1, 2))
    ds.PixelSpacing = [_decimal(rows), _decimal(columns)]
    ds.ImageOrientationPatient = [
        _decimal(v) for v in (*(affine[:3, 2] / columns), *(affine[:3, 1] / rows))
    ]
    ds.ImagePositionPatient = [_decimal(v) for v in affine[:3, 3] + k * affine[:3, 0]]
    ds.SamplesPerPixel, ds.PhotometricInterpretation = 1, "MONOCHROME2"
    ds.Rows, ds.Columns = pixels.shape
    ds.BitsAllocated, ds.BitsStored, ds.HighBit, ds.PixelRepresentation = 16, 12, 11, 0
    ds.PixelData = np.ascontiguousarray(pixels, "<u2").tobytes()
    return ds


def _uid(seed: int, name: str) -> UID:
    return UID(f"2.25.{uuid5(_UIDS, f'{seed} {name}').int}")


def _decimal(value: float) -> str:
    """Return a number as a DS, which has at most 16 characters (DICOM PS3.5 6.2)."""
    return f"{value + 0.0:.10f}"[:16]
