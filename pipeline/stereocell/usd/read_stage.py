"""Read the tiles of a composed stage, including all layers that an artist put over it.

All values pass pxr's composition: colours, visibility, moved tiles, chosen variants. The levels of
detail are variants; the reader selects one after the other in the session layer.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Ar, Sdf, Tf, Usd, UsdGeom, UsdUtils, UsdVol

from stereocell.formats.gltf import Material
from stereocell.formats.vdb import GRID_NAME, MEASURED_NAME
from stereocell.model.errors import StageError
from stereocell.model.mesh import Mesh
from stereocell.storage.location import Location, require_own
from stereocell.storage.workspace import cached
from stereocell.usd.layer import (
    CHANNELS,
    DISTANCE,
    LARGEST_DISTANCE,
    PATIENT_API,
    ROOT,
    SHAPE_HASH,
    SIDES,
    TILES,
    hash_shape,
    move_box,
)
from stereocell.usd.layer_units import require_units
from stereocell.usd.read_appearances import material_of, surface_of
from stereocell.usd.read_attributes import (
    Point,
    file_of,
    numbers_of,
    point_of,
    require_still,
    select_variant,
    shortest,
    sizes_of,
)
from stereocell.usd.read_mesh import LargeFaceError, read_mesh
from stereocell.usd.read_objects import without_hidden
from stereocell.usd.read_textures import ComposedMaps, maps_of, vertex_values_of
from stereocell.usd.read_variants import TileChoice, lod_levels, read_choice
from stereocell.usd.typed_values import one_line, read_as, text_of
from stereocell.usd.written_files import AsWritten

_PERSPECTIVE = 1e-9  # largest deviation of an affine matrix's last column
_SIDE_DIGITS = 9  # decimals of the unit vectors to a patient's sides: scanners state fewer
_Types = Sdf.ValueTypeNames
_FARTHEST_UM = 1e12  # um, largest distance from the origin that float32 and browsers still draw


@dataclass(frozen=True, slots=True)
class MadeMaps:
    """Maps of a recomputed level, uint8: normals (h, w, 3), openness (h, w), sRGB (h, w, 3)."""

    normal: NDArray[np.uint8] | None
    occlusion: NDArray[np.uint8] | None
    color: NDArray[np.uint8] | None


@dataclass(frozen=True, slots=True)
class ComposedLod:
    """One level of detail, in world um. `level` counts from the finest, 0.

    matrix  (4, 4) for row vectors, from the mesh's own space to world um
    distance_um  99th percentile of the distances from the iso-surface, and back
    largest_um   the largest of them; the former, where a stage of an earlier version has none
    shape   hash of the composed points and faces
    built   the same hash as the pipeline wrote it; empty: the stage has none
    own     the mesh prim's own transform
    lost    values that an edit invalidated: they belong to other vertices
    images  maps in memory, where the level was recomputed: see bundle/edited_meshes.py
    """

    level: int
    mesh: Mesh
    distance_um: float
    largest_um: float
    material: Material
    maps: ComposedMaps
    matrix: NDArray[np.float64]
    shape: str
    built: str
    own: tuple[float, ...]
    lost: tuple[str, ...] = ()
    images: MadeMaps | None = None


@dataclass(frozen=True, slots=True)
class ComposedVolume:
    """One volume: the file with its voxels, and its place.

    field       the .vdb that other programs draw; None: the stage names none
    measured    the .vdb with the voxels as they were measured; None: they are not kept
    size        voxels (x, y, z) with the apron
    apron       voxels on each side
    low, high   corners (x, y, z) in um of the box inside the apron, before `matrix`
    matrix      (4, 4) for row vectors, to world um
    """

    atlas: Path
    field: Path | None
    measured: Path | None
    size: tuple[int, int, int]
    apron: int
    low: Point
    high: Point
    matrix: NDArray[np.float64]


def open_stage(path: Path) -> Usd.Stage:
    """Open a stage without its payloads.

    Raises StageError where it can't, or for a layer of other units, up axis or default prim.
    """
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # USD would print the errors raised here
    try:
        stage = Usd.Stage.Open(str(path), Usd.Stage.LoadNone)
    except Tf.ErrorException as error:
        raise StageError(
            f"{path}: can't be opened, expected a USD layer (.usda, .usdc, .usd, .usdz): "
            f"{one_line(error)}"
        ) from error
    finally:
        del quiet
    _check_composition(stage)
    require_units(stage)
    for needed in (ROOT, CHANNELS, TILES):
        if not stage.GetPrimAtPath(needed):
            raise StageError(f"{path}: no prim {needed}, expected a StereoCell stage")
    return stage


def dependencies(path: Path, stage_dir: Path) -> list[Path]:
    """Return every file of a stage: layers, including unselected ones, and assets.

    path       the stage's layer; `stage_dir` is the folder of the stage below it

    Only files in the folder of `path`, in `stage_dir` or below are opened. Raises StageError for a
    file outside them. Files that can't be opened are skipped: `open_stage` reports them.
    """
    folders = [Location.of(path).folder, Location.of(stage_dir).folder]
    files, names, waiting = {path}, {str(path)}, [str(path)]
    quiet = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        while waiting:
            for asset, name in _named_in(waiting.pop()):
                file = Path(Ar.SplitPackageRelativePathOuter(name)[0])  # of an entry: its .usdz
                if name in names or not require_own(file, folders, named=asset, raised=StageError):
                    continue
                files.add(file)
                names.add(name)
                if Sdf.FileFormat.FindByExtension(name) is not None:
                    waiting.append(name)
    finally:
        del quiet
    return sorted(file for file in files if file.is_file())


def may_be_image(file: Path) -> bool:
    """Return whether a file of a stage may be, or hold, an image that feeds a surface.

    Layers hold none, .vdb and .exr are volumes and transfer functions, and `read_image` reads no
    .exr.
    """
    return file.suffix.lower() not in (".usd", ".usda", ".usdc", ".vdb", ".exr")


def _named_in(name: str) -> Iterator[tuple[str, str]]:
    """Yield the references of one layer: their names for messages, and the paths that USD opens."""
    try:
        layer = Sdf.Layer.FindOrOpen(name)
        named = chain(*UsdUtils.ExtractExternalReferences(name)) if layer else ()
    except Tf.ErrorException:
        return
    if layer and layer.expressionVariables:  # layers above can change the paths
        raise StageError(f"{name}: expressionVariables: found some, expected paths without them")
    for asset in named:
        path = Sdf.ComputeAssetPathRelativeToLayer(layer, Sdf.Layer.SplitIdentifier(asset)[0])
        found = str(Ar.GetResolver().Resolve(path))
        if found:
            yield f"{name}: {asset!r}", found


def specimen_name(stage: Usd.Stage) -> str:
    """Return the display name of /Specimen; without one, the prim's name."""
    root = stage.GetPrimAtPath(ROOT)
    return str(root.GetDisplayName() or root.GetName())


