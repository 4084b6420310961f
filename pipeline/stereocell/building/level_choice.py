"""Which level of a channel has its surface: the given one, a rung of the ladder, its threshold."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stereocell.building.channels import Channel
from stereocell.building.plan import Plan
from stereocell.building.survey_file import TileIso
from stereocell.building.tasks.window import Window
from stereocell.isosurface.channel_level import ChannelLevels, find_levels
from stereocell.isosurface.level import Level
from stereocell.isosurface.level_evidence import TileEvidence
from stereocell.isosurface.options import (
    ADAPTIVE,
    APART,
    CRITERIA,
    LADDER,
    NO_SURFACE,
    RUNGS,
    parse_level,
)
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Tile

APART_SHARE = 0.25  # share of all voxels inside: a rung whose largest components hold less has many
# the same where many components may touch: the share, and the least number of components
JOINED_SHARE, MANY = 2 / 3, 30
Components = dict[str, Mapping[str, Any]]  # ComponentSums by tile ID


@dataclass(frozen=True, slots=True)
class Found:
    """What is known of a channel's level before its components are.

    window    of the channel
    levels    what its tiles add up to; None where there is no evidence
    evidence  each tile's; empty for shares of tissue, whose level is known
    rungs     the levels that may have the surface: the given one, or clear ones; the first is
              taken, unless its components speak against it
    doubt     why there is none
    is_fixed  whether all tiles have the same level, whatever they hold: a given one, or a mask's
    is_given  whether the settings state the level: a standard, as 300 HU for bone, and no guess
    """

    window: Window
    levels: ChannelLevels | None
    evidence: Mapping[str, TileEvidence]
    rungs: tuple[Level | float, ...]
    subtracts: bool
    doubt: str
    is_fixed: bool = False
    is_given: bool = False

    @property
    def background(self) -> LatticeField | None:
        """The background that is subtracted, voxel values."""
        return self.window.statistics.background if self.subtracts else None


def find_level(
    plan: Plan, channel: Channel, window: Window, evidence: Mapping[str, TileEvidence]
) -> Found:
    """Return a channel's level; `evidence` by tile ID, empty where there is none."""
    given = given_level(plan, channel)
    if not evidence:
        assert given is not None
        return Found(window, None, {}, (given[0],), given[1], "", is_fixed=True, is_given=True)
    options = plan.settings.isovalue
    criterion = LADDER if channel.rung else options.criterion
    levels = find_levels(
        list(evidence.values()),
        counting=window.counting,
        finest_um=min(plan.spacing_um),
        modality=plan.modality,
        options=options if criterion in CRITERIA else None,
        subtracts=None if given is None else given[1],
    )
    mask, half = window.counting.mask, None
    if mask is not None and criterion not in CRITERIA:
        # blurred, a mask has its own edge half-way; peaks of its blur are no levels
        half = levels.judge(sum(mask) / 2)
        levels = replace(levels, ladder=(half,) if levels.has_both_sides(half.value) else ())
    if given is not None:
        value, subtracts = given
        # where there is no background to be above, nothing can be said of such a level
        rated = levels.judge(value) if subtracts == levels.subtracts else value
        return Found(
            window, levels, evidence, (rated,), subtracts, "", is_fixed=True, is_given=True
        )
    if (channel.rung or options.rung) == NO_SURFACE:
        reason = f"no surface is built by default (--surfaces {channel.name}=outer builds one)"
        return Found(window, levels, evidence, (), levels.subtracts, reason)
    is_outer = options.rung == APART or RUNGS[channel.rung or options.rung] == 0
    if half is not None and criterion == LADDER and is_outer:
        return Found(window, levels, evidence, (half,), False, "", is_fixed=True)
    clear = levels.clear
    doubt = f"no clear surface: {levels.doubt}" if levels.doubt else ""
    if criterion == ADAPTIVE and clear:
        threshold = window.statistics.threshold
        if threshold is None:
            nothing = "no clear surface: the channel's histogram has no threshold"
            return Found(window, levels, evidence, (), False, nothing)
        plain = replace(levels, subtracts=False)
        rated = threshold.value if levels.subtracts else levels.judge(threshold.value)
        return Found(window, plain, evidence, (rated,), False, "", is_fixed=True)
    rung = channel.rung or options.rung
    if clear and rung != APART:
        place = RUNGS[rung]
        if place >= len(clear):
            doubt = f"no clear surface: {len(clear)} clear levels, none that is the {rung}"
        clear = clear[place : place + 1]
    return Found(window, levels, evidence, clear, levels.subtracts, doubt)


