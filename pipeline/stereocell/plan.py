"""The plan of a build: which voxels, cut how, into which units. It is pure: nothing is read or run.

Everything later phases need is in it, with every `auto` resolved; plan.json is its file
(schemas/plan.schema.json).
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Protocol

import numpy as np

from stereocell.config import AUTO, Settings, from_dict, to_dict
from stereocell.errors import SourceError, UsageError
from stereocell.names import to_identifier
from stereocell.repair import RepairOptions
from stereocell.surface import SMOOTHING_REACH
from stereocell.tiling import Box, Tile, cut, size_of_grid

FORMAT = "stereocell-plan"
VERSION = 1

# Colours for channels whose file names none (linear RGB), told apart on a dark ground; the first
# ones are the usual blue, magenta and green of microscopy.
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


class LevelLike(Protocol):
    """One resolution level of a dataset."""

    @property
    def shape(self) -> tuple[int, int, int]: ...
    @property
    def spacing_um(self) -> tuple[float, float, float]: ...


@dataclass(frozen=True, slots=True)
class Channel:
    """A channel that is built. `index` counts in the source; `color` is linear RGB, 0..1."""

    index: int
    name: str
    color: tuple[float, float, float]

    @property
    def id(self) -> str:
        return to_identifier(self.name)


@dataclass(frozen=True, slots=True)
class Plan:
    """A build, settled. Boxes are voxels (z, y, x) of `level`; voxel (0, 0, 0) lies at the origin.

    halo  voxels (z, y, x) that a unit reads around its tile, so that neighbours agree
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

    @property
    def repair(self) -> RepairOptions:
        return _repair_options(self.settings)

    def tile(self, tile_id: str) -> Tile:
        return next(tile for tile in self.tiles if tile.id == tile_id)

    def position_um(self, index_zyx: Sequence[float]) -> tuple[float, float, float]:
        """Return where a voxel's centre lies, (z, y, x) in um."""
        z, y, x = (
            float(o + i * s)
            for o, i, s in zip(self.origin_um, index_zyx, self.spacing_um, strict=True)
        )
        return z, y, x


def choose_level(levels: Sequence[LevelLike], channels: int, settings: Settings) -> tuple[int, str]:
    """Return the level to build and why. Raises UsageError if it doesn't exist."""
    wanted = settings.plan.level
    if wanted != AUTO:
        if not isinstance(wanted, int) or not 0 <= wanted < len(levels):
            raise UsageError(
                f"--level is {wanted}, expected 0 to {len(levels) - 1} (the source's levels)"
            )
        return wanted, "asked for"
    limit = settings.plan.max_voxels
    voxels = [channels * int(np.prod(level.shape, dtype=np.int64)) for level in levels]
    for index, count in enumerate(voxels):
        if count <= limit:
            what = "the finest" if index == 0 else "the finest within the limit"
            return index, f"{what}: {count:,} of at most {limit:,} voxels (plan.max_voxels)"
    raise UsageError(
        f"the coarsest level holds {voxels[-1]:,} voxels, more than plan.max_voxels = {limit:,}: "
        "name a --level, or fewer --channels"
    )


def make_plan(
    source: str,
    name: str,
    fingerprint: str,
    levels: Sequence[LevelLike],
    origin_um: tuple[float, float, float],
    channels: Sequence[Channel],
    level: tuple[int, str],
    settings: Settings,
) -> Plan:
    """Return the plan for these channels at this level (index and reason).

    Raises UsageError for settings that don't fit the data, SourceError for data that can't be cut.
    """
    chosen = levels[level[0]]
    whole = Box((0, 0, 0), chosen.shape)
    region = parse_region(settings.plan.region, whole)
    if min(region.shape) < 2:
        raise SourceError(
            f"{source}: {_by(region.shape)} voxels (z, y, x) to build, expected at least 2 each way"
        )
    tile_size = _tile_size(settings, region)
    unknown = set(settings.iso_values) - {channel.name for channel in channels}
    if unknown:
        raise UsageError(
            f"--iso-value names channel {min(unknown)!r}, "
            f"expected one of {', '.join(channel.name for channel in channels)}"
        )
    settings = replace(
        settings,
        surface=settings.surface.resolved(chosen.spacing_um),
        plan=replace(settings.plan, level=level[0], tile_size=tile_size, grid=""),
    )
    reach = _repair_options(settings).reach_um(chosen.spacing_um)
    reach += SMOOTHING_REACH * float(settings.surface.smoothing_um)
    # two more: one voxel for the gradient, one because the tile's last plane is its neighbour's
    z, y, x = (int(np.ceil(reach / step)) + 2 for step in chosen.spacing_um)
    return Plan(
        source=source,
        name=name,
        fingerprint=fingerprint,
        level=level[0],
        level_reason=level[1],
        spacing_um=chosen.spacing_um,
        origin_um=origin_um,
        region=region,
        halo=(z, y, x),
        tiles=cut(region, tile_size),
        channels=tuple(channels),
        settings=settings,
    )


