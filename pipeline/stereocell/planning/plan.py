"""The plan of a build: its voxels, tiles and units.

The plan holds everything that later phases need, with every `auto` resolved. Its file is plan.json
(schemas/plan.schema.json). Making a plan reads no file.
"""

import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields, replace
from typing import Protocol

from stereocell.filters.reach import SMOOTHING_REACH
from stereocell.isosurface.repair_options import RepairOptions
from stereocell.model.errors import SourceError, UsageError
from stereocell.model.lattice import CAP
from stereocell.model.rigid_transform import IDENTITY, Matrix
from stereocell.model.settings import AUTO
from stereocell.model.spacing import Point, Spacing
from stereocell.model.tiling import Box, Tile, cut, cut_evenly
from stereocell.planning.channels import (
    Channel,
    by_name,
    has_brain,
    painted,
    require_no_background,
    shown_at_first,
    windows_of,
)
from stereocell.planning.settings import Settings
from stereocell.steps.labels import Labels

# The window that a unit reads may hold UNIT_VOXELS voxels, or UNIT_TILES times as many as its tile.
# A unit needs about 30 bytes a voxel.
UNIT_VOXELS = 1 << 27  # voxels
UNIT_TILES = 8  # tiles
MIN_PLACES = 8  # fewest equal parts of half a voxel at which the caps of channels lie
MIN_PLANES = 4  # fewest planes along each axis of a tile from which a surface is extracted


class LevelLike(Protocol):
    """One resolution level of a dataset."""

    @property
    def shape(self) -> tuple[int, int, int]: ...
    @property
    def spacing_um(self) -> Spacing: ...


@dataclass(frozen=True, slots=True)
class Plan:
    """A build with all choices made. Boxes are voxels (z, y, x) of `level`.

    level           resolution level that is built, 0 is the finest
    spacing_um      voxel spacing (z, y, x), um
    origin_um       centre of voxel (0, 0, 0), (z, y, x) in um
    halo            voxels (z, y, x) that a unit reads around its tile, so that neighbouring tiles
                    compute the same field
    modality        DICOM's code of the modality: `MR`, `CT`, ...; empty: not known
    placement       rows of a (4, 4) matrix, um. It maps column vectors of voxel world coordinates
                    (volume.zyx_to_xyz) to the specimen's place
    slice_axis      axis perpendicular to the source's images: 0, 1 or 2 for z, y or x
                    (model/image_plane.py)
    has_sides       whether the source states where the patient's left, back and head are. Then the
                    specimen's place is the patient's world (read/anatomical_axes.py)
    labels          label maps whose objects are built, besides `channels`
    formats         names of the formats of source and label maps, sorted (known_formats.format_of)
    notes           sentences on what was chosen, assumed or left out in reading the source
    is_hounsfield   whether the values of a CT may be compared with Hounsfield units
    """

    source: str
    name: str
    fingerprint: str
    level: int
    level_reason: str
    spacing_um: Spacing
    origin_um: Point
    region: Box
    halo: tuple[int, int, int]
    tiles: tuple[Tile, ...]
    channels: tuple[Channel, ...]
    settings: Settings
    modality: str = ""
    placement: Matrix = IDENTITY
    slice_axis: int = 0
    has_sides: bool = False
    labels: tuple[Labels, ...] = ()
    formats: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    is_hounsfield: bool = True

    @property
    def repair(self) -> RepairOptions:
        """The farthest-reaching repair of any channel, which the halo covers.

        Each channel's own repair is chosen in repair_rules.py.
        """
        return _repair_options(self.settings)

    @property
    def step(self) -> tuple[int, int, int]:
        """The distance in voxels (z, y, x) between the planes from which surfaces are extracted."""
        return _step_of(self.settings.surface.grid_um, self.spacing_um)

    def with_grid(self, grid_um: float) -> "Plan":
        """Return the plan for surfaces that are extracted from planes `grid_um` apart."""
        if grid_um == self.settings.surface.grid_um:
            return self
        surface = replace(self.settings.surface, grid_um=grid_um)
        settings = replace(self.settings, surface=surface)
        return replace(self, settings=settings, halo=_halo(settings, self.spacing_um, self.region))

    def grid_for(self, faces: int, thin: float) -> float:
        """Return the distance between planes, um, at which the surface has few enough faces.

        It starts from surface.grid_um. If more than surface.max_thin of the channel is too thin
        for that, it starts from all planes.

        Keeping every k-th plane along each axis divides the faces of a smooth surface by k^2, and
        those of noise by more. So planes are thinned along the axes where they lie closest, until
        the surface has at most surface.max_faces. It stops before a tile keeps fewer than
        MIN_PLANES, or a unit reads too much around its tile.

        faces  voxel faces of the surface in one tile
        thin   share of the channel's voxels above its level in structures too thin for grid_um
        """
        surface = self.settings.surface
        grid = 0.0 if thin > surface.max_thin else surface.grid_um
        while faces / math.prod(_step_of(grid, self.spacing_um)) ** (2 / 3) > surface.max_faces:
            step = _step_of(grid, self.spacing_um)
            wider = min((k + 1) * h for k, h in zip(step, self.spacing_um, strict=True))
            try:
                thinner = self.with_grid(wider)
                _require_planes(thinner.settings, self.spacing_um)
            except UsageError:
                break
            grid = wider
        return grid

    @property
    def shared_volumes(self) -> frozenset[str]:
        """IDs of further surfaces of a channel, whose volume is that of its first surface."""
        seen: set[str] = set()
        shared = set()
        for channel in self.channels:
            if channel.base and channel.base in seen:
                shared.add(channel.id)
            seen.add(channel.base)
        return frozenset(shared)

    @property
    def shown_at_first(self) -> frozenset[str]:
        """The IDs of the channels and label maps that show when the specimen is opened."""
        return shown_at_first(self.channels, [one.id for one in self.labels])

    @property
    def opens_cut(self) -> bool:
        """Whether the specimen opens with a cut through its middle.

        People look at an MR to see the inside. Classes of a brain show the inside already, and a
        cut would open the closed objects of label maps.
        """
        return self.modality == "MR" and not self.labels and not has_brain(self.channels)

    def cap_of(self, channel: Channel) -> float | None:
        """Return how far past the outermost voxels a channel's caps lie; None: it has no caps.

        The unit is the voxel spacing. The face of the block lies CAP, half a voxel, past the
        outermost voxels; the objects of label maps end there. The caps of each channel lie a little
        inside of those of the channel before it. Programs would show coinciding caps as confetti.
        With fewer than MIN_PLACES channels the distance is a 16th of a voxel, more than the
        lattice step of a bundle, and channels may be added at the end.
        """
        if not self.settings.surface.caps:
            return None
        distance = CAP / max(MIN_PLACES, len(self.channels) + 1)
        return CAP - distance * (self.channels.index(channel) + 1)

    def level_of(self, channel: Channel) -> int:
        """Return the resolution level at which a channel's source is read."""
        return 0 if channel.source else self.level

    def painter(self, channel: Channel | Labels) -> Channel | None:
        """Return the channel that is painted on a surface or on objects; None: none is."""
        painted = self.settings.paint.get(channel.name)
        return next((other for other in self.channels if other.name == painted), None)

    def tile(self, tile_id: str) -> Tile:
        """Return the tile with this ID. The plan must have such a tile."""
        return next(tile for tile in self.tiles if tile.id == tile_id)

    def position_um(self, index_zyx: Sequence[float]) -> Point:
        """Return the position of a voxel's centre, (z, y, x) in um."""
        z, y, x = (
            float(o + i * s)
            for o, i, s in zip(self.origin_um, index_zyx, self.spacing_um, strict=True)
        )
        return z, y, x


