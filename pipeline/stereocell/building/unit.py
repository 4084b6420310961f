"""The unit of work: one (tile, channel), from voxels to meshes and an 8-bit volume. Pure."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.building.closed_copy import close_tile
from stereocell.building.settings import Settings
from stereocell.filters.denoise import denoise
from stereocell.isosurface.extract import cut_planes, extract_surface, signed_distance
from stereocell.isosurface.repair import Repaired, RepairOptions, repair
from stereocell.meshes.alpha_wrap import alpha_wrap
from stereocell.model.channel import APRON
from stereocell.model.lattice_field import LatticeField
from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box
from stereocell.model.timing import Clock
from stereocell.model.unit import Closed, Unit
from stereocell.model.volume import Volume
from stereocell.textures.ambient_occlusion import find_openness
from stereocell.textures.bake import FineSurface
from stereocell.textures.lod_chain import make_levels
from stereocell.textures.options import UnwrapOptions
from stereocell.textures.sample_channel import find_paint
from stereocell.transfer.joint_histogram import to_eight_bits

PAST = 3  # voxels past a cut that maps are baked from: the halo is larger, and texels smaller


@dataclass(frozen=True, slots=True)
class UnitInput:
    """What a unit depends on, besides its voxels.

    window, lattice, region  what was read, the tile's lattice points, all that is built (voxels)
    origin_um                where voxel (0, 0, 0) lies; the plan's, as every tile must use the same
    iso                      the iso-value near the tile, above the background; None: no surface
    background               what lies under it; None: nothing is subtracted
    repair                   what is cleaned of the channel's surface
    step                     every so many planes of voxels (z, y, x) carry the surface
    display                  voxel values that become 0 and 255
    painted                  those of the channel that is painted on the surface; None: no paint
    """

    window: Box
    lattice: Box
    region: Box
    origin_um: tuple[float, float, float]
    iso: LatticeField | None
    background: LatticeField | None
    repair: RepairOptions
    step: tuple[int, int, int]
    display: tuple[float, float]
    settings: Settings
    painted: tuple[float, float] | None = None


def build_unit(volume: Volume, given: UnitInput, painted: Volume | None = None) -> Unit:
    """Return meshes and volume of one unit. `volume` covers `given.window`, as does `painted`, the
    channel that is painted on the surface.

    A unit whose part of the field never crosses the iso-value has no surface, and says so.
    """
    clock = Clock()
    with clock("volume"):
        eight_bit = to_eight_bit(volume.voxels, given)
    if given.iso is None:
        return Unit((), None, eight_bit, "the channel has no iso-value", 0, 0, clock.seconds)

    frame = _frame(volume.spacing_um, given)
    fine, closed, source, dropped, filled = _fine_surface(
        volume, given, frame, given.iso, painted, clock
    )
    if not len(fine.triangles):
        reason = "no voxel crosses the iso-value"
        return Unit((), None, eight_bit, reason, dropped, filled, clock.seconds)
    planes = cut_planes(frame.lattice, frame.region, frame.spacing_um, frame.origin_um)
    lods = make_levels(
        fine,
        planes,
        spacing_um=volume.spacing_um,
        lod=given.settings.lod,
        unwrap=given.settings.unwrap,
        clock=clock,
        source=source,
    )
    return Unit(lods, closed, eight_bit, "", dropped, filled, clock.seconds)


@dataclass(frozen=True, slots=True)
class _Frame:
    """The boxes, in planes that carry the surface, their distances (z, y, x), where they begin."""

    window: Box
    lattice: Box
    region: Box
    spacing_um: tuple[float, float, float]
    origin_um: tuple[float, float, float]


def _frame(spacing_um: tuple[float, float, float], given: UnitInput) -> _Frame:
    step, region = given.step, given.region
    if step == (1, 1, 1):
        return _Frame(given.window, given.lattice, region, spacing_um, given.origin_um)
    z, y, x = (h * k for h, k in zip(spacing_um, step, strict=True))
    first = zip(given.origin_um, region.start, spacing_um, strict=True)
    oz, oy, ox = (origin + start * h for origin, start, h in first)
    return _Frame(
        given.window.thinned(region, step),
        given.lattice.thinned(region, step, outward=True),
        region.thinned(region, step),
        (z, y, x),
        (oz, oy, ox),
    )


def _thin(field: NDArray[np.float32], given: UnitInput, frame: _Frame) -> NDArray[np.float32]:
    """Return the voxels of the window's planes that carry the surface."""
    places = zip(
        frame.window.start, given.region.start, given.window.start, given.step, strict=True
    )
    part = tuple(slice(a * k + first - low, None, k) for a, first, low, k in places)
    return np.ascontiguousarray(field[part])


