"""Compare a stage with its source: recompute the surfaces and volumes of each unit from voxels.

The reference for surfaces is the iso-surface of the unit's own voxels, before levels of detail are
made. A coarse level leaves out small connected components by rule (meshes/small_bodies.py); its
reference does so, too. Distances are measured from each level to the reference and back. Two of
them are compared with the unit's record: the 99th percentile over both areas, by the same measure
as a level's stated distance, and the largest one, vertices included. Surfaces must face the same
way. Normals, occlusion, maps and UVs must equal the unit's. Every voxel of a volume is compared in
8 bits, and the content of the stage's .vdb (formats/vdb.py).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from stereocell.formats.exr import read_atlas
from stereocell.formats.vdb import is_vdb_of
from stereocell.meshes.distance import Nearest, measure_facing, measure_spread
from stereocell.meshes.small_bodies import SmallBodies
from stereocell.model.errors import StereoCellError
from stereocell.model.mesh import Lod, Mesh
from stereocell.model.rigid_transform import IDENTITY, Matrix
from stereocell.model.tile_content import APRON
from stereocell.model.unit import Cover
from stereocell.steps.build_unit import BuildUnit
from stereocell.steps.cut_voxels import cut_voxels
from stereocell.steps.unit import UnitInput, find_measured, find_surface
from stereocell.steps.unit_files import cover_of, load_lods, load_quality, load_record
from stereocell.transfer.joint_histogram import to_eight_bits
from stereocell.usd.read_levels import ComposedLod, read_lods
from stereocell.usd.read_stage import loaded, open_stage
from stereocell.usd.read_volume import ComposedVolume, read_volume

# Tolerance of a distance, as a share and in um, for float32 and another order of triangles.
_SHARE, _HAIR_UM = 0.02, 1e-3
_STEP = 1e-6  # largest difference of equal values, 0..1
_ALONG = 1 - 1e-6  # smallest cosine between equal normals, which is 0.08 degrees


@dataclass(frozen=True, slots=True)
class SourceTask:
    """One unit (a channel in a tile), and the stage that holds its result.

    first_um       (z, y, x), um, centre of the unit's first voxel without the apron
    own_shape      (z, y, x), voxels of the unit without the apron
    placement      rows of a (4, 4) matrix for columns, um, from the voxels' world to the stage's
    samples        number of points that are spread over each surface
    shares_volume  whether the channel's volume is that of another channel, so it has none itself
    has_vdb        whether the volumes are also written as .vdb, for other programs
    """

    unit: BuildUnit
    directory: Path
    stage_file: Path
    tile_id: str
    channel_id: str
    first_um: tuple[float, float, float]
    own_shape: tuple[int, int, int]
    spacing_um: tuple[float, float, float]
    placement: Matrix
    samples: int
    shares_volume: bool = False
    has_vdb: bool = True

    @property
    def inputs(self) -> list[Path]:
        """The folder of the unit. The tile's folder is fetched when its payload is loaded."""
        return [self.directory]


@dataclass(frozen=True, slots=True)
class UnitFinding:
    """The result of comparing one unit (a channel in a tile).

    levels  of each level, um: the distance that the stage states, and the distance (99th
            percentile) and the largest distance that were found
    cover   numbers of the source's voxels that the surface covers and leaves out; None without an
            iso-value
    """

    name: str
    levels: tuple[tuple[float, float, float], ...]
    problems: tuple[str, ...]
    cover: Cover | None


def compare_unit(task: SourceTask) -> UnitFinding:
    """Compare a unit's part of the stage with its voxels. Raises StereoCellError if unreadable."""
    given = task.unit.given
    volume = task.unit.voxels.read(given.lattice.window)
    fine, cover = find_surface(volume, given)
    problems = []
    stage = open_stage(task.stage_file)
    with loaded(stage, task.tile_id) as (tile, _):
        lods = list(read_lods(tile, task.channel_id))
        composed = read_volume(tile, task.channel_id)
        record = load_record(task.directory)
        if cover_of(record) != cover:
            problems.append("the share of voxels inside its surface differs from the record")
        surfaces = _Surfaces(fine, given, task.placement, task.samples)
        levels, faults = _compare_lods(surfaces, lods, record)
        problems += faults
        problems += _compare_shading(lods, load_lods(task.directory), task.placement)
        if composed is None and not task.shares_volume:
            problems.append("found no volume in the stage, expected one")
        elif composed is not None:
            problems += _compare_volume(
                cut_voxels(volume.voxels, given.lattice, given.holder), composed, task
            )
    return UnitFinding(f"{task.tile_id}/{task.channel_id}", levels, tuple(problems), cover)