def choose_level(levels: Sequence[LevelLike], channels: int, settings: Settings) -> tuple[int, str]:
    """Return the resolution level to build, and the reason for it.

    It is the requested level, or the finest one with at most plan.max_voxels. The region is in
    voxels of the level that is built, so levels too small to hold it are skipped.

    Raises UsageError if there is no such level.
    """
    wanted = settings.plan.level
    if wanted != AUTO:
        if not isinstance(wanted, int) or not 0 <= wanted < len(levels):
            raise UsageError(
                f"--level is {wanted}, expected 0 to {len(levels) - 1}, the source's levels"
            )
        return wanted, "from the settings"
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
            reason = "the finest" if index == 0 else "the finest within the limit"
            if not channels:
                return index, f"{reason}, because only label maps are built"
            return index, f"{reason}: {voxels:,} of at most {limit:,} voxels (plan.max_voxels)"
    box_name = f"--region {region}" if region else "the coarsest level"
    remedy = "a smaller --region" if region else "a --level"
    raise UsageError(
        f"{box_name} holds {voxels:,} voxels, more than plan.max_voxels = {limit:,}: "
        f"name {remedy}, or fewer --channels"
    )


def make_plan(
    source: str,
    name: str,
    *,
    fingerprint: str,
    levels: Sequence[LevelLike],
    origin_um: Point,
    channels: Sequence[Channel],
    level: tuple[int, str],
    settings: Settings,
    formats: Collection[str],
    modality: str = "",
    placement: Matrix = IDENTITY,
    slice_axis: int = 0,
    has_sides: bool = False,
    labels: Sequence[Labels] = (),
) -> Plan:
    """Return the plan for these channels at this level.

    level      index of the resolution level, and the reason for it
    origin_um  centre of voxel (0, 0, 0) of the level, (z, y, x) in um

    Raises UsageError for settings that don't fit the data, SourceError for a region that is too
    small to be built.
    """
    chosen = levels[level[0]]
    whole = Box((0, 0, 0), chosen.shape)
    region = parse_region(settings.plan.region, whole)
    if min(region.shape) < 2:
        raise SourceError(
            f"{source}: found {_by(region.shape)} voxels (z, y, x) to build, expected at least 2 "
            "along each axis"
        )
    tile_size, tiles = _tiles(settings, region)
    if settings.surface.wrap == "alpha-wrap" and len(tiles) > 1:
        raise UsageError(
            f"surface.wrap is 'alpha-wrap', which closes each tile by itself, and the plan has "
            f"{len(tiles)} tiles, expected one tile: give --grid 1x1, or a --region of one tile"
        )
    settings = replace(
        settings,
        surface=settings.surface.resolved(chosen.spacing_um, _longest_um(chosen)),
        unwrap=settings.unwrap.resolved(chosen.spacing_um),
        plan=replace(settings.plan, level=level[0], tile_size=tile_size),
        iso_values=by_name("--iso-value", settings.iso_values, channels),
        windows=windows_of(settings.windows, channels, modality),
        paint=painted(settings.paint, channels, labels=[one.name for one in labels]),
    )
    _require_planes(settings, chosen.spacing_um)
    require_no_background(settings, channels, modality)
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
        slice_axis=slice_axis,
        has_sides=has_sides,
        labels=tuple(labels),
        formats=tuple(sorted(formats)),
    )


