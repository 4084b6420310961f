"""The channels of a build and the settings that users give by channel.

If a source channel has several surfaces, each surface is a channel of its own.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from stereocell.isosurface.options import LEVEL_NAMES, NO_SURFACE, parse_level
from stereocell.model.color import linear_color
from stereocell.model.errors import UsageError
from stereocell.model.identifiers import to_identifier
from stereocell.planning.settings import Settings
from stereocell.tissue.head_classes import GREY_MATTER, WHITE_MATTER
from stereocell.transfer.windows import NAMED

T = TypeVar("T")
ALL = "*"  # key in settings by channel that stands for all channels without a key of their own

# Linear RGB of channels whose file names no colour, for a dark ground. Blue is kept for nuclei. Any
# two differ by at least 10 (CIEDE2000), the first three by 23, in normal sight and in red and green
# blindness. Lightness counts for less, because light in the scene changes it. No colour is a pure
# primary, which a screen can't shade.
# Colour blindness is simulated by Machado et al., IEEE TVCG 15(6), 2009. doi:10.1109/TVCG.2009.113
PALETTE = tuple(
    linear_color((code >> 16, code >> 8 & 255, code & 255))
    for code in (0x4F70F5, 0xF0CD3C, 0xB4566E, 0x92ECF6, 0xF6F0DC, 0xA0562C, 0x3F8CA0, 0xB4C078)
)


_PALE = 0.6  # linear RGB, 0..1; if all components exceed it, a lighter colour would look the same
# Linear RGB of bone in CT: warm and nearly neutral, as bone is usually drawn.
FLESH = (0.78, 0.66, 0.55)
# Linear RGB of skin in CT. On paler skin, light that scatters many times would leave no shading.
SKIN = (0.72, 0.5, 0.37)
# Linear RGB of the brightest tissue of an MR, which is nearly white in its slices.
MR_GREY = (0.92, 0.88, 0.82)
# Most channels that show when a specimen is opened; the viewer draws as many volumes at once.
MOST_SHOWN = 4
BODY_MODALITIES = ("MR", "CT")
# Classes of tissue that people want to see in an MR of a head. Skin, skull and fluid hide them.
BRAIN = frozenset({GREY_MATTER, WHITE_MATTER})


@dataclass(frozen=True, slots=True)
class Channel:
    """A channel that is built.

    index        place among the source's channels, from 0
    color        linear RGB, 0..1
    source       source of this channel alone, which a command added to the plan. It has only the
                 planned level, and voxels in uint8 with the window 0..255. Empty: the plan's source
    fingerprint  fingerprint of that source
    level        iso-level of the surface: the name of a found level (`inner`), a voxel value
                 (`162`), or a value above the background (`162+b`); empty: the settings decide
    base         name of the source's channel, if it has several surfaces and this is one of them;
                 empty: `name` is the source's channel
    """

    index: int
    name: str
    color: tuple[float, float, float]
    source: str = ""
    fingerprint: str = ""
    level: str = ""
    base: str = ""

    @property
    def voxels_id(self) -> str:
        """The ID of results that depend on the voxels alone, and not on the surface."""
        return to_identifier(self.base or self.name)

    @property
    def id(self) -> str:
        """The name as an identifier, for paths and prims."""
        return to_identifier(self.name)


def shown_at_first(channels: Sequence[Channel], label_maps: Sequence[str] = ()) -> frozenset[str]:
    """Return the IDs of the channels that show when the specimen is opened, at most MOST_SHOWN.

    label_maps  IDs of the label maps that are built beside the channels

    - Label maps show without the image, because their closed objects hide it or lie inside it.
    - Classes of a brain show without other channels.
    - Autofluorescence is hidden. It shows the same tissue as the other channels, so its surface
      would hide theirs or cross it.
    - Otherwise the first channels show. A dozen stains at once would hide one another.
    """
    if label_maps:
        return frozenset(label_maps[:MOST_SHOWN])
    if has_brain(channels):
        found = [one for one in channels if one.name in BRAIN]
    else:
        found = [one for one in channels if not shows_own_light(one.base or one.name)]
    return frozenset(one.id for one in (found or channels)[:MOST_SHOWN])


def shows_own_light(name: str) -> bool:
    """Return whether a channel's name says that it shows autofluorescence and not a stain."""
    return re.search(r"auto.?fluo|^background$|^af$", name.strip(), re.IGNORECASE) is not None


def has_brain(channels: Iterable[Channel]) -> bool:
    """Return whether the classes of a brain are among the channels, as `tissue` learns them."""
    return {channel.name for channel in channels if channel.source} >= BRAIN


def with_surfaces(channels: Sequence[Channel], wanted: Mapping[str, str]) -> list[Channel]:
    """Return the channels, with one channel for each surface that the settings ask for.

    wanted  `surfaces` of the settings, by channel name or index: level names or voxel values,
            separated by commas

    Raises UsageError for an unknown channel, level name or value, and for a repeated surface.
    """
    given = by_name("--surfaces", wanted, channels)
    found: list[Channel] = []
    for channel in channels:
        if channel.name not in given:
            found.append(channel)
            continue
        surfaces = [part.strip() for part in given[channel.name].split(",")]
        if surfaces == [NO_SURFACE]:
            found.append(replace(channel, level=NO_SURFACE))
            continue
        for surface in surfaces:
            if surface not in LEVEL_NAMES:
                _require_level(channel.name, surface)
        if len(set(surfaces)) < len(surfaces):
            found_twice = ",".join(surfaces)
            raise UsageError(f"--surfaces {channel.name}: found {found_twice}, expected each once")
        if len(surfaces) == 1:
            found.append(replace(channel, level=surfaces[0]))
            continue
        for place, surface in enumerate(surfaces):
            # each further surface is lighter than the one before, or darker in a pale channel
            share, end = place / len(surfaces), float(min(channel.color) < _PALE)
            red, green, blue = (part + share * (end - part) for part in channel.color)
            found.append(
                replace(
                    channel,
                    name=f"{channel.name} {surface}",
                    color=(red, green, blue),
                    level=surface,
                    base=channel.name,
                )
            )
    return found