def modality_of(stage: Usd.Stage) -> str:
    """Return DICOM's code of the modality, `MR` or the like; empty: the stage states none."""
    return text_of(stage.GetPrimAtPath(ROOT).GetAttribute("stereocell:modality"))


def sides_of(stage: Usd.Stage) -> dict[str, Point] | None:
    """Return where the patient's sides are: unit vectors, world; None: the stage does not state it.

    They are turned, and mirrored, as the group of the tiles is. Raises StageError for a side that
    is no direction.
    """
    group = stage.GetPrimAtPath(TILES)
    if PATIENT_API not in group.GetAppliedSchemas():
        return None
    to_world = _to_world(group)[:3, :3]
    sides = {}
    for side, name in SIDES.items():
        along = np.array(point_of(group, name)) @ to_world
        length = np.linalg.norm(along)
        if not length > 0:
            raise StageError(f"{group.GetPath()}.{name}: found no length, expected a direction")
        x, y, z = (float(part) for part in np.round(along / length, _SIDE_DIGITS) + 0.0)
        sides[side] = (x, y, z)
    return sides


def tile_prims(stage: Usd.Stage) -> list[Usd.Prim]:
    """Return the tiles that are active and visible, loaded or not, in the stage's order."""
    kept = Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract
    prims = stage.GetPrimAtPath(TILES).GetFilteredChildren(kept)
    return [prim for prim in prims if _is_visible(prim)]