def _longest_um(level: LevelLike) -> float:
    """Return the longest edge of the whole field of view, um, even if only a region is built."""
    return max(n * step for n, step in zip(level.shape, level.spacing_um, strict=True))


def parse_region(text: str, whole: Box) -> Box:
    """Return the box of `z0:z1,y0:y1,x0:x1` in voxels; an empty end means the end of `whole`.

    Raises UsageError if the text isn't a box inside `whole`.

    >>> parse_region("4:8,:,10:", Box((0, 0, 0), (16, 32, 64)))
    Box(start=(4, 0, 10), stop=(8, 32, 64))
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
    """Return the size of the largest tile, (z, y, x) in voxels, and the tiles."""
    options = settings.plan
    if options.grid:
        match = re.fullmatch(r"([1-9]\d*)x([1-9]\d*)", options.grid)
        if not match:
            raise UsageError(f"--grid is {options.grid!r}, expected columns x rows, such as 5x2")
        columns, rows = int(match[1]), int(match[2])
        depth, height, width = region.shape
        if height < 2 * rows or width < 2 * columns:
            raise UsageError(
                f"--grid {options.grid} makes more tiles than {_by((height, width))} voxels (y, x) "
                "can fill, expected at least 2 voxels of a tile along each axis"
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
    spacing_um: Spacing,
    region: Box,
) -> tuple[int, int, int]:
    """Return the voxels (z, y, x) that a unit reads around its tile, at most the region's.

    Raises UsageError if these, and the voxels that closing and smoothing add at the ends, are too
    many for the tile. The lengths in the settings are then meant for larger voxels.
    """
    surface = settings.surface
    smoothing = SMOOTHING_REACH * float(surface.smoothing_um)
    every = _step_of(settings.surface.grid_um, spacing_um)
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
            f"surface: {found} make a tile of {_by(tile_size)} voxels read {z * y * x:.3g}, "
            f"expected at most {limit:,}: choose another --preset, smaller lengths or larger tiles"
        )
    # Four more planes: one for the median, one for the gradient, one because the last plane of a
    # tile belongs to its neighbour, and one beyond that plane (surface._least_on_plane).
    depth, height, width = (
        math.ceil(min(reach / step, n)) + 4 * k
        for n, step, k in zip(region.shape, spacing_um, every, strict=True)
    )
    return depth, height, width


def _step_of(grid_um: float, spacing_um: Sequence[float]) -> tuple[int, int, int]:
    # 0.01 absorbs rounding, so that 0.42 um is three times 0.14 um
    z, y, x = (max(1, int(grid_um / h + 0.01)) for h in spacing_um)
    return z, y, x


def _require_planes(settings: Settings, spacing_um: Sequence[float]) -> None:
    """Raise UsageError if planes lie so far apart that a tile keeps fewer than MIN_PLANES."""
    size = settings.plan.tile_size
    steps = _step_of(settings.surface.grid_um, spacing_um)
    for axis, n, k, h in zip("zyx", size, steps, spacing_um, strict=True):
        planes = -(-n // k)
        if k > 1 and planes < MIN_PLANES:
            raise UsageError(
                f"surface.grid_um is {settings.surface.grid_um:g}, which leaves {planes} of the "
                f"{n} planes along {axis} of a tile, {h:g} um apart, expected {MIN_PLANES} or "
                "more: choose another --preset, or a smaller surface.grid_um"
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
