"""Which level of a channel has its surface: the given one, a rung of the ladder, its threshold."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from stereocell.isosurface.channel_level import ChannelLevels, find_levels
from stereocell.isosurface.level import Level, bodies_in_haze
from stereocell.isosurface.level_evidence import TileEvidence
from stereocell.isosurface.options import (
    ADAPTIVE,
    APART,
    CONNECTED,
    CRITERIA,
    LADDER,
    NO_SURFACE,
    RUNGS,
    IsoValueOptions,
    parse_level,
)
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Tile
from stereocell.planning.channels import Channel
from stereocell.planning.plan import Plan
from stereocell.planning.survey import TileIso
from stereocell.planning.vessel_levels import choose_connected, find_vessel_levels
from stereocell.steps.find_window import Window
from stereocell.transfer.channel_statistics import ChannelStatistics

APART_SHARE = 0.25  # share of all voxels inside: a rung whose largest components hold less has many
# the same where many components may touch: the share, and the least number of components but specks
JOINED_SHARE, MANY = 2 / 3, 30
# Share of all voxels that cells of a cleared tissue fill at least: in a stack whose cells stood at
# 1675, a level of 8384 left .02 % inside
APART_LEAST = 5e-4
APART_MOST = 0.1  # share of all voxels that sparse cells fill at most
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


GROUND_ENDS = (0.05, 0.95)  # quantiles of a background: its dim and its bright side
# The rise of the background, as a share of a level's contrast, from which on the light is uneven
UNEVEN_GROUND = 0.5


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
    find = partial(
        find_levels,
        list(evidence.values()),
        counting=window.counting,
        finest_um=min(plan.spacing_um),
        modality=plan.modality,
        options=options if criterion in CRITERIA else None,
    )
    levels = find(subtracts=None if given is None else given[1])
    wants_cells = (channel.rung or options.rung) == APART and _shows_cells(plan)
    if given is None and wants_cells and not levels.subtracts:
        # cells in dim and in bright tissue have their height above the tissue in common; without
        # sparse ones, a level above it is that of the tissue's own texture
        above = find(subtracts=True)
        has_cells = any(level.share <= APART_MOST for level in above.clear)
        levels = above if has_cells else levels
    mask, half = window.counting.mask, None
    if mask is not None and criterion not in CRITERIA:
        # blurred, a mask has its own edge half-way; peaks of its blur are no levels
        half = levels.judge(sum(mask) / 2)
        levels = replace(levels, all_levels=(half,) if levels.has_both_sides(half.value) else ())
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
    is_outer = options.rung in (APART, CONNECTED) or RUNGS[channel.rung or options.rung] == 0
    if half is not None and criterion == LADDER and is_outer:
        return Found(window, levels, evidence, (half,), False, "", is_fixed=True)
    highest = highest_of(window.statistics, levels.subtracts)
    clear = levels.shown(highest)
    doubt = f"no clear surface: {levels.why_unclear}" if levels.why_unclear else ""
    if criterion == ADAPTIVE and clear:
        threshold = window.statistics.threshold
        if threshold is None:
            nothing = "no clear surface: the channel's histogram has no threshold"
            return Found(window, levels, evidence, (), False, nothing)
        plain = replace(levels, subtracts=False)
        rated = threshold.value if levels.subtracts else levels.judge(threshold.value)
        return Found(window, plain, evidence, (rated,), False, "", is_fixed=True)
    rung = channel.rung or options.rung
    if rung == APART:
        clear = _fit_for_cells(clear, highest) if wants_cells else clear[:1]
    elif rung == CONNECTED:
        clear = find_vessel_levels(levels)
    elif clear:
        place = RUNGS[rung]
        if place >= len(clear):
            doubt = f"no clear surface: {len(clear)} clear levels, none that is the {rung}"
        clear = clear[place : place + 1]
    return Found(window, levels, evidence, clear, levels.subtracts, doubt)


def highest_of(statistics: ChannelStatistics, subtracts: bool) -> float:
    """Return the display window's upper end, in voxel values or above the mean background."""
    under = statistics.background if subtracts else None
    return statistics.window[1] - (0.0 if under is None else float(under.values.mean()))