def hinted_box(tile: Usd.Prim) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower and upper corner (x, y, z), world um, of a tile's extentsHint.

    The tile need not be loaded. Raises StageError where it has no hint or an invalid one.
    """
    attribute = UsdGeom.ModelAPI(tile).GetExtentsHintAttr()
    hint = read_as(attribute, _Types.Float3Array, may_be_nan=True)
    if not hint:
        raise StageError(f"{tile.GetPath()}.extentsHint: no value")
    corners = np.array(hint, np.float64)
    if len(corners) < 2 or not np.abs(corners).max() <= _FARTHEST_UM:
        raise StageError(f"{tile.GetPath()}.extentsHint: found {hint!s:.60}, expected two corners")
    return move_box(corners[0], corners[1], _to_world(tile))


@contextmanager
def loaded(
    stage: Usd.Stage, tile_id: str, *, as_written: AsWritten | None = None
) -> Iterator[tuple[Usd.Prim, TileChoice]]:
    """Yield a tile's prim with its payload loaded, and its selected variants.

    as_written  the lists to compare the tile's files with; None: no comparison

    Its meshes and volumes are both active, for any selection. Raises StageError where the
    payload can't be composed, or where a layer differs from its list as a damaged one does.
    """
    path = TILES.AppendChild(tile_id)
    with cached(Path(stage.GetRootLayer().realPath).parent / "tiles" / tile_id):
        if as_written is not None:
            for folder in _stage_folders(stage):
                as_written.require_layers(folder / "tiles" / tile_id)
        yield from _loaded(stage, path)


def _stage_folders(stage: Usd.Stage) -> list[Path]:
    """Return the folders of a stage's layers, without its payloads."""
    paths = [layer.realPath for layer in stage.GetUsedLayers() if layer.realPath]
    return sorted({Path(path).parent for path in paths})


def _loaded(stage: Usd.Stage, path: Sdf.Path) -> Iterator[tuple[Usd.Prim, TileChoice]]:
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # USD would print the errors raised here
    stage.Load(path)
    del quiet
    try:
        _check_composition(stage)
        prim = stage.GetPrimAtPath(path)
        choice = read_choice(prim)
        if "both" in prim.GetVariantSet("representation").GetVariantNames():
            select_variant(prim, "representation", "both")
        yield prim, choice
    finally:
        stage.Unload(path)


