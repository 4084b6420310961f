"""Find other iso-levels at which a surface could lie, each with the flag that chooses it."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass

from stereocell.isosurface.level import Level, shown_of
from stereocell.isosurface.options import ADAPTIVE, LEVEL_NAMES
from stereocell.planning.channels import Channel
from stereocell.planning.level_choice import given_level
from stereocell.planning.plan import Plan

MAX_SHOWN = 3  # most other levels that are shown
LIKELY = 0.2  # confidence; a doubtful level that has more is shown before a shifted level
# Shifts of a level that are offered besides the found levels, as shares of its contrast.
_SHIFTS = {"a little lower": -0.25, "a little higher": 0.25, "lower": -0.4, "higher": 0.4}
_ALIKE = 0.03  # share of the contrast; levels nearer to each other count as the same


@dataclass(frozen=True, slots=True)
class OtherLevel:
    """Another level of a channel.

    name        for example `inner`, `adaptive` or `a little lower`
    value       voxel value after denoising; see `above`
    above       whether `value` counts from the background
    setting     the flag that chooses this level
    confidence  0..1; None: not judged
    """

    name: str
    value: float
    above: bool
    setting: str
    confidence: float | None


def find_other_levels(
    plan: Plan,
    channel: Channel,
    all_levels: Sequence[Level],
    *,
    subtracts: bool,
    taken: float | None,
    threshold: float | None,
    ends: tuple[float, float] | None,
    highest: float,
) -> list[OtherLevel]:
    """Return the next-best levels, at most MAX_SHOWN, best first; empty if no levels were found.

    all_levels all levels that were found, outermost first
    subtracts  whether they count from the background
    taken      the surface's level; None: there is no surface
    threshold  the adaptive threshold, voxel value; None: there is none
    highest    the display window's upper end; see `shown_of`
    ends       least and largest value of the histogram; a level beyond them encloses nothing or
               everything

    The order is: found levels, clear ones first; the adaptive threshold; shifted levels; found
    levels with little confidence.
    """
    if not all_levels:
        return []
    # without a surface, no level can be chosen by its name
    clear = () if taken is None else shown_of(all_levels, highest)
    named, doubtful = _found_levels(plan, channel, all_levels, clear, subtracts)
    likely = [level for level in doubtful if (level.confidence or 0.0) >= LIKELY]
    levels = [*named, *likely]
    if threshold is not None and plan.settings.isovalue.criterion != ADAPTIVE:
        # by value, because the setting `criterion` applies to all channels
        flag = take(plan, channel, threshold, above=False)
        levels.append(OtherLevel(ADAPTIVE, threshold, False, flag, None))
    levels += _shifted(plan, channel, all_levels, taken, subtracts)
    levels += [level for level in doubtful if level not in likely]
    contrast = max(level.contrast for level in all_levels)
    chosen: list[OtherLevel] = []
    for level in levels:
        if ends and level.above == subtracts and not ends[0] < level.value < ends[1]:
            continue
        near = [one.value for one in chosen if one.above == level.above]
        if taken is not None and level.above == subtracts:
            near.append(taken)
        if all(abs(level.value - value) > _ALIKE * contrast for value in near):
            chosen.append(level)
    return chosen[:MAX_SHOWN]


def ends_of(values: Sequence[float]) -> tuple[float, float] | None:
    """Return the first and last of a channel's ascending values; None: there are fewer than two."""
    return (values[0], values[-1]) if len(values) > 1 else None


def take(plan: Plan, channel: Channel, value: float, *, above: bool) -> str:
    """Return the flag that chooses a level: --surfaces if the channel has it, else --iso-value."""
    level = f"{value:.5g}{'+b' if above else ''}"
    if channel.level:
        return _surfaces(plan, channel, level)
    return "--iso-value " + shlex.quote(f"{channel.name}={level}")


def _surfaces(plan: Plan, channel: Channel, surface: str) -> str:
    """Return the flag that replaces this surface of a source channel and keeps its others."""
    base = channel.base or channel.name
    surfaces = [
        surface if one == channel else one.level
        for one in plan.channels
        if one == channel or (channel.base and one.base == base)
    ]
    return "--surfaces " + shlex.quote(f"{base}={','.join(surfaces)}")


def _found_levels(
    plan: Plan,
    channel: Channel,
    all_levels: Sequence[Level],
    clear: Sequence[Level],
    subtracts: bool,
) -> tuple[list[OtherLevel], list[OtherLevel]]:
    """Return the clear levels by name, and the doubtful ones, best first.

    Levels of surfaces that are built already are left out. A level is chosen by its value if its
    name would choose another one: if the settings state the level, or each tile has its own.
    """
    by_name = given_level(plan, channel) is None and plan.settings.isovalue.scope == "channel"
    built = {one.level for one in plan.channels if channel.base and one.base == channel.base}
    doubtful = [level for level in all_levels if level not in clear]
    named = [
        OtherLevel(
            name,
            clear[place].value,
            subtracts,
            _surfaces(plan, channel, name)
            if by_name
            else take(plan, channel, clear[place].value, above=subtracts),
            clear[place].confidence,
        )
        for name, place in LEVEL_NAMES.items()
        if place < len(clear) and name not in built
    ]
    doubtful.sort(key=lambda level: -level.confidence)
    return named, [
        OtherLevel(
            "doubtful",
            level.value,
            subtracts,
            take(plan, channel, level.value, above=subtracts),
            level.confidence,
        )
        for level in doubtful
    ]


def _shifted(
    plan: Plan, channel: Channel, all_levels: Sequence[Level], taken: float | None, subtracts: bool
) -> list[OtherLevel]:
    if taken is None:
        nearest = max(all_levels, key=lambda level: level.confidence)
    else:
        nearest = min(all_levels, key=lambda level: abs(level.value - taken))
    start = nearest.value if taken is None else taken
    return [
        OtherLevel(name, value, subtracts, take(plan, channel, value, above=subtracts), None)
        for name, share in _SHIFTS.items()
        for value in [start + share * nearest.contrast]
    ]