def parse_region(text: str, whole: Box) -> Box:
    """Return the box that `z0:z1,y0:y1,x0:x1` names; an empty end means the data's own."""
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


def _tile_size(settings: Settings, region: Box) -> tuple[int, int, int]:
    options = settings.plan
    if options.grid:
        match = re.fullmatch(r"(\d+)x(\d+)", options.grid)
        if not match or "0" in match.groups():
            raise UsageError(f"--grid is {options.grid!r}, expected columns x rows, as 5x2")
        columns, rows = int(match[1]), int(match[2])
        _, height, width = region.shape
        if height < 2 * rows or width < 2 * columns:
            raise UsageError(
                f"--grid {options.grid} makes more tiles than {_by((height, width))} voxels (y, x) "
                "can fill, expected at least 2 voxels a tile each way"
            )
        return size_of_grid(region, columns, rows)
    if len(options.tile_size) != 3 or min(options.tile_size) < 2:
        raise UsageError(
            f"--tile-size is {list(options.tile_size)}, expected three numbers z,y,x of at least 2"
        )
    z, y, x = (min(a, b) for a, b in zip(options.tile_size, region.shape, strict=True))
    return z, y, x


def _repair_options(settings: Settings) -> RepairOptions:
    surface = settings.surface
    return RepairOptions(
        float(surface.alpha_um), float(surface.min_diagonal_um), float(surface.max_cavity_um)
    )


def _by(numbers: Sequence[int]) -> str:
    return " x ".join(str(n) for n in numbers)


def to_json(plan: Plan) -> dict[str, Any]:
    """Return the plan as plain values, as plan.json holds it."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "source": plan.source,
        "name": plan.name,
        "fingerprint": plan.fingerprint,
        "level": plan.level,
        "level_reason": plan.level_reason,
        "spacing_um": list(plan.spacing_um),
        "origin_um": list(plan.origin_um),
        "region": _box_json(plan.region),
        "halo": list(plan.halo),
        "tiles": [{"id": tile.id, **_box_json(tile.box)} for tile in plan.tiles],
        "channels": [{**asdict(c), "color": list(c.color)} for c in plan.channels],
        "settings": to_dict(plan.settings),
    }


def from_json(content: Mapping[str, Any]) -> Plan:
    """Return the plan that `to_json` was given; the content has passed its schema."""
    return Plan(
        source=content["source"],
        name=content["name"],
        fingerprint=content["fingerprint"],
        level=content["level"],
        level_reason=content["level_reason"],
        spacing_um=tuple(content["spacing_um"]),
        origin_um=tuple(content["origin_um"]),
        region=_box(content["region"]),
        halo=tuple(content["halo"]),
        tiles=tuple(Tile(tile["id"], _box(tile)) for tile in content["tiles"]),
        channels=tuple(
            Channel(c["index"], c["name"], tuple(c["color"])) for c in content["channels"]
        ),
        settings=from_dict(content["settings"]),
    )


def _box_json(box: Box) -> dict[str, list[int]]:
    return {"start": list(box.start), "stop": list(box.stop)}


def _box(content: Mapping[str, Any]) -> Box:
    return Box(tuple(content["start"]), tuple(content["stop"]))