def read_lods(tile: Usd.Prim, channel_id: str, *, finest: int = 0) -> Iterator[ComposedLod]:
    """Yield a loaded tile's levels of detail of one channel from `finest` on; none: no surface.

    Raises StageError for a mesh that can't be drawn: no material, a missing normal map.
    """
    levels = [level for level in lod_levels(tile) if level >= finest]
    for level in levels or [0]:  # a flattened stage has one level, and no variants
        prim = mesh_at(tile, channel_id, level)
        if prim is None:
            continue
        matrix = _to_world(prim)
        built = text_of(prim.GetAttribute(SHAPE_HASH))
        shape = hash_shape(UsdGeom.Mesh(prim)) if built else ""
        try:
            surface = surface_of(prim)
            fed = vertex_values_of(surface)
            mesh = read_mesh(UsdGeom.Mesh(prim), matrix, shown=fed, is_edited=shape != built)
        except LargeFaceError as error:
            inside = f", inside the variant lod=lod{level}" if levels else ""
            raise StageError(f"{error}{inside}") from error
        except StageError as error:
            raise StageError(f"{error}{_edit_advice(level) if levels else ''}") from error
        mesh = mesh and without_hidden(mesh, prim)
        if mesh is None:
            continue
        stretch = float(np.linalg.norm(matrix[:3, :3], 2))
        distance = largest = shortest(*numbers_of(prim, DISTANCE, 1)) * stretch
        if prim.HasAttribute(LARGEST_DISTANCE):
            largest = shortest(*numbers_of(prim, LARGEST_DISTANCE, 1)) * stretch
        own = UsdGeom.Xformable(prim).GetLocalTransformation()
        lod = ComposedLod(
            level,
            mesh,
            distance,
            largest,
            material_of(surface),
            maps_of(surface),
            matrix,
            shape,
            built,
            tuple(np.array(own).ravel().tolist()),
        )
        yield lod if shape == built else _without_misfits(lod, prim, fed)


def _without_misfits(lod: ComposedLod, prim: Usd.Prim, fed: set[str]) -> ComposedLod:
    """Return an edited level without maps and vertex values that belong to other faces."""
    mesh, lost, has_color = lod.mesh, [], True
    if lod.maps.any and mesh.uvs is None:
        has_color = lod.maps.color is None
        lod = replace(lod, maps=ComposedMaps())
        lost.append("maps")
    if "occlusion" in fed and mesh.openness is None:
        lost.append("occlusion")
    if "displayColor" in fed and mesh.colors is None:
        lost.append("colours")
        has_color = False
    given = read_as(UsdGeom.Gprim(prim).GetDisplayColorAttr(), _Types.Color3fArray)
    colors = np.array(given or [], np.float64)
    if not has_color and colors.size:  # one average colour replaces them
        r, g, b = (shortest(part) for part in colors.reshape(-1, 3).mean(axis=0).clip(0, 1))
        lod = replace(lod, material=replace(lod.material, color=(r, g, b)))
    return replace(lod, lost=tuple(lost))


def read_local(tile: Usd.Prim, channel_id: str, level: int) -> Mesh:
    """Return an edited level's mesh in its own space. Raises StageError where it is gone."""
    prim = mesh_at(tile, channel_id, level)
    found = None
    if prim is not None:
        fed = vertex_values_of(surface_of(prim))
        found = read_mesh(UsdGeom.Mesh(prim), np.eye(4), shown=fed, is_edited=True)
    if found is None:
        raise StageError(f"{tile.GetPath()}/{channel_id}: lod{level} has no mesh any more")
    return found


def find_emptied(tile: Usd.Prim, channel_id: str) -> list[int]:
    """Return the levels whose faces an edit removed, all of them."""
    found = []
    for level in lod_levels(tile) or [0]:
        prim = mesh_at(tile, channel_id, level)
        if prim is None or not text_of(prim.GetAttribute(SHAPE_HASH)):
            continue
        if not count_faces(prim):
            found.append(level)
    return found


def count_faces(mesh: Usd.Prim) -> int:
    """Return the number of faces of a mesh. Raises StageError where they aren't whole numbers."""
    counts = UsdGeom.Mesh(mesh).GetFaceVertexCountsAttr()
    return len(read_as(counts, _Types.IntArray) or ())


def mesh_at(tile: Usd.Prim, channel_id: str, level: int) -> Usd.Prim | None:
    """Select a level and return the mesh that it draws; None: it draws none."""
    if lod_levels(tile):
        select_variant(tile, "lod", f"lod{level}")
    prim = _drawn(tile, tile.GetPath().AppendPath(f"{channel_id}/{channel_id}_{tile.GetName()}"))
    return prim if prim is not None and prim.IsA(UsdGeom.Mesh) else None


