"""Make the levels of detail of a bundle if an artist edited a mesh.

If the finest level was edited, it becomes the reference surface. Coarser levels are computed again
from it, by the same simplification as in the build, and distances are measured to it. A coarser
level that was edited, too, stays as it is, and its distance is measured. If only coarser levels
were edited, only their distances are measured again.

Edits are detected by a hash. The build writes a hash of each mesh's points and faces into its
layer, and the bundle compares it with the hash of the composed mesh. It is not enough to look at
the layers of opinions, because a layer that was edited in place and a flattened stage have only one
layer. A stage without hashes counts as unedited. Moving one level of a mesh and not the others is
also an edit.

Edited meshes are checked for defects again.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom
from pydantic import TypeAdapter, ValidationError

from stereocell.meshes.distance import Nearest, measure_spread
from stereocell.meshes.options import LodOptions
from stereocell.meshes.simplify import compact
from stereocell.meshes.validity import Defects, border, find_defects
from stereocell.model.color import to_srgb8
from stereocell.model.errors import StageError
from stereocell.model.lattice import Plane
from stereocell.model.mesh import Lod, Mesh
from stereocell.model.spacing import Spacing
from stereocell.model.timing import Clock
from stereocell.textures.bake import Baker, FineSurface, bake
from stereocell.textures.lod_chain import make_levels
from stereocell.textures.options import UnwrapOptions
from stereocell.textures.texture_lod import Texturer, VertexValues
from stereocell.usd.layer import METERS_PER_UNIT
from stereocell.usd.read_levels import (
    ComposedLod,
    MadeMaps,
    find_emptied,
    mesh_at,
    read_local,
    read_lods,
)
from stereocell.usd.read_mesh import move_mesh
from stereocell.usd.read_textures import ComposedMaps, read_image
from stereocell.usd.read_variants import lod_levels
from stereocell.usd.typed_values import read_as

T = TypeVar("T")
_Types = Sdf.ValueTypeNames


class _Options(NamedTuple):
    """The options with which levels of detail are computed."""

    lod: LodOptions
    unwrap: UnwrapOptions


_DEFECTS = {
    "degenerate": "triangles without area",
    "open": "open edges",
    "non_manifold_edges": "edges of more than two triangles",
    "non_manifold_vertices": "pinched vertices",
    "inside_out": "bodies inside out",
    "crossings": "crossings",
    "in_cut_plane": "triangles in the cut",
}


@dataclass(frozen=True, slots=True)
class Shown:
    """The levels of detail that a bundle shows, finest first, and a message on edits, or empty."""

    lods: tuple[ComposedLod, ...]
    edit: str = ""


def shown_lods(tile: Usd.Prim, channel_id: str, finest: int = 0) -> Shown:
    """Return a channel's levels in a loaded tile, without those finer than `finest`.

    finest  finest level of detail to return; 0: all levels

    Raises StageError if a mesh can't be drawn, or has a point that is not finite.
    """
    lods = list(read_lods(tile, channel_id))
    # A level without faces is not read, and selecting each level again would take as long.
    is_one_missing = len(lods) < len(lod_levels(tile) or [0])
    emptied = find_emptied(tile, channel_id) if is_one_missing else []
    if emptied and (not lods or emptied[0] < lods[0].level):
        return Shown((), f"edited by hand: lod{emptied[0]} is empty, so no surface is left")
    edited = _edited_levels(lods)
    remarks = [f"lod{level} is empty and left out" for level in emptied]
    if edited:
        if not np.isfinite(np.concatenate([lod.mesh.positions for lod in lods])).all():
            prim = f"{tile.GetPath()}/{channel_id}/{channel_id}_{tile.GetName()}"
            raise StageError(
                f"{prim}.points: found a number that is not finite, expected finite positions in um"
            )
        lods, changes = _follow(tile, channel_id, lods, edited)
        remarks = [*changes, *remarks, *_odd_units(tile, channel_id, min(edited))]
    line = f"edited by hand: {'; '.join(remarks)}" if remarks else ""
    return Shown(tuple(lod for lod in lods if lod.level >= finest), line)


def _edited_levels(lods: Sequence[ComposedLod]) -> set[int]:
    """Return the levels of detail whose shape was edited, or that were moved without the others."""
    edited = {lod.level for lod in lods if lod.shape != lod.built}
    if len({lod.own for lod in lods}) > 1:
        still = tuple(np.eye(4).ravel().tolist())
        edited |= {lod.level for lod in lods if lod.own != still}
    return edited


def _follow(
    tile: Usd.Prim, channel_id: str, lods: list[ComposedLod], edited: set[int]
) -> tuple[list[ComposedLod], list[str]]:
    """Return all levels, with new coarser ones if needed, and remarks about the edits.

    lods    levels of detail as they are composed, finest first
    edited  numbers of the levels that were edited
    """
    fine, options = lods[0], _options(tile.GetStage())
    planes = _cut_planes(tile, channel_id, fine)
    to_fine = Nearest(fine.mesh, options.lod.samples)

    def measured(lod: ComposedLod, past_um: float = 0.0) -> ComposedLod:
        """Return the level with its distances from the finest level.

        past_um  distance of the finest level from the iso-surface, which is added
        """
        to_mesh = Nearest(lod.mesh, options.lod.samples)
        ways = measure_spread(to_fine, to_mesh), measure_spread(to_mesh, to_fine)
        most = max(way.p99 for way in ways), max(way.max for way in ways)
        return replace(lod, distance_um=past_um + most[0], largest_um=past_um + most[1])

    def describe(lod: ComposedLod) -> str:
        _, defects = _certified(read_local(tile, channel_id, lod.level), planes)
        lost = f", without {' and '.join(lod.lost)} of its old faces" if lod.lost else ""
        return f"lod{lod.level} ({_describe(defects)}{lost})"

    if fine.level not in edited:
        remarks, result = [], []
        for lod in lods:
            if lod.level in edited:
                um = measured(lod).distance_um
                remarks.append(
                    f"{describe(lod)} {um:.3g} um from lod{fine.level}, which has no edits"
                )
                lod = measured(lod, fine.largest_um)
            result.append(lod)
        return result, remarks
    remarks = [describe(fine)]
    # An opinion outside of the variants applies to all levels. Coarser levels then have the same
    # shape as the finest, and do not count as edited themselves.
    own = {lod.level for lod in lods[1:] if lod.level in edited and lod.shape != fine.shape}
    made = _make(tile, channel_id, lods, options, planes) if len(own) < len(lods) - 1 else {}
    result = [replace(fine, distance_um=0.0, largest_um=0.0)]
    rebuilt = []
    for lod in lods[1:]:
        if lod.level in own:
            lod = measured(lod)
            remarks.append(
                f"{describe(lod)} is kept, {lod.distance_um:.3g} um from lod{fine.level}"
            )
        else:
            lod, defects = made[lod.level]
            found = "" if not defects else f" with {defects} faults"
            rebuilt.append(f"lod{lod.level}{found} within {lod.distance_um:.3g} um")
        result.append(lod)
    if rebuilt:
        remarks.append(f"rebuilt from lod{fine.level}: {', '.join(rebuilt)}")
    return result, remarks


def _make(
    tile: Usd.Prim,
    channel_id: str,
    lods: Sequence[ComposedLod],
    options: _Options,
    planes: tuple[Plane, ...],
) -> dict[int, tuple[ComposedLod, int]]:
    """Compute the coarser levels from the finest one, and count their faults, by level."""
    fine, first = lods[0], lods[0].level + 1
    spacing = _spacing(tile, channel_id, fine)
    mesh, _ = _certified(
        with_vertex_values(read_local(tile, channel_id, fine.level), fine.maps), planes
    )
    bare = Mesh(mesh.positions, mesh.triangles, mesh.normals)
    openness = np.ones(len(bare.positions), np.float32) if mesh.openness is None else mesh.openness
    paints = [] if mesh.colors is None else list(np.ascontiguousarray(mesh.colors.T))
    sources = [FineSurface(bare, openness, paint) for paint in paints or [None]]

    def get_texturer(_: Mesh, number: NDArray[np.int64]) -> Texturer:
        paint = paints[0][number] if paints else None
        values = VertexValues(openness[number], paint)
        return Texturer(options.unwrap.resolved(spacing), values, lambda: sources[0], Clock())

    made = make_levels(
        bare,
        planes,
        spacing_um=spacing,
        lod=replace(options.lod, errors=options.lod.errors[: lods[-1].level + 1]),
        clock=Clock(),
        box=_box(tile, channel_id),
        get_texturer=get_texturer,
        first=first,
    )
    others = [Baker(source) for source in sources[1:]]
    stretch = float(np.linalg.norm(fine.matrix[:3, :3], 2))
    result: dict[int, tuple[ComposedLod, int]] = {}
    before = fine, 0
    for past, lod in pairwise(lods):
        place = lod.level - first
        # A channel with fewer levels than other channels repeats its coarsest level.
        if (lod.built and lod.built == past.built) or place >= len(made):
            found = replace(before[0], level=lod.level), before[1]
        else:
            dressed = _compose(made[place], lod, fine, mesh, others)
            um, most_um = made[place].distance_um * stretch, made[place].largest_um * stretch
            quality = made[place].quality
            found = (
                replace(dressed, distance_um=um, largest_um=most_um),
                quality.faults if quality else 0,
            )
        result[lod.level] = before = found
    return result


def _compose(
    made: Lod, lod: ComposedLod, fine: ComposedLod, source: Mesh, others: Sequence[Baker]
) -> ComposedLod:
    """Return a computed level in world um, with its maps or its values at vertices.

    made    the level, in the mesh's own space; its paint is the red component of the colours
    lod     the level before the edit
    fine    the edited finest level
    source  mesh of `fine` with values at vertices
    others  look up the green and the blue component of the colours of `fine`
    """
    mesh, baked = made.mesh, made.baked
    assert baked is not None
    color: NDArray[np.float32] | None = None
    if source.colors is not None and baked.paint is not None:
        parts = [baked.paint]
        for baker in others:
            if made.normal_map is not None:
                paint = bake(mesh, made.normal_map.shape[:2], baker).paint
            else:
                wide = mesh.positions.astype(np.float64), mesh.normals.astype(np.float64)
                paint = np.round(np.asarray(baker.look_up(*wide).paint) * 255).astype(np.uint8)
            assert paint is not None
            parts.append(paint)
        color = np.divide(np.stack(parts, axis=-1), 255, dtype=np.float32)
    is_open = source.openness is None
    images = None
    if made.normal_map is not None:
        images = MadeMaps(
            made.normal_map,
            None if is_open else baked.openness,
            None if color is None else to_srgb8(color),
        )
    else:
        share = None if is_open else np.divide(baked.openness, 255, dtype=np.float32)
        mesh = replace(mesh, colors=color, openness=share)
    return replace(
        lod,
        mesh=move_mesh(mesh, fine.matrix),
        maps=ComposedMaps(),
        images=images,
        material=replace(lod.material, color=fine.material.color),
        matrix=fine.matrix,
        lost=(),
    )


def with_vertex_values(mesh: Mesh, maps: ComposedMaps | MadeMaps) -> Mesh:
    """Return the mesh with values at vertices that are sampled from its maps.

    The values are occlusion and colours, linear RGB. Values that the mesh already has are kept.
    """
    if mesh.uvs is None:
        return mesh

    def at_vertices(path: Path | NDArray[np.uint8]) -> NDArray[np.float64]:
        image = read_image(path).astype(np.float64) / 255
        height, width = image.shape[:2]
        assert mesh.uvs is not None
        u, v = mesh.uvs.astype(np.float64).clip(0, 1).T
        rows = np.minimum(((1 - v) * height).astype(int), height - 1)
        return np.asarray(image[rows, np.minimum((u * width).astype(int), width - 1)])

    if maps.occlusion is not None and mesh.openness is None:
        openness = at_vertices(maps.occlusion)[:, 0].astype(np.float32)
        mesh = replace(mesh, openness=openness)
    if maps.color is not None and mesh.colors is None:
        bent = at_vertices(maps.color)
        linear = np.where(bent <= 0.04045, bent / 12.92, ((bent + 0.055) / 1.055) ** 2.4)
        mesh = replace(mesh, colors=linear.astype(np.float32))
    return mesh


def with_vertex_occlusion(lod: ComposedLod) -> Mesh:
    """Return a level's mesh with occlusion at its vertices, sampled from its map if there is one.

    Vertices at the same position, which seams of charts have split, get the mean of their samples.
    The values are the mesh's `openness`, float32 (n,), 0..1. Raises StageError if the map can't be
    read.
    """
    maps = lod.images or lod.maps
    if maps.occlusion is None or lod.mesh.openness is not None:
        return lod.mesh
    mesh = with_vertex_values(lod.mesh, replace(maps, normal=None, color=None))
    if mesh.openness is None:
        return mesh
    _, place, count = np.unique(mesh.positions, axis=0, return_inverse=True, return_counts=True)
    mean = np.bincount(place.ravel(), mesh.openness) / count
    return replace(mesh, openness=mean[place.ravel()].astype(np.float32))


def _certified(mesh: Mesh, planes: tuple[Plane, ...]) -> tuple[Mesh, Defects]:
    """Return a mesh, with vertices joined if that removes defects, and its defects.

    Seams of UVs or normals count as open edges. So vertices at the same position are joined if the
    mesh then has fewer defects.
    """
    defects = find_defects(mesh, planes=planes)
    if not defects.total:
        return mesh, defects
    _, first, twin = np.unique(mesh.positions, axis=0, return_index=True, return_inverse=True)
    triangles = first[twin.ravel()][mesh.triangles].astype(np.uint32)
    # Joining vertices makes some triangles collapse, for example at the pole of a UV sphere.
    has_area = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    triangles = triangles[has_area]
    welded = compact(mesh, triangles)
    found = find_defects(welded, planes=planes)
    if found.total >= defects.total:
        return mesh, defects
    used = np.unique(triangles)
    return replace(
        welded,
        colors=None if mesh.colors is None else mesh.colors[used],
        openness=None if mesh.openness is None else mesh.openness[used],
    ), found


def _describe(defects: Defects) -> str:
    found = [f"{count} {_DEFECTS[kind]}" for kind, count in defects.counts.items() if count]
    return ", ".join(found) or "sound"


def _cut_planes(tile: Usd.Prim, channel_id: str, fine: ComposedLod) -> tuple[Plane, ...]:
    """Return the planes of the faces of the tile's box at which the mesh is open.

    The stage does not state these planes. They are found by open edges near the box's faces whose
    two ends have exactly the same coordinate. Vertices that an artist moved do not have that.
    """
    mesh = read_local(tile, channel_id, fine.level)
    low, high = _box(tile, channel_id) or (
        mesh.positions.min(axis=0).astype(np.float64),
        mesh.positions.max(axis=0).astype(np.float64),
    )
    ends = mesh.positions[border(mesh.triangles)]
    hair = 1e-5 * max(float(np.abs([low, high]).max()), 1.0)
    planes = set()
    for axis in range(3):
        one, other = ends[..., axis].T
        for value in np.unique(one[one == other]).tolist():
            if value <= low[axis] + hair or value >= high[axis] - hair:
                planes.add((axis, float(value)))
    return tuple(sorted(planes))


def _volume(tile: Usd.Prim, channel_id: str) -> Usd.Prim:
    name = f"{channel_id}_{tile.GetName()}_volume"
    return tile.GetStage().GetPrimAtPath(tile.GetPath().AppendPath(f"{channel_id}/{name}"))


def _box(tile: Usd.Prim, channel_id: str) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Return the corners (x, y, z) of a tile's box in its own space, um; None without a volume."""
    prim = _volume(tile, channel_id)
    low, high = (
        read_as(prim.GetAttribute(f"stereocell:bounds{end}"), _Types.Double3) if prim else None
        for end in ("Min", "Max")
    )
    if low is None or high is None:
        return None
    return np.array(low, np.float64), np.array(high, np.float64)