def _require_level(name: str, surface: str) -> None:
    """Raise UsageError if a surface is named neither by a level's name nor by a voxel value."""
    try:
        parse_level("", surface)
    except UsageError:
        raise UsageError(
            f"--surfaces {name}: found {surface!r:.40}, expected {', '.join(LEVEL_NAMES)}, voxel "
            f"values or values above the background as 162+b, between commas; or {NO_SURFACE}"
        ) from None


def by_name(flag: str, given: Mapping[str, T], channels: Sequence[Channel]) -> dict[str, T]:
    """Return settings by channel name.

    flag   name of the setting, for messages
    given  values by channel name or index; a name that looks like an index counts as a name. The
           key ALL, which presets use, stands for the channels without a key of their own
    """
    found: dict[str, T] = {}
    for key, value in given.items():
        if key == ALL:
            continue
        name = _name(flag, key, channels)
        if name in found:
            raise UsageError(f"{flag} names channel {name!r} by name and by index, expected one")
        found[name] = value
    if ALL in given:
        # a channel with a `level` of its own keeps it, so ALL does not apply to it
        found = {one.name: given[ALL] for one in channels if not one.level} | found
    return found


def require_no_background(settings: Settings, channels: Sequence[Channel], modality: str) -> None:
    """Raise UsageError if a level counts from the background of an MR or CT, which has none."""
    if modality not in BODY_MODALITIES:
        return
    given = [(f"--iso-value {key}", value) for key, value in settings.iso_values.items()]
    given += [
        (f"--surfaces {channel.base or channel.name}", channel.level)
        for channel in channels
        if channel.level and channel.level not in (*LEVEL_NAMES, NO_SURFACE)
    ]
    for flag, value in given:
        if parse_level(flag, value)[1]:
            raise UsageError(
                f"{flag}={value}: found an iso-value above the background, which is never "
                f"subtracted from {modality}, expected a voxel value"
            )


def windows_of(
    windows: Mapping[str, str], channels: Sequence[Channel], modality: str
) -> dict[str, str]:
    """Return windows by channel name; a source channel's window applies to all of its surfaces."""
    for key, window in windows.items():
        if window in NAMED and modality != "CT":
            kind = f"the input is {modality}" if modality else "the input is not known to be a CT"
            raise UsageError(
                f"--window {key}={window}: this window is in Hounsfield units, and {kind}, "
                "expected LOW:HIGH in voxel values, or --preset ct"
            )
    found: dict[str, str] = {}
    for key, window in windows.items():
        if key == ALL:
            continue
        named = [channel.name for channel in channels if key in (channel.name, channel.base)]
        names = named or [channel.name for channel in channels if key == str(channel.index)]
        for name in names or [_name("--window", key, channels)]:
            if name in found:
                raise UsageError(f"--window names channel {name!r} twice, expected once")
            found[name] = window
    if ALL in windows:
        found = {channel.name: windows[ALL] for channel in channels} | found
    return found


def painted(
    paint: Mapping[str, str], channels: Sequence[Channel], *, labels: Sequence[str] = ()
) -> dict[str, str]:
    """Return, by channel name, the name of the channel that is painted on its surface.

    labels  names of label maps; their objects may be painted, too

    Raises UsageError for an unknown channel, and for one that is painted on itself.
    """
    if paint and not channels:
        raise UsageError("--paint: found no channel of an image, expected one beside the labels")
    of_objects = {name: key for name, key in paint.items() if name in labels}
    of_channels = {name: key for name, key in paint.items() if name not in labels}
    given = by_name("--paint", of_channels, channels) | of_objects
    names = [channel.name for channel in channels]
    first = list({channel.index: channel for channel in reversed(channels)}.values())[::-1]
    found = {
        # the surfaces of one source channel share its voxels, so any of them can be painted
        name: _name("--paint", key, channels if key in names else first)
        for name, key in given.items()
    }
    for name, other in found.items():
        if name == other:
            raise UsageError(f"--paint is {name}={other}, expected another channel than its own")
    return found


def _name(flag: str, key: str, channels: Sequence[Channel]) -> str:
    names = [channel.name for channel in channels]
    if key in names:
        return key
    found = [channel.name for channel in channels if key in (channel.base, str(channel.index))]
    found = found or [channel.name for channel in channels if key == channel.id]
    if len(found) > 1:
        raise UsageError(
            f"{flag} names channel {key!r}, which has several surfaces, expected one of "
            f"{', '.join(found)}"
        )
    if not found:
        indices = dict.fromkeys(str(channel.index) for channel in channels)
        raise UsageError(
            f"{flag} names channel {key!r}, expected one of {', '.join(names)}, or an index of "
            f"{', '.join(indices)}"
        )
    return found[0]
