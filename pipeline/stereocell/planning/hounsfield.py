"""Decide whether the values of a CT are Hounsfield units, and build it as another volume if not.

Where the source itself states that they are none, or the voxels show it, levels and windows of the
presets are not used, and others are found. Where the voxels merely show no air, the settings stay
as they are given. In all cases nothing is compared with Hounsfield units: no functions of tissues
are offered, no table or head holder is looked for, and no window of a CT console fits.
"""

from dataclasses import dataclass, replace

import numpy as np

from stereocell.model.errors import UsageError
from stereocell.planning.channels import ALL
from stereocell.planning.ct_evidence import is_other_scale, read_middle, recognise_modality
from stereocell.planning.settings import HOUNSFIELD, Settings, load
from stereocell.read import Dataset
from stereocell.transfer.windows import NAMED

# Hounsfield units of fat and air lie below, and so does this share of the voxels at least. An
# offset of 1000 or 1024 leaves the noise of air there alone, and 8 bits leave nothing.
_DARK_HU, _DARK_SHARE = -30.0, 0.02
NOTE = (
    "the values of this CT are no Hounsfield units: functions of tissues, such as bone, are not "
    "offered, and a table or head holder is not looked for, so it stays (--as hounsfield: they are)"
)
_PRESETS = ("ct", "ct-bone")  # presets with levels and windows in Hounsfield units


@dataclass(frozen=True, slots=True)
class Modality:
    """The kind of scanner or microscope that took a volume.

    code           DICOM's; empty: it is not known
    is_hounsfield  whether values may be compared with Hounsfield units, if it is a CT
    note           what the voxels showed of it; empty: nothing
    """

    code: str
    is_hounsfield: bool
    note: str


def settle_modality(
    dataset: Dataset, settings: Settings, *, are_labels: bool
) -> tuple[Settings, Modality]:
    """Return a volume's modality, and the settings without levels that do not fit its values.

    are_labels  whether only objects of label maps are built: their numbers are no measurements

    Raises UsageError where a window in Hounsfield units is asked for of other values.
    """
    code, note = dataset.modality or settings.plan.modality, ""
    is_asserted = settings.plan.taken_as == HOUNSFIELD  # by the user
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
    """Return the level in Hounsfield units that a preset put in; None: there is none."""
    level = settings.iso_values.get(ALL)
    presets = [load(name, None, flags={}).iso_values[ALL] for name in _PRESETS]
    return float(level) if level is not None and level in presets else None


def without_hounsfield(settings: Settings) -> Settings:
    """Return the settings without the levels and windows that a preset for CT put in."""
    presets = [load(name, None, flags={}) for name in _PRESETS]
    levels = dict(settings.iso_values)
    if any(levels.get(ALL) == preset.iso_values[ALL] for preset in presets):
        del levels[ALL]
    windows = dict(settings.windows)
    if any(windows.get(ALL) == preset.windows[ALL] for preset in presets):
        del windows[ALL]
    return replace(settings, iso_values=levels, windows=windows)


def believe(dataset: Dataset, taken_as: str) -> Dataset:
    """Return the source; if the user takes its values for Hounsfield units, they count as such."""
    if taken_as != HOUNSFIELD or dataset.has_hounsfield_units:
        return dataset
    return replace(dataset, has_hounsfield_units=True)


def has_hounsfield(dataset: Dataset, modality: str) -> bool:
    """Return whether values may be compared with Hounsfield units, if the modality is CT.

    A source that states both its modality and signed values is believed: a part of a brain has
    neither fat nor air.
    """
    if modality != "CT":
        return dataset.has_hounsfield_units
    if dataset.modality and dataset.dtype.kind != "u":
        return True
    dark = read_middle(dataset).voxels < _DARK_HU
    return float(np.mean(dark)) >= _DARK_SHARE


def require_no_console_window(settings: Settings) -> None:
    """Raise UsageError where a window is given by its name, which stands for Hounsfield units."""
    for key, window in settings.windows.items():
        if window in NAMED:
            raise UsageError(
                f"--window {key}={window}: a window in Hounsfield units, and the values of this CT "
                "are none: expected LOW:HIGH in voxel values"
            )
