"""Remarks of the report: warnings and notes, each with a line for every channel or tile."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from stereocell.building.surface_cover import SurfaceCover, sum_lifted
from stereocell.model.counted import counted
from stereocell.model.unit import MAX_MISSING, Cover
from stereocell.report.facts import Facts, UnitFacts

MIN_ANGLE_DEG = 12.0  # degrees, 1st percentile of lod0; thinner triangles are shaded as streaks
_MAX_LINES = 30  # largest number of lines of one remark


@dataclass(frozen=True, slots=True)
class Remark:
    """One kind of finding, with its lines. A note is worth knowing, but is not a problem."""

    title: str
    lines: tuple[str, ...]
    is_note: bool = False


def find_remarks(facts: Facts) -> list[Remark]:
    """Return the report's remarks about a build, most severe first."""
    units, covers = facts.units, find_covers(facts.units)
    looks = {channel.name: facts.survey[channel.id].appearance for channel in facts.plan.channels}
    with_surface = {u.channel.name for u in units if not u.reason}
    whole = [
        f"{name}: {look.surface_reason or 'no voxel lies above its iso-value'}"
        for name, look in looks.items()
        if name not in with_surface
    ]
    unsure = [
        f"{name}: {look.surface_reason}" for name, look in looks.items() if look.surface == "unsure"
    ]
    bare = [f"{u.name}: {u.reason}" for u in units if u.reason and u.channel.name in with_surface]
    found = [
        _remark("without a surface", whole, "channel"),
        _remark("with an unsure surface", unsure, "channel"),
        _remark(
            "of tile and channel without a surface, though the channel has one in other tiles",
            bare,
            "pair",
            is_note=True,
        ),
        _remark(
            f"with thin triangles at the finest level (1 % of the triangles "
            f"have an angle below {MIN_ANGLE_DEG:g}°)",
            _thin(units),
            "channel",
            is_note=True,
        ),
        _remark(
            f"with a surface that leaves out more than {MAX_MISSING:.0%} of the voxels above "
            "its iso-value",
            [f"{name}: {one.words}" for name, one in covers.items() if one.missing > MAX_MISSING],
            "channel",
        ),
        _remark(
            "with a surface that covers nearly all voxels above its iso-value",
            [f"{name}: {one.words}" for name, one in covers.items() if one.missing <= MAX_MISSING],
            "channel",
            is_note=True,
        ),
        _remark(
            "without pieces that lie apart from the body", _holders(facts), "channel", is_note=True
        ),
        _remark("left open at the faces of the volume", _open(facts), "surface", is_note=True),
        _remark("on how the source was read and built", facts.plan.notes, "note", is_note=True),
        _counts(("fragment", "fragments"), "removed", units, lambda u: u.fragments_dropped),
        _counts(("cavity", "cavities"), "filled", units, lambda u: u.cavities_filled),
    ]
    return [remark for remark in found if remark is not None]


def find_covers(units: Iterable[UnitFacts]) -> dict[str, SurfaceCover]:
    """Return how the surface of each channel covers the source's voxels, by the channel's name."""
    by_channel: dict[str, list[UnitFacts]] = {}
    for unit in units:
        if unit.cover is not None and unit.cover.source:
            by_channel.setdefault(unit.channel.name, []).append(unit)
    found = {}
    for name, built in by_channel.items():
        total = sum((unit.cover for unit in built if unit.cover is not None), Cover(0, 0, 0))
        found[name] = SurfaceCover.of(total, sum_lifted(u.lifted for u in built if u.lifted))
    return found


def _holders(facts: Facts) -> list[str]:
    """Return a line for each CT channel whose surface leaves out the table or the head holder."""
    return [
        f"{channel.name}: {', '.join(holder.pieces)}, {holder.WORDS}; --keep-holder builds it too"
        for channel in facts.plan.channels
        if (holder := facts.survey[channel.id].holder) is not None
    ]


def _open(facts: Facts) -> list[str]:
    """Return a line for each channel with a surface that stays open at the faces of the volume."""
    if facts.plan.settings.surface.caps:
        return []
    built = dict.fromkeys(unit.channel.name for unit in facts.units if not unit.reason)
    why = "open at the planes of the outermost voxels, as --no-caps asks; it is not a solid"
    return [f"{name}: {why}" for name in built]


def _thin(units: Iterable[UnitFacts]) -> list[str]:
    """Return a line for each channel whose lod0 has a unit with thin triangles."""
    thin: dict[str, list[tuple[float, str]]] = {}
    for unit in units:
        angle = unit.lods[0].angle_deg if unit.lods else None
        if angle is not None and angle < MIN_ANGLE_DEG:
            thin.setdefault(unit.channel.name, []).append((angle, unit.tile.id))
    return [
        f"{channel}: {min(found)[0]:.1f}° in {min(found)[1]}"
        + (f"; {len(found):,} tiles have such triangles" if len(found) > 1 else "")
        for channel, found in thin.items()
    ]


def _remark(
    what: str, lines: Sequence[str], noun: str = "unit", is_note: bool = False
) -> Remark | None:
    if not lines:
        return None
    return Remark(f"{counted(len(lines), noun)} {what}", _cut(lines), is_note)


def _counts(
    nouns: tuple[str, str], what: str, units: Iterable[UnitFacts], count: Callable[[UnitFacts], int]
) -> Remark | None:
    """Return a note with the sum of a count over all units, and a line for each channel."""
    by_channel: dict[str, list[UnitFacts]] = {}
    for unit in units:
        if count(unit):
            by_channel.setdefault(unit.channel.name, []).append(unit)
    lines = []
    for channel, touched in by_channel.items():
        most = max(touched, key=count)
        total = sum(count(unit) for unit in touched)
        tiles = counted(len(touched), "tile")
        lines.append(f"{channel}: {total:,} in {tiles}, most in {most.tile.id} ({count(most):,})")
    if not lines:
        return None
    total = sum(count(unit) for touched in by_channel.values() for unit in touched)
    return Remark(f"{counted(total, *nouns)} {what}", _cut(lines), is_note=True)


def _cut(lines: Sequence[str]) -> tuple[str, ...]:
    more = len(lines) - _MAX_LINES
    return (*lines[:_MAX_LINES], *([f"and {more:,} more"] if more > 0 else []))
