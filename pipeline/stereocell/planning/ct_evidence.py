"""Whether voxels look like CT: in Hounsfield units, or with the offset of 1024 that scanners store.

A file that states no modality is taken for CT where its values are Hounsfield units, and for MR or
PET otherwise. A CT whose values were shifted, or mapped to 8 bits, is taken for MR then, so the
plan names the flags by which it is built as a CT.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.planning.skin_level import find_skin_level
from stereocell.read import Dataset

# At least AIR_SHARE of the voxels lie within AIR_SPREAD of air, and 99 % lie below metal.
_AIR_HU, _AIR_SPREAD, _AIR_SHARE, _MAX_HU = -1000.0, 150.0, 0.02, 4000.0
_SOFT_HU, _SOFT_SHARE = 40.0, 0.02  # soft tissue, and the least share of voxels within AIR_SPREAD
LEVELS_HU = {"ct": -300.0, "ct-bone": 300.0}  # of the presets
WINDOW_HU = (-1024.0, 2000.0)  # window of the presets
_LIKE_HU = "values like Hounsfield units"
_OFFSET = 1024.0  # that scanners add to store Hounsfield units without a sign; some programs: 1000
_PLANES = 8  # in the middle, that are looked at
_LEAST_RANGE_HU = 20.0  # least range of 99.8 % of the voxels: normalised values have less
NO_SCALE = "since no scaling to Hounsfield units is known"


@dataclass(frozen=True, slots=True)
class CtEvidence:
    """The evidence in the values of a volume that it is a CT.

    is_hounsfield  whether they are Hounsfield units
    words          what they look like, for the plan
    flags          the flags by which a CT of these values is built; empty: it is by the preset
    bone_flags     the same for bone; empty: no level of bone is known
    least          the darkest voxel
    basis          where the level of `flags` comes from; empty: it is in Hounsfield units, shifted
    """

    is_hounsfield: bool
    words: str
    flags: str = ""
    bone_flags: str = ""
    least: float = 0.0
    basis: str = ""

    @property
    def has_no_air(self) -> bool:
        """Whether no voxel is as dark as air, so that levels of CT mean nothing."""
        return not self.is_hounsfield and self.least > LEVELS_HU["ct"]


def find_ct_evidence(dataset: Dataset) -> CtEvidence:
    """Return what the values in the middle of the first channel say about CT."""
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
    # three digits: the level is one that a user looks at and moves
    rounded = (float(f"{low:.3g}"), float(f"{high:.3g}"))
    flags, basis = _flags("ct", float(f"{level:.3g}"), rounded), f"{origin}, {NO_SCALE}"
    return CtEvidence(False, words, flags, least=least, basis=basis)


def is_other_scale(dataset: Dataset, level: float) -> bool:
    """Return whether the voxels of a CT show that they are no Hounsfield units.

    level  of the preset, Hounsfield units: values without a sign may still be ones that were cut
           off at 0, as long as that level lies among them

    A part of a body without air keeps its level: nothing shows that it is shifted.
    """
    if dataset.stored_dtype == np.uint8:
        return True
    voxels = read_middle(dataset).voxels
    low, high = (float(value) for value in np.quantile(voxels, (0.001, 0.999)))
    if high - low < _LEAST_RANGE_HU or _is_shifted(voxels, _OFFSET):
        return True
    return dataset.dtype.kind == "u" and level < float(np.min(voxels))


def recognise_modality(dataset: Dataset, stated: str) -> tuple[str, str]:
    """Return DICOM's code of what took a volume, empty if it is not known, and a note for the plan.

    stated  the settings', where the input says none

    A volume of one channel in Hounsfield units is a CT, of whatever size: of a mouse, too.
    """
    known = dataset.modality or stated
    if known or len(dataset.channels) != 1 or dataset.dtype.kind == "u":
        return known, ""
    if not _has_air(read_middle(dataset).voxels, 0.0):
        return "", ""
    return "CT", f"{_LIKE_HU}: taken for CT (--modality GM: it is a microscope's)"


def read_middle(dataset: Dataset) -> Volume:
    """Return planes of the first channel: corners alone may be padding, and the middle all body."""
    depth, height, width = dataset.levels[0].shape
    first = max(0, (depth - _PLANES) // 2)
    middle = Box((first, 0, 0), (min(depth, first + _PLANES), height, width))
    return dataset.read(0, middle)


def _flags(preset: str, level: float, window: tuple[float, float]) -> str:
    low, high = window
    return f"--preset {preset} --iso-value 0={level:.6g} --window 0={low:.6g}:{high:.6g}"


def _has_air(voxels: NDArray[Any], shift: float) -> bool:
    """Whether values are Hounsfield units plus a shift, by air and by the lack of larger ones."""
    is_air = np.abs(voxels - (_AIR_HU + shift)) <= _AIR_SPREAD
    return float(is_air.mean()) >= _AIR_SHARE and float(np.quantile(voxels, 0.99)) <= (
        _MAX_HU + shift
    )


def _is_shifted(voxels: NDArray[Any], shift: float) -> bool:
    """Whether values without a sign have the peaks of air and of soft tissue, and little between.

    Air alone is no sign: near 0 lies the background of any image.
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
