"""The plan of a build: the voxels, the tiles, the units. Pure: it reads and runs nothing.

It holds everything that later phases need, with every `auto` resolved; plan.json is its file
(schemas/plan.schema.json).
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Protocol, TypeVar

from stereocell.building.settings import Settings
from stereocell.filters.denoise import SMOOTHING_REACH
from stereocell.isosurface.options import RUNGS, parse_level
from stereocell.isosurface.repair import RepairOptions
from stereocell.model.errors import SourceError, UsageError
from stereocell.model.identifiers import to_identifier
from stereocell.model.rigid_transform import IDENTITY, Matrix
from stereocell.model.settings import AUTO
from stereocell.model.tiling import Box, Tile, cut, cut_evenly
from stereocell.transfer.windows import NAMED

T = TypeVar("T")
ALL = "*"  # the key of settings by channel that stands for all that have none

# Largest window of a unit, at about 30 bytes a voxel: UNIT_VOXELS, or UNIT_TILES times its tile.
UNIT_VOXELS = 1 << 27  # voxels
UNIT_TILES = 8  # tiles
LEAST_PLANES = 4  # smallest number of planes per axis of a tile that carry the surface

# Colours (linear RGB) for channels whose file names none, distinct on a dark ground; the first
# three are the usual blue, magenta and green of microscopy.
PALETTE = (
    (0.07, 0.22, 1.0),
    (1.0, 0.05, 0.45),
    (0.05, 0.8, 0.15),
    (1.0, 0.45, 0.02),
    (0.05, 0.75, 0.85),
    (0.9, 0.8, 0.05),
    (0.45, 0.12, 0.95),
    (0.8, 0.8, 0.8),
)


# colour (linear RGB) of MR and CT: warm and neutral, as bone and tissue are usually drawn
_PALE = 0.6  # linear RGB: a colour whose least part is more has no lighter one beside it
FLESH = (0.78, 0.66, 0.55)
BODY_MODALITIES = ("MR", "CT")


def choose_color(place: int, modality: str) -> tuple[float, float, float]:
    """Return the colour (linear RGB) of a channel without one, the `place`-th that is built."""
    if place == 0 and modality in BODY_MODALITIES:
        return FLESH
    return PALETTE[place % len(PALETTE)]


def with_surfaces(channels: Sequence["Channel"], wanted: Mapping[str, str]) -> list["Channel"]:
    """Return the channels, with one for each surface that the settings ask for.

    wanted  `surfaces` of the settings: rungs or voxel values between commas, by name or index

    Raises UsageError.
    """
    by_name = _by_name("--surfaces", wanted, channels)
    found: list[Channel] = []
    for channel in channels:
        if channel.name not in by_name:
            found.append(channel)
            continue
        rungs = [part.strip() for part in by_name[channel.name].split(",")]
        for rung in rungs:
            if rung not in RUNGS:
                _require_level(channel.name, rung)
        if len(set(rungs)) < len(rungs):
            found_twice = ",".join(rungs)
            raise UsageError(f"--surfaces {channel.name}: found {found_twice}, expected each once")
        if len(rungs) == 1:
            found.append(replace(channel, rung=rungs[0]))
            continue
        for place, rung in enumerate(rungs):
            # towards white from surface to surface inwards, or towards black where it is white
            share, end = place / len(rungs), float(min(channel.color) < _PALE)
            red, green, blue = (part + share * (end - part) for part in channel.color)
            found.append(
                replace(
                    channel,
                    name=f"{channel.name} {rung}",
                    color=(red, green, blue),
                    rung=rung,
                    base=channel.name,
                )
            )
    return found


def _require_level(name: str, rung: str) -> None:
    """Raise UsageError where a surface is asked for neither by a rung nor by a voxel value."""
    try:
        parse_level("", rung)
    except UsageError:
        raise UsageError(
            f"--surfaces {name}: found {rung!r:.40}, expected {', '.join(RUNGS)}, voxel values or "
            "values above the background as 162+b, between commas"
        ) from None


class LevelLike(Protocol):
    """One resolution level of a dataset."""

    @property
    def shape(self) -> tuple[int, int, int]: ...
    @property
    def spacing_um(self) -> tuple[float, float, float]: ...


@dataclass(frozen=True, slots=True)
class Channel:
    """A channel that is built. `index` counts in the source; `color` is linear RGB, 0..1.

    source       a source for this channel alone, which a command added to the plan: one level, the
                 planned one, and voxels uint8 with the window 0..255; empty: the plan's source
    fingerprint  of that source
    rung         which level of the ladder has the surface, or a voxel value, as 162 or 162+b;
                 empty: the settings'
    base         the name of the channel whose voxels these are, where it has several surfaces;
                 empty: its own
    """

    index: int
    name: str
    color: tuple[float, float, float]
    source: str = ""
    fingerprint: str = ""
    rung: str = ""
    base: str = ""

    @property
    def voxels_id(self) -> str:
        """The ID under which results of the voxels alone lie, whatever surface is made of them."""
        return to_identifier(self.base or self.name)

    @property
    def id(self) -> str:
        """The name as an identifier, for paths and prims."""
        return to_identifier(self.name)


@dataclass(frozen=True, slots=True)
class Plan:
    """A build with all choices made. Boxes are voxels (z, y, x) of `level`.

    spacing_um  (z, y, x), um
    origin_um   centre of voxel (0, 0, 0), (z, y, x), um
    halo        voxels (z, y, x) that a unit reads around its tile, so that neighbours agree
    modality    DICOM's code of the modality: `MR`, `CT`, ...; empty: not known
    placement   rows of a (4, 4) matrix for columns, um: from the world of the voxels
                (volume.zyx_to_xyz) to the specimen's place
    """

    source: str
    name: str
    fingerprint: str
    level: int
    level_reason: str
    spacing_um: tuple[float, float, float]
    origin_um: tuple[float, float, float]
    region: Box
    halo: tuple[int, int, int]
    tiles: tuple[Tile, ...]
    channels: tuple[Channel, ...]
    settings: Settings
    modality: str = ""
    placement: Matrix = IDENTITY

    @property
    def repair(self) -> RepairOptions:
        """The largest repair of any channel; the halo covers it (per channel: repair_rules.py)."""
        return _repair_options(self.settings)

    @property
    def step(self) -> tuple[int, int, int]:
        """The step in voxels (z, y, x) between planes that carry the surface."""
        return _step(self.settings, self.spacing_um)

    @property
    def shared_volumes(self) -> frozenset[str]:
        """IDs of the channels whose volume is that of an earlier one: further surfaces of it."""
        seen: set[str] = set()
        shared = set()
        for channel in self.channels:
            if channel.base and channel.base in seen:
                shared.add(channel.id)
            seen.add(channel.base)
        return frozenset(shared)

    def level_of(self, channel: Channel) -> int:
        """Return the level of its source at which a channel is read."""
        return 0 if channel.source else self.level

    def painter(self, channel: Channel) -> Channel | None:
        """Return the channel sampled onto a channel's surface; None: none is."""
        painted = self.settings.paint.get(channel.name)
        return next((other for other in self.channels if other.name == painted), None)

    def tile(self, tile_id: str) -> Tile:
        """Return the tile with this ID; the plan must hold it."""
        return next(tile for tile in self.tiles if tile.id == tile_id)

    def position_um(self, index_zyx: Sequence[float]) -> tuple[float, float, float]:
        """Return the place of a voxel's centre, (z, y, x) in um."""
        z, y, x = (
            float(o + i * s)
            for o, i, s in zip(self.origin_um, index_zyx, self.spacing_um, strict=True)
        )
        return z, y, x


