"""The levels that a channel's surface could lie at instead, each with the setting that takes it."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass

from stereocell.isosurface.level import Level, shown_of
from stereocell.isosurface.options import ADAPTIVE, RUNGS
from stereocell.planning.channels import Channel
from stereocell.planning.level_choice import given_level
from stereocell.planning.plan import Plan

MAX_TOLD = 3
LIKELY = 0.2  # confidence from which a doubtful rung goes before a level that was only moved
# Shares of the contrast by which a level is moved where the ladder has no other
_ASIDE = {"a little lower": -0.25, "a little higher": 0.25, "lower": -0.4, "higher": 0.4}
_ALIKE = 0.03  # share of the contrast: levels nearer to one another are one


@dataclass(frozen=True, slots=True)
class OtherLevel:
    """One level.

    name        what it is: `inner`, `adaptive`, `a little lower`
    value       of the denoised voxels, or of those above the background
    above       whether it counts from the background
    setting     the flag that takes it
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
    ladder: Sequence[Level],
    *,
    subtracts: bool,
    taken: float | None,
    threshold: float | None,
    ends: tuple[float, float] | None,
    highest: float,
) -> list[OtherLevel]:
    """Return the next-best levels, at most MAX_TOLD, best first; none where there is no ladder.

    ladder     all levels that were found; `subtracts`: above the background
    taken      the surface's level; None: there is no surface
    threshold  the adaptive one, voxel value; None: there is none
    highest    the display window's upper end; see `shown_of`
    ends       of the values that the ladder was found in: beyond them a level parts nothing

    First the ladder's other rungs, clear ones before doubtful ones, then the adaptive threshold,
    then levels a little lower and higher; last the rungs that hardly anything speaks for.
    """
    if not ladder:
        return []
    # a channel that has no surface has no rung that could be named
    clear = () if taken is None else shown_of(ladder, highest)
    named, doubtful = _rungs(plan, channel, ladder, clear, subtracts)
    likely = [level for level in doubtful if (level.confidence or 0.0) >= LIKELY]
    levels = [*named, *likely]
    if threshold is not None and plan.settings.isovalue.criterion != ADAPTIVE:
        # by its value, since the criterion is that of all channels
        flag = take(plan, channel, threshold, above=False)
        levels.append(OtherLevel(ADAPTIVE, threshold, False, flag, None))
    levels += _aside(plan, channel, ladder, taken, subtracts)
    levels += [level for level in doubtful if level not in likely]
    contrast = max(level.contrast for level in ladder)
    chosen: list[OtherLevel] = []
    for level in levels:
        if ends and level.above == subtracts and not ends[0] < level.value < ends[1]:
            continue
        near = [one.value for one in chosen if one.above == level.above]
        if taken is not None and level.above == subtracts:
            near.append(taken)
        if all(abs(level.value - value) > _ALIKE * contrast for value in near):
            chosen.append(level)
    return chosen[:MAX_TOLD]


def ends_of(values: Sequence[float]) -> tuple[float, float] | None:
    """Return the least and the largest of a channel's values, rising; None without any."""
    return (values[0], values[-1]) if len(values) > 1 else None


def take(plan: Plan, channel: Channel, value: float, *, above: bool) -> str:
    """Return the flag that takes a level; `--surfaces` goes before `--iso-value` where both are."""
    level = f"{value:.5g}{'+b' if above else ''}"
    if channel.rung:
        return _surfaces(plan, channel, level)
    return "--iso-value " + shlex.quote(f"{channel.name}={level}")


def _surfaces(plan: Plan, channel: Channel, rung: str) -> str:
    """Return the flag that builds another surface in place of the channel's, beside its others."""
    base = channel.base or channel.name
    rungs = [
        rung if one == channel else one.rung
        for one in plan.channels
        if one == channel or (channel.base and one.base == base)
    ]
    return "--surfaces " + shlex.quote(f"{base}={','.join(rungs)}")


def _rungs(
    plan: Plan,
    channel: Channel,
    ladder: Sequence[Level],
    clear: Sequence[Level],
    subtracts: bool,
) -> tuple[list[OtherLevel], list[OtherLevel]]:
    """Return the clear rungs by their names, and the doubtful ones, best first.

    Surfaces that are built already are no others. Where the level is given, or each tile's own, a
    rung's name would take another level than the one here: it is taken by its value.
    """
    by_name = given_level(plan, channel) is None and plan.settings.isovalue.scope == "channel"
    built = {one.rung for one in plan.channels if channel.base and one.base == channel.base}
    doubtful = [level for level in ladder if level not in clear]
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
        for name, place in RUNGS.items()
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


def _aside(
    plan: Plan, channel: Channel, ladder: Sequence[Level], taken: float | None, subtracts: bool
) -> list[OtherLevel]:
    if taken is None:
        rung = max(ladder, key=lambda level: level.confidence)
    else:  # the one that it is, or that is nearest to it
        rung = min(ladder, key=lambda level: abs(level.value - taken))
    start = rung.value if taken is None else taken
    return [
        OtherLevel(name, value, subtracts, take(plan, channel, value, above=subtracts), None)
        for name, share in _ASIDE.items()
        for value in [start + share * rung.contrast]
    ]
