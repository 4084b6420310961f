"""Read the tiles of a composed stage, whatever layers an artist put over it.

Everything comes through pxr's composition: colours, visibility, moved tiles, chosen variants. The
levels of detail are variants; they are looked through one by one by selections in the session
layer.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Tf, Usd, UsdGeom, UsdUtils, UsdVol

from stereocell.errors import StageError
from stereocell.mesh import Mesh
from stereocell.mirror import at_hand
from stereocell.write.composed_choice import TileChoice, lod_levels, read_choice
from stereocell.write.composed_look import material_of, surface_of
from stereocell.write.composed_maps import ComposedMaps, maps_of, vertex_values_of
from stereocell.write.composed_mesh import read_mesh
from stereocell.write.composed_values import (
    Point,
    file_of,
    numbers_of,
    one_line,
    point_of,
    select_variant,
    shortest,
    sizes_of,
)
from stereocell.write.gltf import Material
from stereocell.write.usd_files import AsWritten
from stereocell.write.usd_layer import CHANNELS, METERS_PER_UNIT, ROOT, TILES, move_box

_FARTHEST_UM = 1e12  # from the origin: what float32 and browsers still draw


@dataclass(frozen=True, slots=True)
class ComposedLod:
    """One level of detail, in world um. `level` counts from the finest, 0."""

    level: int
    mesh: Mesh
    distance_um: float
    material: Material
    maps: ComposedMaps


@dataclass(frozen=True, slots=True)
class ComposedVolume:
    """One volume: the file with its voxels, and where they are.

    field       the .vdb that other programs draw; None: the stage names none
    size        voxels (x, y, z) with the apron
    low, high   corners (x, y, z) in um of the box inside the apron, before `matrix`
    matrix      (4, 4) for row vectors, to world um
    """

    atlas: Path
    field: Path | None
    size: tuple[int, int, int]
    apron: int
    low: Point
    high: Point
    matrix: NDArray[np.float64]


def open_stage(path: Path) -> Usd.Stage:
    """Open a stage without its payloads. Raises StageError if it is none, or in other units."""
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # USD would print what is raised here
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
    if UsdGeom.StageHasAuthoredMetersPerUnit(stage):
        unit = UsdGeom.GetStageMetersPerUnit(stage)
        if not UsdGeom.LinearUnitsAre(unit, METERS_PER_UNIT):
            raise StageError(f"{path}: metersPerUnit is {unit:g}, expected {METERS_PER_UNIT:g}")
    for needed in (ROOT, CHANNELS, TILES):
        if not stage.GetPrimAtPath(needed):
            raise StageError(f"{path}: no prim {needed}, expected a StereoCell stage")
    return stage


def dependencies(path: Path) -> list[Path]:
    """Return every file that the stage is made of: layers, also unselected ones, and assets.

    A stage that can't be opened depends on itself; `open_stage` says what is wrong with it.
    """
    quiet = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        layers, assets, _ = UsdUtils.ComputeAllDependencies(str(path))
    except Tf.ErrorException:
        return [path]
    finally:
        del quiet
    files = {path, *(Path(layer.realPath) for layer in layers), *(Path(str(a)) for a in assets)}
    return sorted(file for file in files if file.is_file())


def specimen_name(stage: Usd.Stage) -> str:
    root = stage.GetPrimAtPath(ROOT)
    return str(root.GetDisplayName() or root.GetName())


def modality_of(stage: Usd.Stage) -> str:
    """Return what took the specimen, `MR` or the like; empty: the stage does not say."""
    attribute = stage.GetPrimAtPath(ROOT).GetAttribute("stereocell:modality")
    return str((attribute.Get() if attribute else None) or "")


def tile_prims(stage: Usd.Stage) -> list[Usd.Prim]:
    """Return the tiles that are active and visible, loaded or not, in the stage's order."""
    kept = Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract
    prims = stage.GetPrimAtPath(TILES).GetFilteredChildren(kept)
    return [prim for prim in prims if _is_visible(prim)]