def find_doubt(found: Found, chosen: int, tiles: Sequence[TileIso]) -> str:
    """Return why a level that the program found cannot be called clear; empty: it can.

    chosen  index into `found.rungs`
    tiles   the level of each tile, with its own confidence
    """
    if found.is_fixed or found.levels is None or not found.rungs:
        return ""
    level = found.rungs[chosen]
    if not isinstance(level, Level):
        return ""
    clear, highest = found.levels.clear, highest_of(found.window.statistics, found.subtracts)
    if level in found.levels.all_levels and level not in clear and clear:
        return (
            f"it falls short of a clear level by a little ({level.why_unclear}), and the next one, "
            f"{clear[0].value:.5g}, leaves {clear[0].share:.3%} of the voxels inside"
        )
    if level.value > highest:
        return f"it lies above the display window, which ends at {highest:.5g}"
    if all(tile.confidence is None for tile in tiles):
        return "no tile by itself has enough voxels on both sides of it"
    if uneven := _uneven_light(found, level):
        return uneven
    if bodies := bodies_in_haze(level, found.levels.all_levels):
        return (
            f"it may be a haze around brighter bodies, whose level, {bodies.value:.5g}, has "
            f"{bodies.contrast / level.contrast:.0f} times its contrast and {bodies.share:.2%} of "
            "the voxels inside"
        )
    return ""


def _uneven_light(found: Found, level: Level) -> str:
    """Return why one level may lose the bodies of a dim side; empty: the ground is even enough.

    A ground that crosses the level is a large body itself, and no light.
    """
    ground = found.window.statistics.background
    if ground is None or found.subtracts:
        return ""
    dim, bright = (float(v) for v in np.quantile(ground.values, GROUND_ENDS))
    if bright >= level.value or bright - dim < UNEVEN_GROUND * level.contrast:
        return ""
    return (
        f"the ground rises from {dim:.5g} to {bright:.5g}, as in uneven light, beside a contrast "
        f"of {level.contrast:.5g}: bodies on the dim side may be missing"
    )


def _shows_cells(plan: Plan) -> bool:
    """Return whether a cell is at least a voxel wide; in coarser voxels there is tissue alone."""
    body_um = plan.settings.surface.body_um
    return not body_um or min(plan.spacing_um) <= body_um


def _fit_for_cells(levels: tuple[Level, ...], highest: float) -> tuple[Level, ...]:
    """Return the levels that cells may lie at: all but specks, and none that no window shows.

    The outermost stays in any case, since it is the surface where there are no cells.
    """
    return levels[:1] + tuple(
        level for level in levels[1:] if level.share >= APART_LEAST and level.value <= highest
    )


def given_level(plan: Plan, channel: Channel) -> tuple[float, bool] | None:
    """Return the iso-value that the user gives for a channel, and whether above the background."""
    if channel.rung:
        if channel.rung in (*RUNGS, NO_SURFACE):
            return None
        return parse_level(f"--surfaces {channel.base or channel.name}", channel.rung)
    given = plan.settings.iso_values.get(channel.name)
    return None if given is None else parse_level(f"--iso-value {channel.name}", given)


def choose_by_components(options: IsoValueOptions, of_rungs: Sequence[Components]) -> int:
    """Return the index of the level that a channel's components speak for.

    of_rungs  the ComponentSums of each tile at each level; one level alone is taken as it is
    """
    if len(of_rungs) < 2:
        return 0
    return choose_connected(of_rungs) if options.rung == CONNECTED else choose_rung(of_rungs)


def choose_rung(of_rungs: Sequence[Components]) -> int:
    """Return the index of the level that has the most components.

    A level counts if its largest components, one a tile, hold less than APART_SHARE of the voxels
    inside. Where cells touch they may hold JOINED_SHARE, if MANY components are of a size with one
    another: the bright parts of a whole brain are a few large pieces among a hundred specks.
    Without such a level the outermost is returned.

    of_rungs  the ComponentSums of each tile at each level, outermost first
    """
    best, most = 0, (0, 0.0)
    for place, components in enumerate(of_rungs):
        # summed over the tiles: a component that fills all of them is the largest in each
        voxels, largest, count, kept = (
            sum(one[key] for one in components.values())
            for key in ("voxels", "largest", "count", "kept")
        )
        share = largest / voxels if voxels else 1.0
        is_apart = share < APART_SHARE or (share < JOINED_SHARE and kept >= MANY)
        if is_apart and (count, -share) > most:
            best, most = place, (count, -share)
    return best


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
    # A tile judges a level among all that lies above it, and the channel among what lies up to the
    # next level: a tile is no surer than its channel.
    sure = None if judged is None else min(judged.confidence, level.confidence)
    return TileIso(value, below, sure, files)