def _edit_advice(level: int) -> str:
    """Explain that an edit outside the variants overrides all levels, and fits one at most."""
    return (
        f" at lod{level}: edit inside the variant lod=lod{level}, or override points, "
        "faceVertexCounts, faceVertexIndices and normals together"
    )


def read_volume(tile: Usd.Prim, channel_id: str) -> ComposedVolume | None:
    """Return a loaded tile's volume of one channel; None if it is not drawn.

    Raises StageError where its attributes are missing or contradict each other.
    """
    name = f"{channel_id}_{tile.GetName()}_volume"
    prim = _drawn(tile, tile.GetPath().AppendPath(f"{channel_id}/{name}"))
    if prim is None:
        return None
    width, height, depth = sizes_of(prim, "stereocell:atlasSize", 3)
    (apron,) = sizes_of(prim, "stereocell:apron", 1)
    if min(width, height, depth) <= 2 * apron:
        raise StageError(
            f"{prim.GetPath()}: found {width} x {height} x {depth} voxels, apron {apron}, "
            "expected voxels inside it"
        )
    return ComposedVolume(
        file_of(prim.GetAttribute("stereocell:atlas")),
        _field_of(prim, GRID_NAME),
        _field_of(prim, MEASURED_NAME),
        (width, height, depth),
        apron,
        point_of(prim, "stereocell:boundsMin"),
        point_of(prim, "stereocell:boundsMax"),
        _to_world(prim),
    )


def _field_of(volume: Usd.Prim, name: str) -> Path | None:
    """Return the file of a field of a volume; None where there is none."""
    path = UsdVol.Volume(volume).GetFieldPath(name)
    prim = volume.GetStage().GetPrimAtPath(path) if path else None
    asset = read_as(UsdVol.FieldAsset(prim).GetFilePathAttr(), _Types.Asset) if prim else None
    return Path(asset.resolvedPath) if asset and asset.resolvedPath else None


def _check_composition(stage: Usd.Stage) -> None:
    """Raise StageError for the first layer, payload or reference that USD failed to compose."""
    errors = stage.GetCompositionErrors()
    if errors:
        raise StageError(f"{stage.GetRootLayer().realPath}: {one_line(errors[0])}")


def _drawn(tile: Usd.Prim, path: object) -> Usd.Prim | None:
    prim = tile.GetStage().GetPrimAtPath(path)
    return prim if prim and prim.IsActive() and _is_visible(prim) else None


def _is_visible(prim: Usd.Prim) -> bool:
    return bool(UsdGeom.Imageable(prim).ComputeVisibility() != UsdGeom.Tokens.invisible)


def _to_world(prim: Usd.Prim) -> NDArray[np.float64]:
    """Return the matrix (4, 4) from a prim's space to the world, for row vectors.

    Raises StageError where it is flat, infinite or leads too far away.
    """
    for path in prim.GetPath().GetAncestorsRange():
        for op in UsdGeom.Xformable(prim.GetStage().GetPrimAtPath(path)).GetOrderedXformOps():
            require_still(op.GetAttr())
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # USD would print the errors raised here
    try:
        matrix = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim))
    except Tf.ErrorException as error:
        raise StageError(f"{prim.GetPath()}: {one_line(error)}") from error
    finally:
        del quiet
    is_near = np.abs(matrix).max() <= _FARTHEST_UM
    if not is_near or not np.abs(np.linalg.det(matrix[:3, :3])) > 0:
        raise StageError(
            f"{prim.GetPath()}: its transform is flat, infinite or leads farther than "
            f"{_FARTHEST_UM:g} um, expected one that a surface survives"
        )
    if not np.allclose(matrix[:, 3], (0, 0, 0, 1), rtol=0, atol=_PERSPECTIVE):
        raise StageError(
            f"{prim.GetPath()}: its transform has a perspective, expected the last column of its "
            f"matrix to be 0, 0, 0, 1, found {', '.join(f'{part:g}' for part in matrix[:, 3])}"
        )
    return matrix
