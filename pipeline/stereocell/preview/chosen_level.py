"""Choose the iso-value that a build would use in a tile, and report whether it would be unsure."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.isosurface.level import Level
from stereocell.isosurface.options import CONNECTED
from stereocell.isosurface.repair_rules import sum_components
from stereocell.model.channel import LOW_CONFIDENCE
from stereocell.model.tiling import Tile
from stereocell.planning.level_choice import (
    Components,
    Found,
    choose_by_components,
    explain_uncertainty,
    level_of_tile,
)
from stereocell.planning.plan import Plan


@dataclass(frozen=True, slots=True)
class Chosen:
    """The iso-value that a build would use.

    value       iso-value, in voxel values; None if there is no surface
    confidence  confidence of the channel, 0..1; None if not rated, as when the settings state it
    unsure      reason why the iso-value is not clear; empty if it is clear
    """

    value: float | None
    confidence: float | None = None
    unsure: str = ""


def choose_level(
    plan: Plan,
    found: Found,
    tiles: Sequence[Tile],
    *,
    tile: Tile,
    field: NDArray[np.float32],
) -> Chosen:
    """Return the iso-value that a build would use if all tiles were like this one.

    tiles  the tiles whose voxels gave the candidates in `found`
    field  float32 (z, y, x), denoised voxels of `tile`; minus the background if `found` subtracts
    """
    if not found.candidates:
        return Chosen(None)
    place = _index_of_level(plan, found, field)
    level = found.candidates[place]
    if found.levels is None or not isinstance(level, Level):
        return Chosen(level.value if isinstance(level, Level) else level)
    if found.is_given:
        return Chosen(level.value)
    unsure = explain_uncertainty(
        found, place, [level_of_tile(plan, one, found, place, {}) for one in tiles]
    )
    if not unsure and level.confidence < LOW_CONFIDENCE:
        unsure = f"below a confidence of {LOW_CONFIDENCE:g} about half of such surfaces are right"
    value = level.value
    if plan.settings.isovalue.scope == "tile" and not found.is_fixed:
        value = found.levels.level_of_tile(level, found.evidence[tile.id])
    return Chosen(value, level.confidence, unsure)


def _index_of_level(plan: Plan, found: Found, field: NDArray[np.float32]) -> int:
    """Return the index in `found.candidates` of the level that one tile's components favour."""
    least = float(plan.settings.surface.min_diagonal_um)
    values = [level.value for level in found.candidates if isinstance(level, Level)]
    compares = plan.settings.isovalue.level == CONNECTED
    components: list[Components] = []
    for place, value in enumerate(values if len(values) > 1 else []):
        higher = field > values[place - 1] if compares and place else None
        sums = sum_components(field > value, plan.spacing_um, least, higher=higher)
        components.append({"": asdict(sums)})
    return choose_by_components(plan.settings.isovalue, components)
