"""Read the surfaces of a loaded tile at each level of detail, including an artist's edits.

The levels are variants. The reader selects them one after the other in the session layer.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom, UsdShade

from stereocell.formats.gltf import Material
from stereocell.model.errors import StageError
from stereocell.model.mesh import Mesh
from stereocell.usd.drawn_prims import drawn, to_world
from stereocell.usd.layer import (
    DISTANCE,
    LARGEST_DISTANCE,
    SHAPE_HASH,
    hash_shape,
)
from stereocell.usd.read_appearances import WHITE, material_of, surface_of
from stereocell.usd.read_attributes import (
    numbers_of,
    select_variant,
    shortest,
)
from stereocell.usd.read_display import (
    display_color,
    display_opacity,
    has_many_display_colors,
    shows_display_color,
)
from stereocell.usd.read_mesh import LargeFaceError, read_mesh
from stereocell.usd.read_objects import without_hidden
from stereocell.usd.read_textures import ComposedMaps, maps_of, vertex_values_of
from stereocell.usd.read_variants import lod_levels
from stereocell.usd.specimen import specimen_of
from stereocell.usd.typed_values import read_as, text_of

_Types = Sdf.ValueTypeNames


@dataclass(frozen=True, slots=True)
class MadeMaps:
    """Baked maps of a level of detail that was computed again after an edit.

    All are uint8: normals (h, w, 3), openness (h, w), sRGB colours (h, w, 3). None: no map.
    """

    normal: NDArray[np.uint8] | None
    occlusion: NDArray[np.uint8] | None
    color: NDArray[np.uint8] | None


@dataclass(frozen=True, slots=True)
class ComposedLod:
    """A channel's surface in one tile at one level of detail, in world um.

    level        level of detail, 0: the finest
    distance_um  99th percentile of the distances between mesh and iso-surface, both ways, um
    largest_um   largest of these distances, um; equal to `distance_um` in stages of earlier
                 versions, which do not state it
    matrix       (4, 4) for row vectors, from the mesh's own space to world um
    shape        hash of the composed points and faces; empty if `built` is empty
    built        hash of the points and faces that the build wrote; empty: the stage has no hash
    own          the 16 numbers, row by row, of the matrix (4, 4) that the mesh's own prim states
    lost         values that an edit of the faces made invalid: `maps`, `occlusion`, `colours`
    images       maps in memory, if the level was computed again: see bundle/edited_meshes.py
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


def read_lods(
    tile: Usd.Prim, channel_id: str, *, wanted: Sequence[int] | None = None
) -> Iterator[ComposedLod]:
    """Yield a channel's surface in a loaded tile at each level of detail, finest first.

    wanted  levels to read, in this order; None: all levels

    Yields nothing if the tile has no surface. Raises StageError for a mesh that can't be drawn, for
    example without a material.
    """
    levels = lod_levels(tile)
    # a flattened stage has one level, and no variants
    for level in (levels or [0]) if wanted is None else wanted:
        prim = mesh_at(tile, channel_id, level)
        if prim is None:
            continue
        matrix = to_world(prim)
        built = text_of(prim.GetAttribute(SHAPE_HASH))
        shape = hash_shape(UsdGeom.Mesh(prim)) if built else ""
        try:
            surface = surface_of(prim)
            material, fed = _material(prim, surface, channel_id)
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
            material,
            maps_of(surface),
            matrix,
            shape,
            built,
            tuple(np.array(own).ravel().tolist()),
        )
        yield lod if shape == built else _without_misfits(lod, prim, fed)


def _material(
    prim: Usd.Prim, surface: UsdShade.Shader, channel_id: str
) -> tuple[Material, set[str]]:
    """Return a mesh's material, and the names of the primvars that feed it."""
    material, fed = material_of(surface), vertex_values_of(surface)
    if shows_display_color(surface):
        if (color := display_color(prim)) is not None:
            material = replace(material, color=color)
        elif has_many_display_colors(prim):
            material, fed = replace(material, color=WHITE), {*fed, "displayColor"}
    stage = prim.GetStage()
    channel = stage.GetPrimAtPath(specimen_of(stage).channels.AppendChild(channel_id))
    return replace(material, opacity=material.opacity * display_opacity(prim, channel)), fed


def _without_misfits(lod: ComposedLod, prim: Usd.Prim, fed: set[str]) -> ComposedLod:
    """Return an edited level without the maps and primvars that no longer fit its faces."""
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
    # If colours no longer fit the faces, the mean of the mesh's colours replaces them.
    if not has_color and colors.size:
        r, g, b = (shortest(part) for part in colors.reshape(-1, 3).mean(axis=0).clip(0, 1))
        lod = replace(lod, material=replace(lod.material, color=(r, g, b)))
    return replace(lod, lost=tuple(lost))


def read_local(tile: Usd.Prim, channel_id: str, level: int) -> Mesh:
    """Return the mesh of an edited level in its own space. Raises StageError without a mesh."""
    prim = mesh_at(tile, channel_id, level)
    found = None
    if prim is not None:
        _, fed = _material(prim, surface_of(prim), channel_id)
        found = read_mesh(UsdGeom.Mesh(prim), np.eye(4), shown=fed, is_edited=True)
    if found is None:
        raise StageError(
            f"{tile.GetPath()}/{channel_id}: found no mesh at lod{level}, expected one: restore it"
        )
    return found


def find_emptied(tile: Usd.Prim, channel_id: str) -> list[int]:
    """Return the levels of detail from which an edit removed all faces."""
    found = []
    for level in lod_levels(tile) or [0]:
        prim = mesh_at(tile, channel_id, level)
        if prim is None or not text_of(prim.GetAttribute(SHAPE_HASH)):
            continue
        if not count_faces(prim):
            found.append(level)
    return found


def count_faces(mesh: Usd.Prim) -> int:
    """Return the number of faces of a mesh. Raises StageError for values of another type."""
    counts = UsdGeom.Mesh(mesh).GetFaceVertexCountsAttr()
    return len(read_as(counts, _Types.IntArray) or ())


def mesh_at(tile: Usd.Prim, channel_id: str, level: int) -> Usd.Prim | None:
    """Select a tile's level of detail, and return a channel's mesh; None: no mesh is drawn."""
    if lod_levels(tile):
        select_variant(tile, "lod", f"lod{level}")
    prim = drawn(tile, tile.GetPath().AppendPath(f"{channel_id}/{channel_id}_{tile.GetName()}"))
    return prim if prim is not None and prim.IsA(UsdGeom.Mesh) else None


def _edit_advice(level: int) -> str:
    """Return advice for an edit that contradicts a level's mesh.

    An edit outside the `lod` variants overrides all levels, but fits one of them at most.
    """
    return (
        f" (lod{level}): edit inside the variant lod=lod{level}, or override points, "
        "faceVertexCounts, faceVertexIndices and normals together"
    )
