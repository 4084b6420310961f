"""Find out whether voxels look like a CT's, in Hounsfield units or shifted by 1024.

A file that states no modality is taken for CT if its values are Hounsfield units, and for MR or
PET otherwise. A CT whose values were shifted or mapped to 8 bits would be taken for MR. Therefore
the plan prints the flags that build it as a CT.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.planning.skin_level import find_skin_level
from stereocell.read import Dataset

# HU, HU, share 0..1, HU: in a CT at least _AIR_SHARE of the voxels lie within _AIR_SPREAD of air,
# and 99 % lie below _MAX_HU, the value of metal.
_AIR_HU, _AIR_SPREAD, _AIR_SHARE, _MAX_HU = -1000.0, 150.0, 0.02, 4000.0
_SOFT_HU, _SOFT_SHARE = (
    40.0,
    0.02,
)  # soft tissue in HU, and the least share (0..1) of a CT's voxels within _AIR_SPREAD of it
LEVELS_HU = {"ct": -300.0, "ct-bone": 300.0}  # iso-value of each preset
WINDOW_HU = (-1024.0, 2000.0)  # window of both presets
_LIKE_HU = "values like Hounsfield units"
_OFFSET = 1024.0  # HU that scanners add to store values without a sign; some programs add 1000
_PLANES = 8  # planes in the middle of the volume that are read
_LEAST_RANGE_HU = 20.0  # least range of 99.8 % of a CT's voxels; normalised values have less
NO_SCALE = "since no scaling to Hounsfield units is known"


@dataclass(frozen=True, slots=True)
class CtEvidence:
    """Whether the voxel values of a volume look like those of a CT.

    is_hounsfield  whether the values look like Hounsfield units
    words          what the values look like, as words for the plan
    flags          flags that build these values as a CT; empty: the preset alone does
    bone_flags     flags that build the bones of such a CT; empty: no level of bone is known
    least          value of the darkest voxel
    basis          how the level in `flags` was found; empty: it is the preset's, shifted
    """

    is_hounsfield: bool
    words: str
    flags: str = ""
    bone_flags: str = ""
    least: float = 0.0
    basis: str = ""

    @property
    def has_no_air(self) -> bool:
        """Whether no voxel is as dark as air, so that the levels of CT do not apply."""
        return not self.is_hounsfield and self.least > LEVELS_HU["ct"]


def find_ct_evidence(dataset: Dataset) -> CtEvidence:
    """Return whether the values in the middle of the first channel look like a CT's."""
    middle = read_middle(dataset)
    voxels = middle.voxels
    least = float(np.min(voxels))
    if dataset.dtype.kind != "u" and _has_air(voxels, 0.0):
        return CtEvidence(True, _LIKE_HU, least=least)
    if _is_shifted(voxels, _OFFSET):
        low, high = (value + _OFFSET for value in WINDOW_HU)
        skin, bone = (
            _flags(preset, level + _OFFSET, (low, high)) for preset, level in LEVELS_HU.items()
        )
        words = f"values like Hounsfield units plus {_OFFSET:g}"
        return CtEvidence(False, words, skin, bone, least)
    words = "no Hounsfield units"
    if dataset.stored_dtype == np.uint8:
        words = "8-bit values, which are no Hounsfield units"
    low, high = (float(value) for value in np.quantile(voxels, (0.001, 0.999)))
    if low >= high:
        return CtEvidence(False, words, "--preset ct", least=least, basis=NO_SCALE)
    level, origin = find_skin_level(middle)
    # three digits, because the user reads the level and adjusts it
    rounded = (float(f"{low:.3g}"), float(f"{high:.3g}"))
    flags, basis = _flags("ct", float(f"{level:.3g}"), rounded), f"{origin}, {NO_SCALE}"
    return CtEvidence(False, words, flags, least=least, basis=basis)


def is_other_scale(dataset: Dataset, level: float) -> bool:
    """Return whether the voxels of a CT show that they are not Hounsfield units.

    level  the preset's level, in Hounsfield units. Unsigned values may be Hounsfield units that
           were clipped at 0; then the level must not lie below all of them

    A part of a body without air returns False, because nothing shows that its values are shifted.
    """
    if dataset.stored_dtype == np.uint8:
        return True
    voxels = read_middle(dataset).voxels
    low, high = (float(value) for value in np.quantile(voxels, (0.001, 0.999)))
    if high - low < _LEAST_RANGE_HU or _is_shifted(voxels, _OFFSET):
        return True
    return dataset.dtype.kind == "u" and level < float(np.min(voxels))


def recognise_modality(dataset: Dataset, stated: str) -> tuple[str, str]:
    """Return DICOM's code of a volume's modality, empty if not known, and a note for the plan.

    stated  modality in the settings; it counts if the input states none

    A volume of one channel in Hounsfield units is a CT whatever its size; it may show a mouse.
    """
    known = dataset.modality or stated
    if known or len(dataset.channels) != 1 or dataset.dtype.kind == "u":
        return known, ""
    if not _has_air(read_middle(dataset).voxels, 0.0):
        return "", ""
    return "CT", f"{_LIKE_HU}: taken for CT (--modality GM: it is a microscope's)"


def read_middle(dataset: Dataset) -> Volume:
    """Return whole planes from the middle of the first channel.

    Corners may hold padding only, and the middle of a plane may hold the body only.
    """
    depth, height, width = dataset.levels[0].shape
    first = max(0, (depth - _PLANES) // 2)
    middle = Box((first, 0, 0), (min(depth, first + _PLANES), height, width))
    return dataset.read(0, middle)


def _flags(preset: str, level: float, window: tuple[float, float]) -> str:
    low, high = window
    return f"--preset {preset} --iso-value 0={level:.6g} --window 0={low:.6g}:{high:.6g}"


def _has_air(voxels: NDArray[Any], shift: float) -> bool:
    """Return whether the voxels hold air, and few values above a CT's, both moved by `shift` HU."""
    is_air = np.abs(voxels - (_AIR_HU + shift)) <= _AIR_SPREAD
    return float(is_air.mean()) >= _AIR_SHARE and float(np.quantile(voxels, 0.99)) <= (
        _MAX_HU + shift
    )


def _is_shifted(voxels: NDArray[Any], shift: float) -> bool:
    """Return whether unsigned values have peaks of air and of soft tissue, and little in between.

    Air is not enough, because the background of any image lies near 0.
    """
    if float(np.min(voxels)) < 0 or not _has_air(voxels, shift):
        return False
    values = voxels.astype(np.float32)
    soft, air = _SOFT_HU + shift, _AIR_HU + shift
    is_soft = np.abs(values - soft) <= _AIR_SPREAD
    is_between = (values > air + 2 * _AIR_SPREAD) & (values < soft - 2 * _AIR_SPREAD)
    is_above = values > soft + _AIR_SPREAD
    share = float(is_soft.mean())
    return share >= _SOFT_SHARE and share > max(float(is_between.mean()), float(is_above.mean()))
