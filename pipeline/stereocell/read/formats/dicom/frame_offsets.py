"""Place the planes of multi-frame images without functional groups: RT Dose, reconstructed NM.

Only the first frame's position is stated. The others follow along the planes' normal, at stated
offsets (dose) or at even steps (nuclear medicine).

References: DICOM PS3.3 C.8.8.3.2 (Grid Frame Offset Vector), C.8.4.15 (NM Reconstruction).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydicom.uid import NuclearMedicineImageStorage, RTDoseStorage

from stereocell.read.formats.dicom.silence_logs import DICOM_FAULTS

_ALONG = 0.999  # cosine between an axial plane's normal and z
# value in ImageType for slices, rather than projections, energies or phases
_RECONSTRUCTED = "RECON TOMO"
_STATED_ONCE = ("ImagePositionPatient", "ImageOrientationPatient")


def is_dose(header: Any) -> bool:
    """Return whether the values are doses, which have their own scaling."""
    return bool(header.get("SOPClassUID") == RTDoseStorage)


def has_offsets(header: Any) -> bool:
    """Return whether the frames of this kind of image may follow from the first."""
    return is_dose(header) or bool(header.get("SOPClassUID") == NuclearMedicineImageStorage)


def place_first(header: Any) -> None:
    """Copy the first frame's place from the detector, where nuclear medicine states it."""
    detectors = header.get("DetectorInformationSequence")
    if header.get("SOPClassUID") != NuclearMedicineImageStorage or not detectors:
        return
    for key in _STATED_ONCE:
        if key not in header and key in detectors[0]:
            header[key] = detectors[0][key]


def frame_offsets(header: Any, count: int, normal: NDArray[np.float64]) -> tuple[float, ...] | None:
    """Return the distance of each frame from the first, mm along the normal; None: not stated.

    header  header of an image for which `has_offsets` is true
    normal  (3,), LPS, right-handed to a row and a column
    """
    try:
        values = _of_dose(header, normal) if is_dose(header) else _of_slices(header, count)
    except DICOM_FAULTS:
        return None
    is_sound = values is not None and values.shape == (count,) and np.isfinite(values).all()
    return tuple(values.tolist()) if values is not None and is_sound else None


def _of_dose(header: Any, normal: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return offsets from the first plane; if the first isn't 0, they are positions along z."""
    values = np.array(header.GridFrameOffsetVector, np.float64)
    if values[0] == 0:
        return values
    if abs(normal[2]) < _ALONG:
        return None
    return (values - values[0]) * np.sign(normal[2])


def _of_slices(header: Any, count: int) -> NDArray[np.float64] | None:
    """Return even steps, signed by the direction of stacking; SliceVector numbers the frames."""
    if _RECONSTRUCTED not in (header.get("ImageType") or ()):
        return None
    numbers = np.array(header.get("SliceVector") or range(1, count + 1), np.int64)
    if sorted(numbers.tolist()) != list(range(1, count + 1)):
        return None
    gap = float(header.get("SpacingBetweenSlices") or header.get("SliceThickness") or 0)
    return np.asarray((numbers - 1) * gap, np.float64) if gap else None
