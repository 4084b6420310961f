"""The plan's note on a channel's level: the level, "no surface", or that the build finds it."""

from stereocell.isosurface.channel_level import FEW_SHARE
from stereocell.isosurface.level import Level
from stereocell.isosurface.near_levels import ABOVE_BACKGROUND, MARK, find_near_levels, words_of
from stereocell.isosurface.options import APART, CONNECTED, NO_SURFACE
from stereocell.model.channel import LOW_CONFIDENCE
from stereocell.planning.channels import Channel
from stereocell.planning.level_choice import Found, find_doubt, given_level
from stereocell.planning.plan import Plan
from stereocell.planning.survey import TileIso

# A confidence that blocks estimate may lie below the bound by this much and is not called unsure
MARGIN = 0.1
_CHOICES = {
    APART: "the one with the most separate pieces",
    CONNECTED: "the lowest at which vessels get longer and not only thicker",
}


def note_before_reading(plan: Plan, channel: Channel) -> str:
    """Return the note on a channel whose level no voxel is needed for; empty: one has to look."""
    rung = channel.rung or plan.settings.isovalue.rung
    given = given_level(plan, channel)
    if given is not None:
        value, is_above = given
        return f"level {value:.5g}{MARK + ABOVE_BACKGROUND if is_above else ''}, as it is given"
    if rung == NO_SURFACE:
        base = channel.base or channel.name
        return f"no surface is built by default (--surfaces {base}=outer builds one)"
    return f"the build finds the {rung} level" if channel.rung else ""


def note_on_found(plan: Plan, found: Found, *, is_whole: bool) -> str:
    """Return the note on a level that was looked for.

    is_whole  whether all voxels were looked at: else the levels are estimates
    """
    mark, tail = (MARK, ABOVE_BACKGROUND) if found.subtracts else ("", "")
    about, digits = ("", 5) if is_whole else ("about ", 3)
    rungs = [rung for rung in found.rungs if isinstance(rung, Level)]
    if found.is_fixed and found.rungs:
        (rung,) = found.rungs
        value = rung.value if isinstance(rung, Level) else rung
        kind = "the adaptive threshold" if found.window.counting.mask is None else "half-way"
        return f"level {about}{value:.{digits}g}, {kind}"
    if len(rungs) > 1:
        choice = _CHOICES[plan.settings.isovalue.rung]
        return f"the build takes one of {about}{words_of(rungs, mark, digits)}: {choice}{tail}"
    ladder = () if found.levels is None else found.levels.all_levels
    if not rungs:
        near = find_near_levels(ladder, None, is_unsure=False)
        doubt = found.doubt.removeprefix("no clear surface: ")
        text = f"no surface{'' if is_whole else ' in the blocks that were looked at'}: {doubt}"
    else:
        unsure = _doubt(plan, found, is_whole)
        near = find_near_levels(ladder, rungs[0].value, is_unsure=bool(unsure))
        text = f"level {about}{words_of(rungs, mark, digits)}"
        text = f"unsure {text}: {unsure}" if unsure else f"clear {text}"
    beside = f"; near levels: {words_of(near, mark, digits)}" if near else ""
    return f"{text}{beside}{tail}"


def _doubt(plan: Plan, found: Found, is_whole: bool) -> str:
    """Return why a build will call the only level unsure; empty: it will not."""
    (level,) = found.rungs
    assert isinstance(level, Level)
    # in whichever tile they lie, the voxels of one side are too few for it
    is_bare = min(level.share, 1 - level.share) * len(plan.tiles) < FEW_SHARE
    tile = TileIso(level.value, 0.0, None if is_bare else level.confidence, {})
    least = LOW_CONFIDENCE - (0.0 if is_whole else MARGIN)
    doubt = find_doubt(found, 0, [tile])
    if not doubt and level.confidence < least:
        return f"its confidence is {level.confidence:.2f}, expected at least {LOW_CONFIDENCE:g}"
    return doubt
