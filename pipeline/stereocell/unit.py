"""The unit of work: one (tile, channel), from voxels to meshes and an 8-bit volume. Pure."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.config import Settings
from stereocell.denoise import denoise
from stereocell.latticefield import LatticeField
from stereocell.levels import Clock, make_levels
from stereocell.mesh import Lod, Mesh
from stereocell.repair import RepairOptions, repair
from stereocell.specimen import APRON
from stereocell.surface import cut_planes, extract_surface, signed_distance
from stereocell.tiling import Box
from stereocell.volume import Volume


@dataclass(frozen=True, slots=True)
class UnitInput:
    """What a unit depends on, besides its voxels.

    window, lattice, region  what was read, the tile's lattice points, all that is built (voxels)
    origin_um                where voxel (0, 0, 0) lies; the plan's, as every tile must use the same
    iso                      the iso-value near the tile, above the background; None: no surface
    background               what lies under it; None: nothing is subtracted
    display                  voxel values that become 0 and 255
    """

    window: Box
    lattice: Box
    region: Box
    origin_um: tuple[float, float, float]
    iso: LatticeField | None
    background: LatticeField | None
    display: tuple[float, float]
    settings: Settings


@dataclass(frozen=True, slots=True)
class Unit:
    """What a unit leaves.

    volume   uint8 (z, y, x): the lattice's voxels, window applied, APRON voxels more on every side
    reason   why there is no surface; empty if there is one
    seconds  by step
    """

    lods: tuple[Lod, ...]
    volume: NDArray[np.uint8]
    reason: str
    fragments_dropped: int
    cavities_filled: int
    seconds: dict[str, float]


def build_unit(volume: Volume, given: UnitInput) -> Unit:
    """Return meshes and volume of one unit. `volume` covers `given.window`.

    A unit whose part of the field never crosses the iso-value has no surface, and says so.
    """
    clock = Clock()
    with clock("volume"):
        eight_bit = to_eight_bit(volume.voxels, given)
    if given.iso is None:
        return Unit((), eight_bit, "the channel has no iso-value", 0, 0, clock.seconds)

    fine, dropped, filled = _fine_surface(volume, given, given.iso, clock)
    if not len(fine.triangles):
        reason = "no voxel crosses the iso-value"
        return Unit((), eight_bit, reason, dropped, filled, clock.seconds)
    planes = cut_planes(given.lattice, given.region, volume.spacing_um, given.origin_um)
    lods = make_levels(fine, planes, volume.spacing_um, given.settings, clock)
    return Unit(lods, eight_bit, "", dropped, filled, clock.seconds)


def _fine_surface(
    volume: Volume, given: UnitInput, iso: LatticeField, clock: Clock
) -> tuple[Mesh, int, int]:
    """Return the repaired surface, and the numbers of fragments dropped and cavities filled.

    A function of its own: its float32 copies of the window are gone when levels are made.
    """
    surface, spacing = given.settings.surface, volume.spacing_um
    with clock("distance"):
        field = denoise(volume, float(surface.smoothing_um))
        if given.background is not None:
            field -= given.background.at(given.window)
        value_range = given.display[1] - given.display[0]
        distance = signed_distance(field, iso.at(given.window), spacing, value_range)
        del field
    with clock("repair"):
        lengths = (surface.alpha_um, surface.min_diagonal_um, surface.max_cavity_um)
        repaired = repair(distance, spacing, RepairOptions(*(float(um) for um in lengths)))
    with clock("extract"):
        fine = extract_surface(
            repaired.distance, given.window, given.lattice, given.region, spacing, given.origin_um
        )
    return fine, repaired.fragments_dropped, repaired.cavities_filled


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
    low, high = given.display
    values = voxels[np.ix_(*index)].astype(np.float32)
    return np.round(np.clip((values - low) / (high - low), 0, 1) * 255).astype(np.uint8)
