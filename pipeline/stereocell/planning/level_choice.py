"""Choose the iso-level of a channel: the given one, one that was found, or a threshold."""

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
    LEVEL_NAMES,
    LEVELS,
    NO_SURFACE,
    IsoValueOptions,
    parse_level,
)
from stereocell.model.counted import counted
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Tile
from stereocell.planning.channels import Channel
from stereocell.planning.plan import Plan
from stereocell.planning.survey import TileIso
from stereocell.planning.vessel_levels import choose_connected, find_vessel_levels
from stereocell.steps.find_window import Window
from stereocell.transfer.channel_statistics import ChannelStatistics

# Share of the voxels inside, 0..1: at a level that parts cells, the largest components hold less.
APART_SHARE = 0.25
# Share of the voxels inside, and components without specks: where cells touch, the largest
# components may hold this share if there are at least this many components.
JOINED_SHARE, MANY = 2 / 3, 30
# Least share of all voxels that cells of cleared tissue fill. Tuned on a stack with cells at 1675,
# where a wrong level of 8384 left 0.02 % inside.
APART_LEAST = 5e-4
APART_MOST = 0.1  # largest share of all voxels that sparse cells fill
Components = dict[str, Mapping[str, Any]]  # ComponentSums by tile ID


@dataclass(frozen=True, slots=True)
class Found:
    """The levels of a channel, as they are known before its components are counted.

    window      the channel's window
    levels      all levels that its tiles show together; None: there is no evidence
    evidence    evidence of each tile, by tile ID; empty for shares of tissue, whose level is known
    candidates  levels that may have the surface: the given one, or clear ones. The first is taken
                unless the components favour another
    subtracts   whether the levels count from the background
    reason      why there is no surface; empty: there is one
    is_fixed    whether all tiles have the same level, because it is given or the channel is a mask
    is_given    whether the settings state the level, so that it is certain (300 HU for bone)
    """

    window: Window
    levels: ChannelLevels | None
    evidence: Mapping[str, TileEvidence]
    candidates: tuple[Level | float, ...]
    subtracts: bool
    reason: str
    is_fixed: bool = False
    is_given: bool = False

    @property
    def background(self) -> LatticeField | None:
        """The background that is subtracted, voxel values."""
        return self.window.statistics.background if self.subtracts else None


GROUND_ENDS = (0.05, 0.95)  # quantiles of a background that stand for its dim and bright side
# Share of a level's contrast: if the background rises by more across the volume, light is uneven.
UNEVEN_GROUND = 0.5


