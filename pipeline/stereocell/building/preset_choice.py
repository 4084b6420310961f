"""Choose the preset that suits a source, where the user names none."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stereocell.building.open_source import as_asked, open_source
from stereocell.building.settings import NO_PRESET, Settings, load
from stereocell.engine.run import console
from stereocell.model.errors import StereoCellError
from stereocell.model.tiling import Box
from stereocell.read import Dataset
from stereocell.storage.location import Location

_BY_MODALITY = {"MR": "mri", "CT": "ct"}
_BODY_UM = 100.0  # um: a finest spacing from here on is that of a body, and not of a microscope
_PART_UM = 20_000.0  # um: of what is smaller across, presets of patients drop pieces half as large
# of the voxels looked at so many lie this near to air, and 99 % below metal
_AIR_HU, _AIR_SPREAD, _AIR_SHARE, _MAX_HU = -1000.0, 150.0, 0.02, 4000.0
_PLANES = 8  # in the middle, that are looked at for Hounsfield units


def load_for(
    source: str | Path,
    preset: str | None,
    config: Path | None,
    *,
    flags: Mapping[str, Any],
    where: str = "command line",
) -> tuple[Settings, str]:
    """Return the settings of a build, by the preset that suits the source where none is given.

    As `settings.load` otherwise. A file of settings, `config`, leaves no choice. The text is the
    choice with its reason, for `tell`; empty where there was none. A source that can't be read is
    left to whoever reads it next.
    """
    if preset is not None or config is not None:
        return load(preset, config, flags=flags, where=where), ""
    settings = load(None, None, flags=flags, where=where)
    options = settings.plan
    try:
        location = Location.of(source).source
        dataset = open_source(as_asked(location, options))
        chosen, reason = choose_preset(dataset, modality=options.modality)
    except StereoCellError:
        return settings, ""
    return (load(chosen, None, flags=flags, where=where) if chosen else settings), reason


def print_choice(choice: str) -> None:
    """Print the choice of a preset, once the source proved to be one: errors stand alone."""
    if choice:
        console.print(f"plan: {choice}", markup=False)


def choose_preset(dataset: Dataset, *, modality: str = "") -> tuple[str | None, str]:
    """Return the name of a preset, or None for the defaults, and the reason in a sentence.

    modality  the settings', where the input says none
    """
    known = dataset.modality or modality
    level = dataset.levels[0]
    finest = min(level.spacing_um)
    if not known and finest < _BODY_UM:
        return None, _describe(None, f"voxels of {finest:.3g} um, as of a microscope")
    across = max(n * h for n, h in zip(level.shape, level.spacing_um, strict=True))
    if across < _PART_UM:
        return None, _describe(None, f"{across / 1000:.3g} mm across, too small for a patient")
    if known:
        chosen = _BY_MODALITY.get(known)
        return chosen, _describe(chosen, f"the input is {known}")
    chosen = "ct" if _has_hounsfield_units(dataset) else "mri"
    looks = "values like Hounsfield units"
    if chosen == "mri":
        looks = "no Hounsfield units, which a CT that was shifted has not either"
    return chosen, _describe(chosen, f"voxels of {finest / 1000:.3g} mm and {looks}")


def _describe(chosen: str | None, reason: str) -> str:
    if chosen is None:
        return f"no preset: {reason}: lengths follow the voxel spacing (--preset names another)"
    return f"preset {chosen}: {reason} (--preset {NO_PRESET}: the defaults)"


def _has_hounsfield_units(dataset: Dataset) -> bool:
    if dataset.dtype.kind == "u":
        return False
    depth, height, width = dataset.levels[0].shape
    first = max(0, (depth - _PLANES) // 2)
    # planes through the whole: corners alone may be padding, and the middle all body
    middle = Box((first, 0, 0), (min(depth, first + _PLANES), height, width))
    voxels = dataset.read(0, middle).voxels
    is_air = np.abs(voxels - _AIR_HU) <= _AIR_SPREAD
    return float(is_air.mean()) >= _AIR_SHARE and float(np.quantile(voxels, 0.99)) <= _MAX_HU
