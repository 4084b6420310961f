"""Build the unit of work, one (tile, channel): from voxels to meshes and an 8-bit volume.

No file is read or written here.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.filters.denoise import denoise
from stereocell.isosurface.cover import measure_cover
from stereocell.isosurface.distance_field import to_distance
from stereocell.isosurface.extract import extract_surface
from stereocell.isosurface.holder import Holder
from stereocell.isosurface.repair import Repaired, repair
from stereocell.isosurface.repair_options import RepairOptions
from stereocell.meshes.alpha_wrap import alpha_wrap
from stereocell.meshes.options import LodOptions
from stereocell.meshes.rims import thin_rims
from stereocell.model.lattice import Lattice, Step
from stereocell.model.lattice_field import LatticeField
from stereocell.model.mesh import Mesh
from stereocell.model.settings import EIGHT_BITS
from stereocell.model.timing import Clock
from stereocell.model.unit import Cover, Unit
from stereocell.model.volume import Volume
from stereocell.steps.closed_copy import close_tile
from stereocell.steps.cut_voxels import cut_voxels
from stereocell.textures.ambient_occlusion import find_ambient_visibility
from stereocell.textures.bake import FineSurface
from stereocell.textures.lod_chain import make_levels
from stereocell.textures.options import UnwrapOptions
from stereocell.textures.sample_channel import sample_channel
from stereocell.textures.texture_lod import Texturer, VertexValues
from stereocell.transfer.joint_histogram import to_eight_bits

RIM_ERROR = 0.3  # finest voxel spacings; largest error of the surface's rim where tiles meet
PAST = 3  # voxels beyond a cut from which maps are baked; less than the halo, more than a texel


@dataclass(frozen=True, slots=True)
class UnitOptions:
    """The settings that every unit depends on.

    smoothing_um  standard deviation of the smoothing before the surface is found
    closed_tiles  whether the tile's solid is kept as a closed mesh, too
    bits          EIGHT_BITS, or more if the voxels as measured are kept, too
    wrapper       version of the package for alpha wrapping; empty: it is not used
    unwrapper     version of the package that lays out maps; empty: there are no maps
    """

    smoothing_um: float
    closed_tiles: bool
    bits: int
    lod: LodOptions
    unwrap: UnwrapOptions
    wrapper: str = ""
    unwrapper: str = ""


@dataclass(frozen=True, slots=True)
class UnitInput:
    """The inputs of a unit, besides its voxels.

    lattice     places of its samples; the volumes cover its window
    iso         iso-value near the tile, above the background, voxel values; None: no surface
    background  background in voxel values; None: nothing is subtracted
    repair      cleaning of the channel's surface
    step        voxels (z, y, x) between the planes from which the surface is extracted
    intensity_window  voxel values that become 0 and 255
    painted     voxel values of the painted channel that become 0 and 1; None: none is painted
    holder      a CT's table or head holder, left out of surface and volume; None: there is none
    max_shift   most that smoothing may move a value, in voxel values; None: no bound
    """

    lattice: Lattice
    iso: LatticeField | None
    background: LatticeField | None
    repair: RepairOptions
    step: Step
    intensity_window: tuple[float, float]
    options: UnitOptions
    painted: tuple[float, float] | None = None
    holder: Holder | None = None
    max_shift: float | None = None


def build_unit(volume: Volume, given: UnitInput, *, painted: Volume | None = None) -> Unit:
    """Return meshes and volume of one unit.

    volume   voxels (z, y, x) of any dtype, which cover the lattice's window
    painted  voxels of the channel that is painted on the surface; None: none is

    If the field never crosses the iso-value, the unit has no surface and states the reason.
    """
    clock = Clock()
    unit = _build_surface(volume, given, painted, clock)
    with clock("volume"):  # last, because levels of detail take the most memory
        kept = cut_voxels(volume.voxels, given.lattice, given.holder)
        eight_bit = to_eight_bits(kept, given.intensity_window)
        measured = find_measured(kept, given)
    window = given.intensity_window
    return replace(unit, volume=eight_bit, measured=measured, window=window, seconds=clock.seconds)


def _build_surface(volume: Volume, given: UnitInput, painted: Volume | None, clock: Clock) -> Unit:
    """Return a unit with its surface, and without its volume."""
    if given.iso is None:
        return Unit((), None, None, "the channel has no iso-value", 0, 0, {})
    lattice = given.lattice.thinned(given.step)
    repaired, by_triangles = _repaired(volume, given, lattice, given.iso, clock)
    fine = _extract(repaired, by_triangles, given, lattice, clock)
    dropped, filled = repaired.fragments_dropped, repaired.cavities_filled
    with clock("cover"):
        cover = find_cover(volume, given, repaired)
    if not len(fine.triangles):
        reason = "no voxel crosses the iso-value"
        return Unit((), None, None, reason, dropped, filled, {}, cover=cover)
    closed = None
    if given.options.closed_tiles:
        with clock("close"):
            error = given.options.lod.errors[0] * min(volume.spacing_um)
            closed = close_tile(repaired.distance, lattice, max_error_um=error)
    shading = _Shading(repaired.distance, given, lattice, painted, clock)
    del repaired
    lods = make_levels(
        fine,
        lattice.cut_planes(),
        spacing_um=volume.spacing_um,
        lod=given.options.lod,
        clock=clock,
        box=lattice.own_box(),
        caps=lattice.cap_planes(),
        get_texturer=shading.texturer,
    )
    return Unit(lods, closed, None, "", dropped, filled, {}, cover=cover)


def find_surface(volume: Volume, given: UnitInput) -> tuple[Mesh, Cover | None]:
    """Return a unit's repaired iso-surface before levels of detail, and its cover.

    The surface may be empty. The cover states how many of the source's voxels the solid encloses;
    None: the channel has no level. Both are the same as in `build_unit`.
    """
    if given.iso is None:
        nothing = np.zeros((0, 3), np.float32)
        return Mesh(nothing, np.zeros((0, 3), np.uint32), nothing), None
    lattice = given.lattice.thinned(given.step)
    repaired, by_triangles = _repaired(volume, given, lattice, given.iso, Clock())
    cover = find_cover(volume, given, repaired)
    return _extract(repaired, by_triangles, given, lattice, Clock()), cover


def find_cover(volume: Volume, given: UnitInput, repaired: Repaired) -> Cover | None:
    """Return how many of the source's voxels a unit's solid encloses; None: there is no level."""
    if given.iso is None:
        return None
    return measure_cover(
        volume.voxels,
        repaired.distance,
        given.lattice,
        given.step,
        iso=given.iso,
        background=given.background,
        holder=given.holder,
    )


def _repaired(
    volume: Volume, given: UnitInput, lattice: Lattice, iso: LatticeField, clock: Clock
) -> tuple[Repaired, bool]:
    """Return the repaired distance field, and whether gaps are still to be closed by triangles.

    When this function returns, its float32 copies of the window are freed, before the levels of
    detail are made.
    """
    options, spacing = given.options, lattice.spacing_um
    with clock("distance"):
        field = denoise(volume, options.smoothing_um, given.max_shift)
        if given.background is not None:
            field -= given.background.at(given.lattice.window)
        field -= iso.at(given.lattice.window)
        value_range = given.intensity_window[1] - given.intensity_window[0]
        if given.holder is not None:
            outside = np.float32(-value_range)
            np.minimum(field, outside, out=field, where=given.holder.at(given.lattice.window))
        if given.step != (1, 1, 1):
            field = np.ascontiguousarray(field[given.lattice.slices_of_thinned(given.step)])
        to_distance(field, spacing_um=spacing, value_range=value_range)
    with clock("repair"):
        by_triangles = bool(options.wrapper) and given.repair.alpha_um > 0
        plain = replace(given.repair, alpha_um=0.0, offset_um=0.0) if by_triangles else given.repair
        return repair(field, spacing, options=plain), by_triangles


def _extract(
    repaired: Repaired, by_triangles: bool, given: UnitInput, lattice: Lattice, clock: Clock
) -> Mesh:
    with clock("extract"):
        fine = extract_surface(repaired.distance, lattice)
        error_um = RIM_ERROR * min(lattice.spacing_um)
        fine = thin_rims(fine, repaired.distance, lattice, error_um=error_um)
    if by_triangles and len(fine.triangles):
        with clock("wrap"):
            fine = alpha_wrap(fine, given.repair.alpha_um, given.repair.offset_um)
    return fine


class _Shading:
    """Ambient occlusion and painted channel, at vertices and in maps of all levels of detail.

    The distance field is kept only if there are maps. Otherwise the solid is enough. It is kept as
    a bit a voxel, because levels of detail are made before it is needed.
    """

    def __init__(
        self,
        distance: NDArray[np.float32],
        given: UnitInput,
        lattice: Lattice,
        painted: Volume | None,
        clock: Clock,
    ) -> None:
        self._given, self._lattice, self._painted, self._clock = given, lattice, painted, clock
        self._options = given.options.unwrap.resolved(given.lattice.spacing_um)
        # slightly smaller than the surface, so that rays from the surface start outside
        self._solid = np.packbits(distance > 0.25 * max(lattice.spacing_um))
        self._shape = distance.shape
        self._distance = distance if self._options.maps else None

    def texturer(self, mesh: Mesh, number: NDArray[np.int64]) -> Texturer:
        """Return the Texturer for the levels of detail of a finest mesh; see `make_levels`."""
        with self._clock("occlude"):
            values = VertexValues(self._openness(mesh), self._paint(mesh))
        return Texturer(self._options, values, self._source, self._clock)

    def _source(self) -> FineSurface:
        """Return the fine surface with its values; it reaches PAST voxels beyond the cut."""
        assert self._distance is not None
        past = self._lattice.grown(PAST)
        mesh = extract_surface(self._distance, past, cut_as=self._lattice)
        return FineSurface(mesh, self._openness(mesh, thinned=True), self._paint(mesh))

    def _openness(self, mesh: Mesh, thinned: bool = False) -> NDArray[np.float32]:
        radius_um = float(self._options.occlusion_um)
        solid = np.unpackbits(self._solid, count=math.prod(self._shape)).view(bool)
        return find_ambient_visibility(
            solid.reshape(self._shape), self._lattice, mesh, radius_um=radius_um, thinned=thinned
        )

    def _paint(self, mesh: Mesh) -> NDArray[np.float32] | None:
        if self._painted is None or self._given.painted is None:
            return None
        return sample_channel(
            self._painted,
            self._given.lattice,
            mesh,
            intensity_window=self._given.painted,
            depth_um=float(self._options.paint_um),
        )


def find_measured(kept: NDArray[Any], given: UnitInput) -> NDArray[Any] | None:
    """Return the voxels as measured, for the stage; None: it keeps only the 8-bit volume.

    kept  voxels as `cut_voxels` returns them
    """
    if given.options.bits == EIGHT_BITS:
        return None
    is_same = kept.dtype == np.uint8 and given.intensity_window == (0, 255)
    return None if is_same else kept