def hinted_box(tile: Usd.Prim) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the box in the world, um, that a tile says it fills, loaded or not: its extentsHint.

    Raises StageError if it has none.
    """
    hint = UsdGeom.ModelAPI(tile).GetExtentsHintAttr().Get()
    if not hint:
        raise StageError(f"{tile.GetPath()}.extentsHint: no value")
    corners = np.array(hint, np.float64)
    if len(corners) < 2 or not np.abs(corners).max() <= _FARTHEST_UM:
        raise StageError(f"{tile.GetPath()}.extentsHint: found {hint!s:.60}, expected two corners")
    return move_box(corners[0], corners[1], _to_world(tile))


@contextmanager
def loaded(
    stage: Usd.Stage, tile_id: str, as_written: AsWritten | None = None
) -> Iterator[tuple[Usd.Prim, TileChoice]]:
    """Yield a tile's prim with its payload loaded, and what is chosen for it.

    Its meshes and volumes are both active, whichever was chosen. Raises StageError; for a layer
    that is damaged, too, where the stage is held against its list.
    """
    path = TILES.AppendChild(tile_id)
    with at_hand(Path(stage.GetRootLayer().realPath).parent / "tiles" / tile_id):
        if as_written is not None:
            for folder in _stage_folders(stage):
                as_written.require_layers(folder / "tiles" / tile_id)
        yield from _loaded(stage, path)


def _stage_folders(stage: Usd.Stage) -> list[Path]:
    """Return where the layers lie that a stage is made of, without its payloads."""
    paths = [layer.realPath for layer in stage.GetUsedLayers() if layer.realPath]
    return sorted({Path(path).parent for path in paths})


def _loaded(stage: Usd.Stage, path: Sdf.Path) -> Iterator[tuple[Usd.Prim, TileChoice]]:
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # USD would print what is raised here
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


def read_lods(tile: Usd.Prim, channel_id: str, finest: int = 0) -> Iterator[ComposedLod]:
    """Yield a loaded tile's levels of detail of one channel, `finest` first; none: no surface.

    Raises StageError for a mesh that can't be drawn: no material, a missing normal map.
    """
    path = tile.GetPath().AppendPath(f"{channel_id}/{channel_id}_{tile.GetName()}")
    levels = [level for level in lod_levels(tile) if level >= finest]
    for level in levels or [0]:  # a flattened stage has one level, and no variants
        if levels:
            select_variant(tile, "lod", f"lod{level}")
        prim = _drawn(tile, path)
        if prim is None or not prim.IsA(UsdGeom.Mesh):
            continue
        matrix = _to_world(prim)
        try:
            surface = surface_of(prim)
            mesh = read_mesh(UsdGeom.Mesh(prim), matrix, vertex_values_of(surface))
        except StageError as error:
            raise StageError(f"{error}{_edit_advice(level) if levels else ''}") from error
        if mesh is None:
            continue
        stretch = float(np.linalg.norm(matrix[:3, :3], 2))
        distance = shortest(*numbers_of(prim, "stereocell:distance", 1)) * stretch
        yield ComposedLod(level, mesh, distance, material_of(surface), maps_of(surface))


def _edit_advice(level: int) -> str:
    """An edit outside the variants lies over every level of detail, and fits one at most."""
    return (
        f" at lod{level}: edit inside the variant lod=lod{level}, or override points, "
        "faceVertexCounts, faceVertexIndices and normals together"
    )


def read_volume(tile: Usd.Prim, channel_id: str) -> ComposedVolume | None:
    """Return a loaded tile's volume of one channel; None if it is not drawn. Raises StageError."""
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
        _field_of(prim),
        (width, height, depth),
        apron,
        point_of(prim, "stereocell:boundsMin"),
        point_of(prim, "stereocell:boundsMax"),
        _to_world(prim),
    )


def _field_of(volume: Usd.Prim) -> Path | None:
    """Return the file of a volume's one field; None where there is none."""
    for prim in UsdVol.Volume(volume).GetFieldPaths().values():
        asset = UsdVol.FieldAsset(volume.GetStage().GetPrimAtPath(prim)).GetFilePathAttr().Get()
        return Path(asset.resolvedPath) if asset and asset.resolvedPath else None
    return None


def _check_composition(stage: Usd.Stage) -> None:
    """Raise StageError on the first layer, payload or reference that did not come in."""
    errors = stage.GetCompositionErrors()
    if errors:
        raise StageError(f"{stage.GetRootLayer().realPath}: {one_line(errors[0])}")


def _drawn(tile: Usd.Prim, path: object) -> Usd.Prim | None:
    prim = tile.GetStage().GetPrimAtPath(path)
    return prim if prim and prim.IsActive() and _is_visible(prim) else None


def _is_visible(prim: Usd.Prim) -> bool:
    return bool(UsdGeom.Imageable(prim).ComputeVisibility() != UsdGeom.Tokens.invisible)


def _to_world(prim: Usd.Prim) -> NDArray[np.float64]:
    """Return the matrix from a prim's space to the world for row vectors, (4, 4).

    Raises StageError for one that no surface survives.
    """
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # USD would print what is raised here
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
    return matrix