def choose_level(levels: Sequence[LevelLike], channels: int, settings: Settings) -> tuple[int, str]:
    """Return the level to build and the reason: the requested one, else the finest within limits.

    The region counts voxels of the level that is built, so a level that is too small to hold it is
    skipped. Raises UsageError where there is no such level.
    """
    wanted = settings.plan.level
    if wanted != AUTO:
        if not isinstance(wanted, int) or not 0 <= wanted < len(levels):
            raise UsageError(
                f"--level is {wanted}, expected 0 to {len(levels) - 1} (the source's levels)"
            )
        return wanted, "asked for"
    region, limit = settings.plan.region, settings.plan.max_voxels
    for index, level in enumerate(levels):
        whole = Box((0, 0, 0), level.shape)
        try:
            box = parse_region(region, whole)
        except UsageError:
            if index == 0:
                raise
            break
        voxels = channels * math.prod(box.shape)
        if voxels <= limit:
            what = "the finest" if index == 0 else "the finest within the limit"
            return index, f"{what}: {voxels:,} of at most {limit:,} voxels (plan.max_voxels)"
    what = f"--region {region}" if region else "the coarsest level"
    remedy = "a smaller --region" if region else "a --level"
    raise UsageError(
        f"{what} holds {voxels:,} voxels, more than plan.max_voxels = {limit:,}: "
        f"name {remedy}, or fewer --channels"
    )