def find_level(
    plan: Plan, channel: Channel, window: Window, evidence: Mapping[str, TileEvidence]
) -> Found:
    """Return a channel's levels.

    evidence  evidence by tile ID; empty for shares of tissue
    """
    given = given_level(plan, channel)
    if not evidence:
        assert given is not None
        return Found(window, None, {}, (given[0],), given[1], "", is_fixed=True, is_given=True)
    options = plan.settings.isovalue
    wanted = channel.level or options.level
    criterion = LEVELS if channel.level else options.criterion
    find = partial(
        find_levels,
        list(evidence.values()),
        counting=window.counting,
        finest_um=min(plan.spacing_um),
        modality=plan.modality,
        options=options if criterion in CRITERIA else None,
    )
    levels = find(subtracts=None if given is None else given[1])
    wants_cells = wanted == APART and _shows_cells(plan)
    if given is None and wants_cells and not levels.subtracts:
        # Cells in dim and in bright tissue rise equally far above the tissue. If nothing sparse
        # rises above the tissue, a level above it would only show the tissue's own texture.
        above = find(subtracts=True)
        has_cells = any(level.share <= APART_MOST for level in above.clear)
        levels = above if has_cells else levels
    mask, half = window.counting.mask, None
    if mask is not None and criterion not in CRITERIA:
        # A blurred mask has its edge half-way. Other peaks come from the blur and are not levels.
        half = levels.judge(sum(mask) / 2)
        levels = replace(levels, all_levels=(half,) if levels.has_both_sides(half.value) else ())
    if given is not None:
        value, subtracts = given
        # A level above the background can only be judged if the background was subtracted.
        rated = levels.judge(value) if subtracts == levels.subtracts else value
        return Found(
            window, levels, evidence, (rated,), subtracts, "", is_fixed=True, is_given=True
        )
    if wanted == NO_SURFACE:
        reason = f"no surface is built by default (--surfaces {channel.name}=outer builds one)"
        return Found(window, levels, evidence, (), levels.subtracts, reason)
    is_outer = options.level in (APART, CONNECTED) or LEVEL_NAMES[wanted] == 0
    if half is not None and criterion == LEVELS and is_outer:
        return Found(window, levels, evidence, (half,), False, "", is_fixed=True)
    highest = highest_of(window.statistics, levels.subtracts)
    clear = levels.shown(highest)
    reason = f"no clear surface: {levels.why_unclear}" if levels.why_unclear else ""
    if criterion == ADAPTIVE and clear:
        threshold = window.statistics.threshold
        if threshold is None:
            missing = "no clear surface: the channel's histogram has no threshold"
            return Found(window, levels, evidence, (), False, missing)
        plain = replace(levels, subtracts=False)
        rated = threshold.value if levels.subtracts else levels.judge(threshold.value)
        return Found(window, plain, evidence, (rated,), False, "", is_fixed=True)
    if wanted == APART:
        clear = _fit_for_cells(clear, highest) if wants_cells else clear[:1]
    elif wanted == CONNECTED:
        clear = find_vessel_levels(levels)
    elif clear:
        place = LEVEL_NAMES[wanted]
        if place >= len(clear):
            reason = (
                f"no clear surface: found {counted(len(clear), 'clear iso-value')}, and no "
                f"{wanted} one"
            )
        clear = clear[place : place + 1]
    return Found(window, levels, evidence, clear, levels.subtracts, reason)


def highest_of(statistics: ChannelStatistics, subtracts: bool) -> float:
    """Return the upper end of the display window.

    subtracts  whether it counts from the mean background; otherwise it is a voxel value
    """
    under = statistics.background if subtracts else None
    return statistics.window[1] - (0.0 if under is None else float(under.values.mean()))


def explain_uncertainty(found: Found, chosen: int, tiles: Sequence[TileIso]) -> str:
    """Return why a level that the program found is not clear; empty: it is clear.

    chosen  index into `found.candidates`
    tiles   the level of each tile, with the tile's own confidence
    """
    if found.is_fixed or found.levels is None or not found.candidates:
        return ""
    level = found.candidates[chosen]
    if not isinstance(level, Level):
        return ""
    clear, highest = found.levels.clear, highest_of(found.window.statistics, found.subtracts)
    if level in found.levels.all_levels and level not in clear and clear:
        return (
            f"the iso-value is nearly clear ({level.why_unclear}), but the next clear one, "
            f"{clear[0].value:.5g}, leaves only {clear[0].share:.3%} of the voxels inside"
        )
    if level.value > highest:
        return f"the iso-value lies above the display window, which ends at {highest:.5g}"
    if all(tile.confidence is None for tile in tiles):
        return "no tile by itself has enough voxels on both sides of the iso-value"
    if uneven := _uneven_light(found, level):
        return uneven
    if bodies := bodies_in_haze(level, found.levels.all_levels):
        return (
            "the surface may enclose a haze around brighter structures: their iso-value, "
            f"{bodies.value:.5g}, has {bodies.contrast / level.contrast:.0f} times the contrast "
            f"and {bodies.share:.2%} of the voxels inside"
        )
    return ""


def _uneven_light(found: Found, level: Level) -> str:
    """Return why one level may miss structures on a dim side; empty: the background is even.

    A background that reaches the level is a large structure itself and does not show uneven light.
    """
    ground = found.window.statistics.background
    if ground is None or found.subtracts:
        return ""
    dim, bright = (float(v) for v in np.quantile(ground.values, GROUND_ENDS))
    if bright >= level.value or bright - dim < UNEVEN_GROUND * level.contrast:
        return ""
    return (
        f"the background rises from {dim:.5g} to {bright:.5g}, as in uneven light, and the "
        f"contrast is {level.contrast:.5g}: structures on the dim side may be missing"
    )


