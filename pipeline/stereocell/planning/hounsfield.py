"""Decide whether the values of a CT are Hounsfield units, and build it as another volume if not.

If the source states that its values are not Hounsfield units, or the voxels show it, the build
finds levels and windows by itself instead of using the presets'. If the voxels only lack air, the
settings stay as they are.

In both cases no value is compared with Hounsfield units. No transfer functions by tissue are
offered, no table or head holder is looked for, and no window of a CT console is accepted.
"""

from dataclasses import dataclass, replace

import numpy as np

from stereocell.model.errors import UsageError
from stereocell.planning.channels import ALL
from stereocell.planning.ct_evidence import is_other_scale, read_middle, recognise_modality
from stereocell.planning.settings import HOUNSFIELD, Settings, load
from stereocell.read import Dataset
from stereocell.transfer.windows import NAMED

# HU, share 0..1: in Hounsfield units fat and air lie below _DARK_HU, and at least _DARK_SHARE of
# the voxels do. With an offset of 1000 or 1024 only the noise of air lies there, in 8 bits nothing.
_DARK_HU, _DARK_SHARE = -30.0, 0.02
NOTE = (
    "the values of this CT are not Hounsfield units, so functions by tissue are not offered and a "
    "table or head holder is kept (--as hounsfield treats them as such)"
)
_PRESETS = ("ct", "ct-bone")  # presets with levels and windows in Hounsfield units


@dataclass(frozen=True, slots=True)
class Modality:
    """The kind of scanner or microscope that took a volume.

    code           DICOM's code; empty: not known
    is_hounsfield  whether the values of a CT may be compared with Hounsfield units
    note           note for the plan on how the modality was recognised; empty: none
    """

    code: str
    is_hounsfield: bool
    note: str


def settle_modality(
    dataset: Dataset, settings: Settings, *, are_labels: bool
) -> tuple[Settings, Modality]:
    """Return a volume's modality, and the settings without levels that do not fit its values.

    are_labels  whether only objects of label maps are built; their numbers are not measurements

    Raises UsageError if a window in Hounsfield units is requested for other values.
    """
    code, note = dataset.modality or settings.plan.modality, ""
    is_asserted = settings.plan.taken_as == HOUNSFIELD  # the user says that values are HU
    if not dataset.has_hounsfield_units:
        settings, code = without_hounsfield(settings), ""
    elif not are_labels and is_asserted:
        code = code or "CT"
    elif not are_labels:
        code, note = recognise_modality(dataset, settings.plan.modality)
    if are_labels or is_asserted or has_hounsfield(dataset, code):
        return settings, Modality(code, True, note)
    level = _level_of_preset(settings)
    if level is not None and is_other_scale(dataset, level):
        settings = without_hounsfield(settings)
    require_no_console_window(settings)
    return settings, Modality(code, False, NOTE)


def _level_of_preset(settings: Settings) -> float | None:
    """Return the level in Hounsfield units that a preset has set; None: no preset has."""
    level = settings.iso_values.get(ALL)
    presets = [load(name, None, flags={}).iso_values[ALL] for name in _PRESETS]
    return float(level) if level is not None and level in presets else None


def without_hounsfield(settings: Settings) -> Settings:
    """Return the settings without the level and window that a preset for CT has set."""
    presets = [load(name, None, flags={}) for name in _PRESETS]
    levels = dict(settings.iso_values)
    if any(levels.get(ALL) == preset.iso_values[ALL] for preset in presets):
        del levels[ALL]
    windows = dict(settings.windows)
    if any(windows.get(ALL) == preset.windows[ALL] for preset in presets):
        del windows[ALL]
    return replace(settings, iso_values=levels, windows=windows)


def assert_hounsfield(dataset: Dataset, taken_as: str) -> Dataset:
    """Return the source, with values in Hounsfield units if `--as hounsfield` says so."""
    if taken_as != HOUNSFIELD or dataset.has_hounsfield_units:
        return dataset
    return replace(dataset, has_hounsfield_units=True)


def has_hounsfield(dataset: Dataset, modality: str) -> bool:
    """Return whether the values of a CT may be compared with Hounsfield units.

    A source that states its modality and has signed values is trusted. Its voxels are not tested,
    because a part of a brain has neither fat nor air.
    """
    if modality != "CT":
        return dataset.has_hounsfield_units
    if dataset.modality and dataset.dtype.kind != "u":
        return True
    dark = read_middle(dataset).voxels < _DARK_HU
    return float(np.mean(dark)) >= _DARK_SHARE


def require_no_console_window(settings: Settings) -> None:
    """Raise UsageError if a window is given by name, because names stand for Hounsfield units."""
    for key, window in settings.windows.items():
        if window in NAMED:
            raise UsageError(
                f"--window {key}={window}: this window is in Hounsfield units, and the values of "
                "this CT are not, expected LOW:HIGH in voxel values"
            )
