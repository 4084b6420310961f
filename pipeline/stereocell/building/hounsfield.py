"""Settings of a CT whose values are no Hounsfield units: presets' levels and windows go.

A CT without them is built as a volume of no known modality: its levels and windows are found, and
no functions for tissues are offered. Values that the user gave by channel stay.
"""

from dataclasses import replace

from stereocell.building.channels import ALL
from stereocell.building.settings import Settings, load

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
