"""The three sentences that open the report: what was built, how sure it is, where to look first."""

from collections.abc import Collection
from dataclasses import dataclass

from stereocell.building.surface_cover import SurfaceCover
from stereocell.model.counted import agreeing, counted
from stereocell.model.unit import MAX_MISSING
from stereocell.planning.level_choice import given_level
from stereocell.report.facts import Facts
from stereocell.report.objects import LabelFacts

MAX_NAMED = 4  # channels that a sentence names; the remarks below it name all


@dataclass(frozen=True, slots=True)
class Opening:
    """The sentences, and the anchor of the section to look at first."""

    built: str
    certainty: str
    look_first: str
    anchor: str


def find_opening(
    facts: Facts,
    covers: dict[str, SurfaceCover],
    labels: tuple[LabelFacts, ...],
    with_others: Collection[str],
) -> Opening:
    """Return the three sentences that open a build's report.

    covers       how surfaces cover the source's voxels, by the name of each channel with one
    with_others  names of the channels for which the page shows other iso-values
    """
    look_first, anchor = _look_first(facts, covers, with_others)
    return Opening(_built(facts, labels), _certainty(facts), look_first, anchor)


def _built(facts: Facts, labels: tuple[LabelFacts, ...]) -> str:
    plan = facts.plan
    surfaces = len({unit.channel.name for unit in facts.units if unit.lods})
    channels = counted(len(plan.channels), "channel")
    parts = []
    if plan.channels:
        has_all = surfaces == len(plan.channels)
        parts.append(f"surfaces and volumes of {channels}" if has_all else f"volumes of {channels}")
        if surfaces and not has_all:
            parts.append(f"surfaces of {surfaces} of them")
    if labels:
        parts.append(f"surfaces of {counted(sum(one.objects for one in labels), 'object')}")
    tiles = counted(len(plan.tiles), "tile")
    return f"StereoCell built {_listed(parts)} from {plan.name}, in {tiles}."


def _certainty(facts: Facts) -> str:
    looks = {channel: facts.survey[channel.id].appearance for channel in facts.plan.channels}
    found = {
        channel.name: look
        for channel, look in looks.items()
        if look.level is not None and given_level(facts.plan, channel) is None
    }
    if not looks:
        return "The surfaces follow a label map, so no iso-value had to be found."
    if not found:
        has_given = any(look.level is not None for look in looks.values())
        return (
            "The iso-values come from the settings or the preset, so no confidence was computed."
            if has_given
            else "No channel has a surface; the sections below give the reasons."
        )
    unsure = [name for name, look in found.items() if look.surface == "unsure"]
    if unsure:
        verb = agreeing(len(unsure), "is", "are")
        several = f"{len(unsure)} of {counted(len(found), 'surface')} {verb} unsure"
        return f"{several}: {_named(unsure)}."
    least = min(found, key=lambda name: found[name].iso_confidence)
    value = f"{found[least].iso_confidence:.2f}"
    if len(found) == 1:
        return f"The surface of {least} is clear: its confidence is {value} of 1."
    return f"All surfaces are clear. {least} is the least sure, with a confidence of {value} of 1."


def _look_first(
    facts: Facts, covers: dict[str, SurfaceCover], with_others: Collection[str]
) -> tuple[str, str]:
    looks = {channel: facts.survey[channel.id].appearance for channel in facts.plan.channels}
    for channel, look in looks.items():
        if look.surface == "unsure" and channel.name in with_others:
            return (
                f"Look first at the other iso-values of {channel.name}, which may fit better.",
                "wrong",
            )
    worst = max(covers, key=lambda name: covers[name].missing, default="")
    if worst and covers[worst].missing > MAX_MISSING:
        share = f"{covers[worst].missing:.0%}"
        return (
            f"Look first at the slices of {worst}, whose surface leaves out {share} of the voxels "
            "above its iso-value.",
            "tiles",
        )
    bare = [channel.name for channel, look in looks.items() if look.level is None]
    if bare:
        verb = agreeing(len(bare), "has", "have")
        return f"Look first at {_named(bare)}, which {verb} no surface.", "channels"
    near = [
        channel.name
        for channel in looks
        if channel.name in with_others
        and facts.survey[channel.id].near_levels
        and given_level(facts.plan, channel) is None
    ]
    if near:
        return (
            f"Look first at the other iso-values of {_named(near)}, to see whether you want "
            "the inner structures.",
            "wrong",
        )
    return "Look first at the picture of the specimen, and then at the slices.", "specimen"


def _named(names: list[str]) -> str:
    more = len(names) - MAX_NAMED
    return _listed(names if more <= 0 else [*names[:MAX_NAMED], f"{more} more"])


def _listed(parts: list[str]) -> str:
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)