def _placed(mesh: Mesh, placement: Matrix) -> Mesh:
    if placement == IDENTITY:
        return mesh
    move = np.array(placement)
    positions = mesh.positions.astype(np.float64) @ move[:3, :3].T + move[:3, 3]
    return Mesh(positions.astype(np.float32), mesh.triangles, mesh.normals)


class _Surfaces:
    """The iso-surface of a unit, and the reference of each level.

    A level's reference is the iso-surface without the small components that the level leaves out.
    """

    def __init__(self, fine: Mesh, given: UnitInput, placement: Matrix, samples: int) -> None:
        self.samples = samples
        self.triangles = fine.triangles
        self._errors = given.options.lod.errors
        self._spacing = min(given.lattice.spacing_um)
        self._bodies = SmallBodies(fine)
        self._placed = _placed(fine, placement)
        self._known: dict[int, Nearest] = {}  # by the number of vertices that are left out

    def at(self, level: int) -> Nearest:
        """Return the reference surface of a level of detail."""
        error = self._errors[min(level, len(self._errors) - 1)] * self._spacing
        gone = self._bodies.find(error)
        if 0 not in self._known:
            self._known[0] = Nearest(self._placed, self.samples)
        # Components are left out in a fixed order, so the number of vertices identifies them.
        count = int(gone.sum())
        if count not in self._known:
            self._known[count] = self._known[0].without(gone)
        return self._known[count]


def _compare_lods(
    surfaces: _Surfaces, lods: list[ComposedLod], record: dict[str, Any]
) -> tuple[tuple[tuple[float, float, float], ...], list[str]]:
    if not len(surfaces.triangles) or not lods:
        if len(surfaces.triangles):
            return (), [
                f"found no surface in the stage, expected one as in the source, which gives "
                f"{len(surfaces.triangles)} triangles"
            ]
        return (), ["found a surface, expected none, as the source gives none"] if lods else []
    problems = []
    if len(lods) < len(record["lods"]):
        problems.append(f"found {len(lods)} levels of detail, expected {len(record['lods'])}")
    levels = []
    for lod in lods:
        to_fine = surfaces.at(lod.level)
        stored = record["lods"][min(lod.level, len(record["lods"]) - 1)]
        to_mesh = Nearest(lod.mesh, surfaces.samples)
        there, back = measure_spread(to_fine, to_mesh), measure_spread(to_mesh, to_fine)
        found, largest = max(there.p99, back.p99), max(there.max, back.max)
        levels.append((lod.distance_um, found, largest))
        name = f"lod{lod.level}"
        if found > _slack(lod.distance_um):
            problems.append(
                f"{name}: found {found:.4g} um to the iso-surface, expected {lod.distance_um:.4g} "
                "as stated"
            )
        if largest > _slack(lod.largest_um):
            problems.append(
                f"{name}: found {largest:.4g} um as the largest distance, expected "
                f"{lod.largest_um:.4g} as stated"
            )
        if measure_facing(to_mesh, to_fine) < 0:
            problems.append(f"{name}: its triangles face inwards")
        quality = load_quality(stored["quality"])
        most_um = max(stored["distance_um"], quality.away.max, quality.back.max)
        for stated, built in ((lod.distance_um, stored["distance_um"]), (lod.largest_um, most_um)):
            if abs(stated - built) > _HAIR_UM + 1e-5 * built:
                problems.append(
                    f"{name}: the stage states {stated:.4g} um, expected {built:.4g} as in the unit"
                )
    return tuple(levels), problems


def _compare_shading(
    lods: list[ComposedLod], built: tuple[Lod, ...], placement: Matrix
) -> list[str]:
    """Return problems of normals, occlusion and maps that differ from the unit's."""
    odd = []
    for lod in lods:
        wanted = built[min(lod.level, len(built) - 1)]
        for part in _odd_shading(lod, wanted, placement):
            odd.append(f"lod{lod.level}: differs from the unit in its {part}")
    return odd