def make_plan(
    source: str,
    name: str,
    *,
    fingerprint: str,
    levels: Sequence[LevelLike],
    origin_um: tuple[float, float, float],
    channels: Sequence[Channel],
    level: tuple[int, str],
    settings: Settings,
    modality: str = "",
    placement: Matrix = IDENTITY,
) -> Plan:
    """Return the plan for these channels at this level (index and reason).

    origin_um  centre of voxel (0, 0, 0) of the level, (z, y, x), um

    Raises UsageError for settings that don't fit the data, SourceError for data that can't be cut.
    """
    chosen = levels[level[0]]
    whole = Box((0, 0, 0), chosen.shape)
    region = parse_region(settings.plan.region, whole)
    if min(region.shape) < 2:
        raise SourceError(
            f"{source}: {_by(region.shape)} voxels (z, y, x) to build, expected at least 2 each way"
        )
    tile_size, tiles = _tiles(settings, region)
    if settings.surface.wrap == "alpha-wrap" and len(tiles) > 1:
        raise UsageError(
            f"surface.wrap is 'alpha-wrap', which closes each tile by itself, and there are "
            f"{len(tiles)} tiles: expected one (--grid 1x1, or a --region of one tile)"
        )
    settings = replace(
        settings,
        surface=settings.surface.resolved(chosen.spacing_um),
        unwrap=settings.unwrap.resolved(chosen.spacing_um),
        plan=replace(settings.plan, level=level[0], tile_size=tile_size),
        iso_values=_by_name("--iso-value", settings.iso_values, channels),
        windows=_of_all(settings.windows, channels, modality),
        paint=_painted(settings.paint, channels),
    )
    _require_planes(settings, chosen.spacing_um)
    _require_no_background(settings, channels, modality)
    return Plan(
        source=source,
        name=name,
        fingerprint=fingerprint,
        level=level[0],
        level_reason=level[1],
        spacing_um=chosen.spacing_um,
        origin_um=origin_um,
        region=region,
        halo=_halo(settings, chosen.spacing_um, region),
        tiles=tiles,
        channels=tuple(channels),
        settings=settings,
        modality=modality,
        placement=placement,
    )


def parse_region(text: str, whole: Box) -> Box:
    """Return the box of `z0:z1,y0:y1,x0:x1` in voxels; an empty end means the data's own.

    Raises UsageError where the text isn't a box inside `whole`.
    """
    if not text:
        return whole
    match = re.fullmatch(r"(\d*):(\d*),(\d*):(\d*),(\d*):(\d*)", text.replace(" ", ""))
    if not match:
        raise UsageError(f"--region is {text!r}, expected z0:z1,y0:y1,x0:x1 in voxels")
    ends = [int(e) if e else None for e in match.groups()]
    z0, y0, x0 = (e if e is not None else 0 for e in ends[::2])
    z1, y1, x1 = (e if e is not None else n for e, n in zip(ends[1::2], whole.stop, strict=True))
    box = Box((z0, y0, x0), (z1, y1, x1))
    inside = all(a < b <= n for a, b, n in zip(box.start, box.stop, whole.stop, strict=True))
    if not inside:
        raise UsageError(f"--region is {text!r}, expected a box inside {_by(whole.stop)} (z, y, x)")
    return box