def _spacing(tile: Usd.Prim, channel_id: str, fine: ComposedLod) -> Spacing:
    """Return the voxel spacing (z, y, x), um; without a volume, the median edge of the mesh."""
    box, prim = _box(tile, channel_id), _volume(tile, channel_id)
    size = None
    if box is not None:
        size = read_as(prim.GetAttribute("stereocell:atlasSize"), _Types.Int3)
    if box is not None and size:
        apron = int(read_as(prim.GetAttribute("stereocell:apron"), _Types.Int) or 0)
        steps = np.array(size, np.float64) - 2 * apron - 1
        x, y, z = ((box[1] - box[0]) / np.maximum(steps, 1)).tolist()
        if min(x, y, z) > 0:
            return z, y, x
    corners = fine.mesh.positions[fine.mesh.triangles].astype(np.float64)
    edge = float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))
    return edge, edge, edge


def _options(stage: Usd.Stage) -> _Options:
    """Return the options with which the stage's levels of detail were made, or the defaults.

    Raises StageError for invalid values.
    """
    for layer in stage.GetUsedLayers():
        found = layer.customLayerData.get("stereocell", {}).get("settings", {})
        if isinstance(found.get("lod"), dict) and isinstance(found.get("unwrap"), dict):
            where = f"{layer.GetDisplayName()}: customLayerData: settings"
            return _Options(
                _read_options(LodOptions, found["lod"], f"{where}: lod"),
                _read_options(UnwrapOptions, found["unwrap"], f"{where}: unwrap"),
            )
    return _Options(LodOptions(), UnwrapOptions())