def find_surface(volume: Volume, given: UnitInput) -> Mesh:
    """Return a unit's iso-surface, repaired, before any level of detail is made of it; it may be
    empty. The same numbers as in `build_unit`.
    """
    if given.iso is None:
        nothing = np.zeros((0, 3), np.float32)
        return Mesh(nothing, np.zeros((0, 3), np.uint32), nothing)
    frame = _frame(volume.spacing_um, given)
    return _extract(*_repaired(volume, given, frame, given.iso, Clock()), given, frame, Clock())


def _repaired(
    volume: Volume, given: UnitInput, frame: _Frame, iso: LatticeField, clock: Clock
) -> tuple[Repaired, bool]:
    """Return the repaired distance, and whether gaps are still to be closed by triangles.

    A function of its own: its float32 copies of the window are gone when levels are made.
    """
    surface, spacing = given.settings.surface, frame.spacing_um
    with clock("distance"):
        field = denoise(volume, float(surface.smoothing_um))
        if given.background is not None:
            field -= given.background.at(given.window)
        field -= iso.at(given.window)
        if given.step != (1, 1, 1):
            field = _thin(field, given, frame)
        value_range = given.display[1] - given.display[0]
        distance = signed_distance(field, np.zeros(1, np.float32), spacing, value_range)
        del field
    with clock("repair"):
        by_triangles = surface.wrap == "alpha-wrap" and given.repair.alpha_um > 0
        options = (
            replace(given.repair, alpha_um=0.0, offset_um=0.0) if by_triangles else given.repair
        )
        return repair(distance, spacing, options), by_triangles


def _extract(
    repaired: Repaired, by_triangles: bool, given: UnitInput, frame: _Frame, clock: Clock
) -> Mesh:
    with clock("extract"):
        fine = extract_surface(
            repaired.distance,
            frame.window,
            frame.lattice,
            frame.region,
            frame.spacing_um,
            frame.origin_um,
        )
    if by_triangles and len(fine.triangles):
        with clock("wrap"):
            fine = alpha_wrap(fine, given.repair.alpha_um, given.repair.offset_um)
    return fine


def _fine_surface(
    volume: Volume,
    given: UnitInput,
    frame: _Frame,
    iso: LatticeField,
    painted: Volume | None,
    clock: Clock,
) -> tuple[Mesh, Closed | None, FineSurface, int, int]:
    """Return the repaired surface, its closed copy, what maps are baked from, and the numbers of
    fragments dropped and cavities filled.
    """
    repaired, by_triangles = _repaired(volume, given, frame, iso, clock)
    fine = _extract(repaired, by_triangles, given, frame, clock)
    boxes, spacing = (frame.window, frame.lattice), frame.spacing_um
    closed = None
    if given.settings.surface.closed_tiles:
        with clock("close"):
            error = given.settings.lod.errors[0] * min(volume.spacing_um)
            closed = close_tile(repaired.distance, *boxes, spacing, frame.origin_um, error)
    with clock("occlude"):
        unwrapping = given.settings.unwrap.resolved(volume.spacing_um)
        source = _with_surroundings(fine, repaired.distance, given, frame, unwrapping, painted)
    return fine, closed, source, repaired.fragments_dropped, repaired.cavities_filled


def _with_surroundings(
    fine: Mesh,
    distance: NDArray[np.float32],
    given: UnitInput,
    frame: _Frame,
    options: UnwrapOptions,
    painted: Volume | None,
) -> FineSurface:
    """Return the surface, some voxels past the cut, with how open it lies and what is painted."""
    origin, spacing = frame.origin_um, frame.spacing_um
    lattice = frame.lattice.grown((PAST, PAST, PAST), frame.region)
    mesh = fine
    if lattice != frame.lattice:
        boxes = frame.window, lattice, frame.region
        mesh = extract_surface(distance, *boxes, spacing, origin, cuts=frame.lattice)
    where = mesh.positions, mesh.normals
    # a little smaller: rays start outside of it
    solid = distance > 0.25 * max(spacing)
    radius, depth = float(options.occlusion_um), float(options.paint_um)
    openness = find_openness(solid, frame.window, *where, spacing, origin, radius)
    paint = None
    if painted is not None and given.painted is not None:
        paint = find_paint(painted, given.window, given.painted, *where, given.origin_um, depth)
    return FineSurface(mesh, openness, paint)


def to_eight_bit(voxels: NDArray[Any], given: UnitInput) -> NDArray[np.uint8]:
    """Return the lattice's voxels and an apron, window applied; ends of the region repeat."""
    index = [
        np.clip(np.arange(a - APRON, b + APRON), low, high - 1) - w
        for a, b, low, high, w in zip(
            given.lattice.start,
            given.lattice.stop,
            given.region.start,
            given.region.stop,
            given.window.start,
            strict=True,
        )
    ]
    return to_eight_bits(voxels[np.ix_(*index)], given.display)