def _tiles(settings: Settings, region: Box) -> tuple[tuple[int, int, int], tuple[Tile, ...]]:
    """Return the tile size (z, y, x) in voxels, with a grid that of the largest, and the tiles."""
    options = settings.plan
    if options.grid:
        match = re.fullmatch(r"([1-9]\d*)x([1-9]\d*)", options.grid)
        if not match:
            raise UsageError(f"--grid is {options.grid!r}, expected columns x rows, as 5x2")
        columns, rows = int(match[1]), int(match[2])
        depth, height, width = region.shape
        if height < 2 * rows or width < 2 * columns:
            raise UsageError(
                f"--grid {options.grid} makes more tiles than {_by((height, width))} voxels (y, x) "
                "can fill, expected at least 2 voxels a tile each way"
            )
        size = (depth, -(-height // rows), -(-width // columns))
        return size, cut_evenly(region, columns, rows)
    if len(options.tile_size) != 3 or min(options.tile_size) < 2:
        raise UsageError(
            f"--tile-size is {list(options.tile_size)}, expected three numbers z,y,x of at least 2"
        )
    z, y, x = (min(a, b) for a, b in zip(options.tile_size, region.shape, strict=True))
    return (z, y, x), cut(region, (z, y, x))


def _halo(
    settings: Settings,
    spacing_um: tuple[float, float, float],
    region: Box,
) -> tuple[int, int, int]:
    """Return the voxels (z, y, x) that a unit reads around its tile, at most the region's.

    Raises UsageError where these, and the voxels that closing and smoothing add at the ends, are
    out of proportion to the tile: such lengths are meant for other voxels.
    """
    surface = settings.surface
    smoothing = SMOOTHING_REACH * float(surface.smoothing_um)
    every = _step(settings, spacing_um)
    z, y, x = (step * n for step, n in zip(spacing_um, every, strict=True))
    repair = _repair_options(settings)
    reach = repair.reach_um((z, y, x)) + smoothing
    padding = max(repair.alpha_um, smoothing)
    tile_size = settings.plan.tile_size
    limit = max(UNIT_VOXELS, UNIT_TILES * math.prod(tile_size))
    z, y, x = (
        min(size + 2 * (reach / step + 4 * k), n) + 2 * padding / step
        for size, n, step, k in zip(tile_size, region.shape, spacing_um, every, strict=True)
    )
    if z * y * x > limit:
        lengths = {f.name: getattr(surface, f.name) for f in fields(surface)}
        found = ", ".join(
            f"{name} = {length:g} um ({length / min(spacing_um):,.0f} voxels)"
            for name, length in lengths.items()
            if name.endswith("_um") and length != AUTO
        )
        raise UsageError(
            f"the surface's lengths don't suit voxels of {_by(spacing_um)} um (z, y, x): {found} "
            f"make a unit work on {z * y * x:.3g} voxels for a tile of "
            f"{_by(tile_size)}, expected at most {limit:,}: "
            "choose another --preset, smaller lengths or larger tiles"
        )
    # four more: one voxel for the median, one for the gradient, one because the tile's last plane
    # is its neighbour's, one past the plane (surface._least_on_plane)
    depth, height, width = (
        math.ceil(min(reach / step, n)) + 4 * k
        for n, step, k in zip(region.shape, spacing_um, every, strict=True)
    )
    return depth, height, width


def _by_name(flag: str, given: Mapping[str, T], channels: Sequence[Channel]) -> dict[str, T]:
    """Return values by channel name; a key is a name, or an index where no name equals it.

    The key ALL is for the channels that no other names; presets use it.
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
        # a surface that is chosen by its rung or value has its level from there
        found = {one.name: given[ALL] for one in channels if not one.rung} | found
    return found


def _require_no_background(settings: Settings, channels: Sequence[Channel], modality: str) -> None:
    """Raise UsageError where a level is given above the background of what has none."""
    if modality not in BODY_MODALITIES:
        return
    given = [(f"--iso-value {key}", value) for key, value in settings.iso_values.items()]
    given += [
        (f"--surfaces {channel.base or channel.name}", channel.rung)
        for channel in channels
        if channel.rung and channel.rung not in RUNGS
    ]
    for flag, value in given:
        if parse_level(flag, value)[1]:
            raise UsageError(
                f"{flag}={value}: a level above the background, which is never "
                f"subtracted of {modality}, expected a voxel value"
            )


def _of_all(
    windows: Mapping[str, str], channels: Sequence[Channel], modality: str
) -> dict[str, str]:
    """Return windows by channel name; that of voxels with several surfaces goes to each."""
    for key, window in windows.items():
        if window in NAMED and modality != "CT":
            kind = f"this is {modality}" if modality else "nothing says that this is one"
            raise UsageError(
                f"--window {key}={window}: a window in Hounsfield units, of CT, and {kind}: "
                "expected LOW:HIGH in voxel values, or --preset ct"
            )
    found: dict[str, str] = {}
    for key, window in windows.items():
        if key == ALL:
            continue
        by_name = [channel.name for channel in channels if key in (channel.name, channel.base)]
        names = by_name or [channel.name for channel in channels if key == str(channel.index)]
        for name in names or [_name("--window", key, channels)]:
            if name in found:
                raise UsageError(f"--window names channel {name!r} twice, expected once")
            found[name] = window
    if ALL in windows:
        found = {channel.name: windows[ALL] for channel in channels} | found
    return found


def _painted(paint: Mapping[str, str], channels: Sequence[Channel]) -> dict[str, str]:
    """Return channel name -> name of the channel that is sampled onto its surface."""
    by_name, names = _by_name("--paint", paint, channels), [channel.name for channel in channels]
    first = list({channel.index: channel for channel in reversed(channels)}.values())[::-1]
    found = {
        # of voxels with several surfaces any channel has the intensity
        name: _name("--paint", key, channels if key in names else first)
        for name, key in by_name.items()
    }
    for name, painted in found.items():
        if name == painted:
            raise UsageError(f"--paint {name}={painted}: expected another channel than its own")
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


def _step(settings: Settings, spacing_um: Sequence[float]) -> tuple[int, int, int]:
    # 0.01 for rounding: 0.42 um are three times 0.14 um
    z, y, x = (max(1, int(settings.surface.grid_um / h + 0.01)) for h in spacing_um)
    return z, y, x


def _require_planes(settings: Settings, spacing_um: Sequence[float]) -> None:
    """Raise UsageError where planes lie so far apart that a tile keeps hardly any."""
    size = settings.plan.tile_size
    steps = _step(settings, spacing_um)
    for axis, n, k, h in zip("zyx", size, steps, spacing_um, strict=True):
        planes = -(-n // k)
        if k > 1 and planes < LEAST_PLANES:
            raise UsageError(
                f"surface.grid_um is {settings.surface.grid_um:g}, which leaves {planes} of the "
                f"{n} planes along {axis} of a tile, {h:g} um apart: expected {LEAST_PLANES} or "
                "more of them: choose another --preset, or a smaller surface.grid_um"
            )


def _repair_options(settings: Settings) -> RepairOptions:
    surface = settings.surface
    alpha = surface.max_alpha_um if surface.alpha_um == AUTO else surface.alpha_um
    return RepairOptions(
        alpha_um=float(alpha),
        min_diagonal_um=float(surface.min_diagonal_um),
        max_cavity_um=float(surface.max_cavity_um),
        max_fragment_um=float(surface.max_fragment_um),
        offset_um=0.0 if surface.offset_um == AUTO else float(surface.offset_um),
    )


def _by(numbers: Sequence[float]) -> str:
    return " x ".join(f"{n:.15g}" for n in numbers)