def given_level(plan: Plan, channel: Channel) -> tuple[float, bool] | None:
    """Return the iso-value that the user gives for a channel, and whether above the background."""
    if channel.rung:
        if channel.rung in (*RUNGS, NO_SURFACE):
            return None
        return parse_level(f"--surfaces {channel.base or channel.name}", channel.rung)
    given = plan.settings.iso_values.get(channel.name)
    return None if given is None else parse_level(f"--iso-value {channel.name}", given)


def choose_rung(of_rungs: Sequence[Components]) -> int:
    """Return the first rung whose components are many.

    Where none has many, cells that touch are joined at every level: then the rung whose largest
    components hold the least, if that is under JOINED_SHARE and there are MANY; else the outermost.

    of_rungs  the ComponentSums of each tile at each rung, outermost first
    """
    shares: list[float] = []
    for components in of_rungs:
        # over the tiles: what fills all of them is the largest in each
        voxels, largest, count = (
            sum(one[key] for one in components.values()) for key in ("voxels", "largest", "count")
        )
        if largest < APART_SHARE * voxels:
            return len(shares)
        shares.append(largest / voxels if voxels and count >= MANY else 1.0)
    best = int(np.argmin(shares)) if shares else 0
    return best if shares and shares[best] < JOINED_SHARE else 0


def check_components(plan: Plan, found: Found, components: Components) -> Found:
    """Return what is known of a level with its components: one that parts nothing has no surface.

    components  the ComponentSums of each tile at the level that is taken
    """
    if not found.rungs or not components:
        return found
    inside = sum(one["voxels"] for one in components.values())
    if 0 < inside < sum(math.prod(tile.box.shape) for tile in plan.tiles):
        return found
    return _without_surface(found, "above" if inside else "below")


def check_histogram(found: Found) -> Found:
    """Return the same before there are components: exact but for a few hot voxels."""
    if not found.is_fixed or not found.rungs or found.levels is None:
        return found
    value = _value_of(found.rungs[0])
    if found.subtracts != found.levels.subtracts or found.levels.has_both_sides(value):
        return found
    return _without_surface(
        found, "above" if found.levels.histogram.above(value).total else "below"
    )


def _without_surface(found: Found, side: str) -> Found:
    above = " above the background" if found.subtracts else ""
    reason = f"no surface: all voxels lie {side} the level {_value_of(found.rungs[0]):.5g}{above}"
    return replace(found, rungs=(), doubt=reason)


def _value_of(level: Level | float) -> float:
    return level.value if isinstance(level, Level) else level


def level_of_tile(
    plan: Plan, tile: Tile, found: Found, chosen: int, files: dict[str, str]
) -> TileIso:
    """Return the level of one tile at the rung chosen for its channel, with the files it came from.

    plan    its setting `isovalue.scope` says whether each tile has a level of its own
    found   what the survey found of the channel
    chosen  index into `found.rungs`
    files   the tile's own results, relative to OUT, by what they hold
    """
    if not found.rungs:
        return TileIso(None, 0.0, None, files)
    level, below = found.rungs[chosen], 0.0
    if found.background is not None:
        under = np.broadcast_to(found.background.at(tile.box), tile.box.shape)
        below = float(np.mean(under, dtype=np.float64))
    if found.levels is None or not isinstance(level, Level):
        return TileIso(_value_of(level), below, None, files)
    tile_evidence, value = found.evidence[tile.id], level.value
    if found.is_given:
        return TileIso(value, below, None, files)
    judged = found.levels.judge_tile(level, tile_evidence)
    if plan.settings.isovalue.scope == "tile" and not found.is_fixed:
        value = found.levels.level_of_tile(level, tile_evidence)
    return TileIso(value, below, None if judged is None else judged.confidence, files)