def _odd_shading(lod: ComposedLod, wanted: Lod, placement: Matrix) -> Iterator[str]:
    mesh, maps, baked = lod.mesh, lod.maps, wanted.baked
    if mesh.normals.shape != wanted.mesh.normals.shape:
        if maps.normal is not None and mesh.uvs is not None and wanted.mesh.uvs is not None:
            yield "UVs"
        return  # the vertices differ; their distances are compared elsewhere
    if not _are_alike(mesh.normals, wanted.mesh.normals, placement):
        yield "normals"
    if wanted.normal_map is None:
        if baked is not None and not _is_like(mesh.openness, baked.openness / 255.0):
            yield "occlusion at vertices"
        return
    if not _is_like(mesh.uvs, wanted.mesh.uvs):
        yield "UVs"
    if not _is_image(maps.normal, wanted.normal_map):
        yield "normal map"
    if baked is not None and not _is_image(maps.occlusion, baked.openness):
        yield "occlusion map"


def _are_alike(found: NDArray[np.float32], built: NDArray[np.float32], placement: Matrix) -> bool:
    """Return whether normals (n, 3) are those of the unit, turned by its placement."""
    if placement == IDENTITY and np.array_equal(found, built):
        return True
    turned = built.astype(np.float64) @ np.linalg.inv(np.array(placement)[:3, :3])
    cosines = np.einsum("nk,nk->n", _unit(found), _unit(turned))
    return bool(cosines.min(initial=1) >= _ALONG)


def _unit(vectors: NDArray[Any]) -> NDArray[np.float64]:
    wide = vectors.astype(np.float64)
    return np.asarray(wide / np.maximum(np.linalg.norm(wide, axis=1, keepdims=True), 1e-12))


def _is_like(found: NDArray[Any] | None, wanted: NDArray[Any] | None) -> bool:
    if found is None or wanted is None:
        return found is wanted
    return found.shape == wanted.shape and bool(np.abs(found - wanted).max(initial=0) <= _STEP)


def _is_image(file: Path | None, wanted: NDArray[np.uint8]) -> bool:
    """Return whether a file is an image of these pixels, uint8 (y, x) or (y, x, 3).

    Raises StereoCellError if the file can't be read.
    """
    if file is None:
        return False
    try:
        with Image.open(file) as image:
            found = np.asarray(image)
    except OSError as error:
        raise StereoCellError(f"{file}: can't be read ({error}), expected an image") from error
    return np.array_equal(found, wanted)


def _slack(um: float) -> float:
    return um * (1 + _SHARE) + _HAIR_UM


def _compare_volume(kept: NDArray[Any], composed: ComposedVolume, task: SourceTask) -> list[str]:
    problems, given = [], task.unit.given
    eight_bit, measured = to_eight_bits(kept, given.intensity_window), find_measured(kept, given)
    atlas, vdb = composed.atlas, composed.field
    stored = read_atlas(atlas)
    if stored.shape != eight_bit.shape:
        return [
            f"{atlas.name}: found {stored.shape} voxels (z, y, x), expected {eight_bit.shape} as "
            "in the source"
        ]
    wrong = int((stored != eight_bit).sum())
    if wrong:
        problems.append(f"{atlas.name}: {wrong} of {stored.size} voxels differ from the source")
    own = eight_bit[tuple(slice(APRON, APRON + n) for n in task.own_shape)]
    if not task.has_vdb:
        extra = next((file for file in (vdb, composed.measured) if file), None)
        return [*problems, f"{extra.name}: found a field, expected none"] if extra else problems
    if vdb is None:
        return [*problems, "found no field with a file in its volume, expected one"]
    wanted = None if measured is None else vdb
    if composed.measured != wanted:
        found, expected = (file or "none" for file in (composed.measured, wanted))
        problems.append(f"its measured voxels: found {found}, expected {expected}")
    try:
        is_same = is_vdb_of(
            vdb,
            own,
            first_um=task.first_um,
            spacing_um=task.spacing_um,
            measured=measured,
            apron=APRON,
        )
    except OSError as error:
        raise StereoCellError(f"{vdb}: {error.strerror}") from error
    if not is_same:
        problems.append(f"{vdb.name}: differs from the file that the source gives")
    return problems
