"""Write the plan's note on a channel's iso-level, or on how the build will find it."""

from stereocell.isosurface.channel_level import FEW_SHARE
from stereocell.isosurface.level import Level
from stereocell.isosurface.near_levels import ABOVE_BACKGROUND, MARK, find_near_levels, words_of
from stereocell.isosurface.options import APART, CONNECTED, NO_SURFACE
from stereocell.model.channel import LOW_CONFIDENCE
from stereocell.planning.channels import Channel
from stereocell.planning.level_choice import Found, explain_uncertainty, given_level
from stereocell.planning.plan import Plan
from stereocell.planning.survey import TileIso

# Confidence by which a level that was estimated in blocks may lie below LOW_CONFIDENCE before the
# note calls it unsure, since blocks estimate it coarsely.
MARGIN = 0.1
_CHOICES = {
    APART: "the one with the most separate pieces",
    CONNECTED: "the lowest at which vessels get longer and not only thicker",
}


def note_before_reading(plan: Plan, channel: Channel) -> str:
    """Return the note on a channel whose level is known without voxels; empty: it is not."""
    wanted = channel.level or plan.settings.isovalue.level
    given = given_level(plan, channel)
    if given is not None:
        value, is_above = given
        mark_given = MARK + ABOVE_BACKGROUND if is_above else ""
        return f"iso-value {value:.5g}{mark_given}, from the settings"
    if wanted == NO_SURFACE:
        base = channel.base or channel.name
        return f"no surface is built by default (--surfaces {base}=outer builds one)"
    return f"the build finds the {wanted} iso-value" if channel.level else ""


def note_on_found(plan: Plan, found: Found, *, is_whole: bool) -> str:
    """Return the note on the levels that were found.

    is_whole  whether all voxels were read; otherwise the levels are estimates
    """
    mark, tail = (MARK, ABOVE_BACKGROUND) if found.subtracts else ("", "")
    about, digits = ("", 5) if is_whole else ("about ", 3)
    levels = [level for level in found.candidates if isinstance(level, Level)]
    if found.is_fixed and found.candidates:
        (level,) = found.candidates
        value = level.value if isinstance(level, Level) else level
        kind = "the adaptive threshold"
        if found.window.counting.mask is not None:
            kind = "half-way between the two values of a mask"
        return f"iso-value {about}{value:.{digits}g}, {kind}"
    if len(levels) > 1:
        choice = _CHOICES[plan.settings.isovalue.level]
        return f"the build takes one of {about}{words_of(levels, mark, digits)}: {choice}{tail}"
    all_levels = () if found.levels is None else found.levels.all_levels
    if not levels:
        near = find_near_levels(all_levels, None, is_unsure=False)
        reason = found.reason.removeprefix("no clear surface: ")
        text = f"no surface{'' if is_whole else ' in the blocks that were read'}: {reason}"
    else:
        unsure = _explain_uncertainty(plan, found, is_whole)
        near = find_near_levels(all_levels, levels[0].value, is_unsure=bool(unsure))
        text = f"iso-value {about}{words_of(levels, mark, digits)}"
        text = f"unsure {text}: {unsure}" if unsure else f"clear {text}"
    beside = f"; near iso-values: {words_of(near, mark, digits)}" if near else ""
    return f"{text}{beside}{tail}"


def _explain_uncertainty(plan: Plan, found: Found, is_whole: bool) -> str:
    """Return why a build will call the only level unsure; empty: it will not."""
    (level,) = found.candidates
    assert isinstance(level, Level)
    # even if one tile held all voxels of the smaller side, they would be too few
    is_bare = min(level.share, 1 - level.share) * len(plan.tiles) < FEW_SHARE
    tile = TileIso(level.value, 0.0, None if is_bare else level.confidence, {})
    least = LOW_CONFIDENCE - (0.0 if is_whole else MARGIN)
    reason = explain_uncertainty(found, 0, [tile])
    if not reason and level.confidence < least:
        return f"its confidence is {level.confidence:.2f}, expected at least {LOW_CONFIDENCE:g}"
    return reason
