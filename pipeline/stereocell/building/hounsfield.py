"""Decide whether the values of a CT are Hounsfield units, and build it as another volume if not.

Where the source itself says so, it is built as a volume of no known modality: presets' levels and
windows go, and others are found. Where the voxels alone show it, the settings stay as they are
given. In both cases nothing is compared with Hounsfield units: no functions of tissues are offered,
no table or head holder is looked for, and no window of a CT console fits.
"""

from dataclasses import replace

import numpy as np

from stereocell.building.channels import ALL
from stereocell.building.ct_evidence import read_middle
from stereocell.building.settings import HOUNSFIELD, Settings, load
from stereocell.model.errors import UsageError
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
