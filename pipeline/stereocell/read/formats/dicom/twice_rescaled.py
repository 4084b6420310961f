"""Find CT images that were rescaled before they were stored, although a rescale is still stated.

Some exports store Hounsfield units and keep the scanner's RescaleIntercept, -1024 for example.
Readers apply it again: air is then near -2024 and soft tissue near -1024, below all iso-values for
CT. Padding around a scanner's circle is as low, but it has a single value, with tissue above it.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.formats.dicom.frame import Frame
from stereocell.read.formats.dicom.scale_notes import reaches_air, scale_notes
from stereocell.read.formats.dicom.stack import Stack

_OFFSET_HU = -500.0  # intercepts of a scanner's offset are at most this
_FAR_HU = -1500.0  # half-way between air (-1000) and air with the offset applied twice
_FAR_SHARE = 0.05  # smallest share of the voxels below _FAR_HU
_VARIED = 0.01  # smallest share of the voxels below _FAR_HU that differ from their minimum
_TISSUE_HU = -300.0  # fat and denser tissue lies above it; rescaled twice, only dense bone does
_TISSUE_SHARE = 0.05  # largest share of the voxels above _TISSUE_HU
_LOW_HU = -1024.0  # lowest value that most scanners store
LEVEL_HU, WINDOW_HU = -300.0, (-1024.0, 2000.0)  # iso-value and window of preset `ct`

Decode = Callable[[Sequence[Frame]], NDArray[Any]]  # frames -> grey values (n, rows, columns)


def describe_values(stack: Stack, decode: Decode) -> tuple[bool, tuple[str, ...]]:
    """Return whether a CT is in Hounsfield units (True for others), and notes on the values.

    decode  called only if the headers leave a question open
    """
    frames = [frame for point in stack.times for frame in point]
    if stack.first.modality != "CT":
        return True, scale_notes(frames, is_hounsfield=True)
    middle = stack.times[0][len(stack.times[0]) // 2]
    is_hounsfield = reaches_air(frames, lambda: float(decode([middle]).min()))
    notes = scale_notes(frames, is_hounsfield=is_hounsfield)
    twice = _note_on_twice(frames, stack.times[0], decode) if is_hounsfield else ""
    return (False, (*notes, twice)) if twice else (is_hounsfield, notes)


def _note_on_twice(frames: Sequence[Frame], point: Sequence[Frame], decode: Decode) -> str:
    """Return a note if the intercept of all frames seems to be applied twice, or else nothing.

    point  frames of one time point, along the normal
    """
    scales = {(f.encoding.slope, f.encoding.intercept) for f in frames}
    (slope, intercept), *others = scales
    is_stated = not others and slope == 1 and intercept <= _OFFSET_HU
    reaches = all(f.encoding.table is None and f.encoding.bits for f in frames)
    if not (is_stated and reaches) or frames[0].encoding.grey_ends[0] >= _FAR_HU:
        return ""
    chosen = sorted({len(point) // 4, len(point) // 2, 3 * len(point) // 4})
    planes = decode([point[place] for place in chosen])
    if not _is_far_below(planes):
        return ""
    share = float(np.mean(planes < _LOW_HU))
    low, high = (end + intercept for end in WINDOW_HU)
    return (
        f"{share:.0%} of the voxels of {len(chosen)} slices lie below {_LOW_HU:g}, and air has "
        f"-1000 HU: RescaleIntercept {intercept:g} seems to be applied twice, so the values are "
        "not Hounsfield units. Iso-values and window are found as for any other volume "
        f"(--iso-value 0={LEVEL_HU + intercept:g} --window 0={low:g}:{high:g} are those of CT; "
        "--as hounsfield treats the values as Hounsfield units)"
    )


def _is_far_below(planes: NDArray[Any]) -> bool:
    """Return whether grey values lie where a second offset would put them."""
    far = planes[planes < _FAR_HU]
    if far.size < _FAR_SHARE * planes.size:
        return False
    has_many = np.count_nonzero(far > far.min()) >= _VARIED * far.size
    has_tissue = np.count_nonzero(planes > _TISSUE_HU) > _TISSUE_SHARE * planes.size
    return bool(has_many and not has_tissue)