def _read_options(kind: type[T], content: Mapping[str, Any], where: str) -> T:
    """Return options from a section of settings, without unknown keys.

    Raises StageError for an invalid value, with `where` and the value's name.
    """
    known = {field.name for field in fields(kind)}  # type: ignore[arg-type]
    values = {
        key: json.loads(value) if isinstance(value, str) and value.startswith("[") else value
        for key, value in content.items()
        if key in known
    }
    try:
        return TypeAdapter(kind).validate_python(values)
    except ValidationError as error:
        first = error.errors()[0]
        name = ".".join(map(str, first["loc"]))
        raise StageError(f"{where}.{name} is {first['input']!r:.80}: {first['msg']}") from None


def _odd_units(tile: Usd.Prim, channel_id: str, level: int) -> Iterator[str]:
    """Yield a message if the layer with the edited points states other units than um."""
    prim = mesh_at(tile, channel_id, level)
    stack = prim.GetAttribute("points").GetPropertyStack() if prim else []
    for spec in stack[:1]:
        unit = spec.layer.pseudoRoot.GetInfo(UsdGeom.Tokens.metersPerUnit)
        stated = spec.layer.pseudoRoot.HasInfo(UsdGeom.Tokens.metersPerUnit)
        if stated and not UsdGeom.LinearUnitsAre(unit, METERS_PER_UNIT):
            yield (
                f"points of {spec.layer.GetDisplayName()}, whose metersPerUnit is {unit:g}, are "
                "taken as um: USD does not rescale them"
            )