def _shows_cells(plan: Plan) -> bool:
    """Return whether a cell is at least one voxel wide; coarser voxels only show tissue."""
    body_um = plan.settings.surface.body_um
    return not body_um or min(plan.spacing_um) <= body_um


def _fit_for_cells(levels: tuple[Level, ...], highest: float) -> tuple[Level, ...]:
    """Return the levels that may show cells: within the window, and with more inside than specks.

    The outermost level is always among them, because it is the surface if there are no cells.
    """
    return levels[:1] + tuple(
        level for level in levels[1:] if level.share >= APART_LEAST and level.value <= highest
    )


def given_level(plan: Plan, channel: Channel) -> tuple[float, bool] | None:
    """Return a channel's iso-value in the settings, and whether it counts from the background.

    None: the settings state no value.
    """
    if channel.level:
        if channel.level in (*LEVEL_NAMES, NO_SURFACE):
            return None
        return parse_level(f"--surfaces {channel.base or channel.name}", channel.level)
    given = plan.settings.iso_values.get(channel.name)
    return None if given is None else parse_level(f"--iso-value {channel.name}", given)


def choose_by_components(options: IsoValueOptions, by_level: Sequence[Components]) -> int:
    """Return the index of the iso-level whose connected components fit a choice of `options` best.

    by_level  the ComponentSums of each tile, for each level; a single level is returned unjudged
    """
    if len(by_level) < 2:
        return 0
    return choose_connected(by_level) if options.level == CONNECTED else choose_apart(by_level)


def choose_apart(by_level: Sequence[Components]) -> int:
    """Return the index of the level with the most components among those that part cells.

    A level parts cells if its largest components, one of each tile, hold less than APART_SHARE of
    the voxels inside. Where cells touch, they may hold up to JOINED_SHARE if there are MANY
    components without specks. The bright parts of a whole brain fail this: they are a few large
    pieces among a hundred specks. If no level parts cells, the outermost is returned.

    by_level  the ComponentSums of each tile, for each level, outermost first
    """
    best, most = 0, (0, 0.0)
    for place, components in enumerate(by_level):
        # The largest are summed over the tiles, since one component may be the largest in each.
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
    """Return the channel's levels, without a surface if all voxels lie on one side of the level.

    components  the ComponentSums of each tile at the chosen level
    """
    if not found.candidates or not components:
        return found
    inside = sum(one["voxels"] for one in components.values())
    if 0 < inside < sum(math.prod(tile.box.shape) for tile in plan.tiles):
        return found
    return _without_surface(found, "above" if inside else "below")


def check_histogram(found: Found) -> Found:
    """Return the channel's levels, without a surface if the whole histogram lies on one side.

    This is `check_components` before the components are counted. Its answer is exact except for a
    few hot voxels.
    """
    if not found.is_fixed or not found.candidates or found.levels is None:
        return found
    value = _value_of(found.candidates[0])
    if found.subtracts != found.levels.subtracts or found.levels.has_both_sides(value):
        return found
    return _without_surface(
        found, "above" if found.levels.histogram.above(value).total else "below"
    )


def _without_surface(found: Found, side: str) -> Found:
    above = " above the background" if found.subtracts else ""
    level = _value_of(found.candidates[0])
    reason = f"no surface: all voxels lie {side} the iso-value {level:.5g}{above}"
    return replace(found, candidates=(), reason=reason)


def _value_of(level: Level | float) -> float:
    return level.value if isinstance(level, Level) else level


def level_of_tile(
    plan: Plan, tile: Tile, found: Found, chosen: int, files: dict[str, str]
) -> TileIso:
    """Return the level of one tile, and the files it came from.

    plan    its setting `isovalue.scope` says whether each tile has a level of its own
    found   the channel's levels
    chosen  index of the channel's level in `found.candidates`
    files   files of the tile's results, relative to OUT, by kind of result
    """
    if not found.candidates:
        return TileIso(None, 0.0, None, files)
    level, below = found.candidates[chosen], 0.0
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
    # A tile gets at most its channel's confidence. The tile's own may be too high: it compares the
    # level with all voxels above it, the channel's only with voxels up to the next level.
    sure = None if judged is None else min(judged.confidence, level.confidence)
    return TileIso(value, below, sure, files)
