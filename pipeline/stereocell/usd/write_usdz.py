"""Write specimen.usdz: the meshes of a composed stage as one small file for AR viewers.

AR viewers expect metres, a scene that stands on the floor, and a few hundred thousand triangles:

- The specimen is scaled to the size of a hand (longest edge: SIZE_M) unless a scale is given.
- Its lowest point is at y = 0, and its middle is above the origin.
- It has the finest level of detail with at most MAX_TRIANGLES triangles, or else the coarsest.
- It has the channels that are visible at opening. If none of them is drawn, it has all channels.

In the layer's customLayerData, `stereocell:scale` is the length in the file divided by the length
of the specimen, and `stereocell:size` is the longest edge in metres.

Meshes and curves that layers add are included, unless only some tiles are written. Volumes are left
out, since usdz does not allow .vdb. The archive starts with one .usdc without variants or payloads.
The baked maps of the level follow, and the lights' images. The same stage gives the same bytes.

References: OpenUSD, Usdz File Format Specification, https://openusd.org/release/spec_usdz.html
"""

import struct
import tempfile
import zipfile
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, Vt
from pxr import Kind as Kinds

from stereocell.formats.gltf import Material
from stereocell.model.mesh import Mesh
from stereocell.storage.atomic_write import replacing
from stereocell.usd.layer import METERS_PER_UNIT, ROOT, UP_AXIS, export, vec3f
from stereocell.usd.read_additions import Addition, read_additions
from stereocell.usd.read_appearances import shows_at_first
from stereocell.usd.read_levels import ComposedLod, count_faces, mesh_at, read_lods
from stereocell.usd.read_stage import hinted_box, loaded, open_stage, specimen_name, tile_prims
from stereocell.usd.read_variants import lod_levels
from stereocell.usd.shader_inputs import Kind, feed_image, feed_vertices
from stereocell.usd.specimen import specimen_of
from stereocell.usd.usdz_lights import copy_lights
from stereocell.usd.written_files import AsWritten

SIZE_M = 0.15  # m, longest edge of the specimen
MAX_TRIANGLES = 200_000  # largest number of triangles of all meshes together

_LAYER = "specimen.usdc"
# Format zip: size in bytes of a local header without the name, and of the header of an extra field;
# ID of the extra field that holds the padding
_HEAD_BYTES, _EXTRA_BYTES, _PADDING_ID = 30, 4, 0x1986
_Types = Sdf.ValueTypeNames


@dataclass(frozen=True, slots=True)
class _Part:
    """The mesh of one channel in one tile."""

    tile: str
    channel: str
    lod: ComposedLod


def write_usdz(
    stage_path: Path,
    path: Path,
    *,
    as_written: AsWritten | None = None,
    level: int | None = None,
    tiles: Collection[str] = (),
    channels: Collection[str] = (),
    scale: float | None = None,
) -> int | None:
    """Write the meshes of a stage, or of a layer over it, as `path`; return the level of detail.

    as_written  the lists to compare the stage's files with; None: no comparison
    level       level of detail; None: the finest with at most MAX_TRIANGLES triangles
    tiles       IDs of the tiles to write; empty: all tiles
    channels    IDs of the channels to write; empty: those that are visible at opening, or all
                channels if none of those is drawn
    scale       length in the file / length of the specimen; None: the longest edge is SIZE_M

    Returns None if no mesh is drawn, and deletes an older file at `path`. Raises StageError if the
    stage can't be read, and OutputError if the file can't be written.
    """
    as_written = as_written or AsWritten({stage_path.parent: {}})
    stage = open_stage(stage_path)
    prims = [prim for prim in tile_prims(stage) if not tiles or prim.GetName() in tiles]
    found, shown = find_parts(stage, prims, as_written, level=level, channels=channels)
    if shown is None or not found:
        path.unlink(missing_ok=True)
        return None
    boxes = [hinted_box(prim) for prim in prims]
    low = np.min([box[0] for box in boxes], axis=0)
    high = np.max([box[1] for box in boxes], axis=0)
    longest_um = float((high - low).max())
    size_m = SIZE_M if scale is None else longest_um * METERS_PER_UNIT * scale
    flat = _new_stage(specimen_name(stage), longest_um, size_m, shown)
    additions = [] if tiles else list(read_additions(stage))
    lowest = min([low[1], *(float(one.mesh.positions[:, 1].min()) for one in additions)])
    foot = np.array([(low[0] + high[0]) / 2, lowest, (low[2] + high[2]) / 2])
    _define_parts(flat, found, foot, size_m / longest_um)
    _define_additions(flat, additions, foot, size_m / longest_um)
    images = {
        _texture_name(part, kind): file for part in found for kind, file in _images(part).items()
    }
    content = {name: as_written.require(file).read_bytes() for name, file in images.items()}
    content |= copy_lights(stage, flat, as_written)
    _pack(flat.GetRootLayer(), content, path)
    return shown


def find_parts(
    stage: Usd.Stage,
    prims: list[Usd.Prim],
    as_written: AsWritten,
    *,
    level: int | None = None,
    channels: Collection[str] = (),
) -> tuple[list[_Part], int | None]:
    """Return the meshes of the tiles `prims`, and their level of detail; see `write_usdz`."""
    found: list[_Part] = []
    shown = level
    for some in [channels] if channels else _choices(stage):
        shown = _choose_level(stage, some, as_written) if level is None else level
        if shown is not None and (found := list(_read_parts(stage, prims, some, shown))):
            break
    return found, shown


def _choices(stage: Usd.Stage) -> list[list[str]]:
    """Return lists of channel IDs to try: those that show at opening, then all channels."""
    every = stage.GetPrimAtPath(specimen_of(stage).channels).GetChildren()
    names = [str(prim.GetName()) for prim in every]
    shown = [name for name, prim in zip(names, every, strict=True) if shows_at_first(prim)]
    return [shown, names] if shown else [names]


def _choose_level(stage: Usd.Stage, channels: Collection[str], as_written: AsWritten) -> int | None:
    """Return the finest level within MAX_TRIANGLES, or else the coarsest; None: no mesh."""
    counts: list[list[int]] = []
    for name in [str(prim.GetName()) for prim in tile_prims(stage)]:
        with loaded(stage, name, as_written=as_written) as (tile, _):
            counts.append(
                [_count_triangles(tile, channels, level) for level in lod_levels(tile) or [0]]
            )
    if not any(map(sum, counts)):
        return None
    levels = range(max(map(len, counts)))
    totals = [sum(tile[min(level, len(tile) - 1)] for tile in counts) for level in levels]
    light = [level for level in levels if totals[level] <= MAX_TRIANGLES]
    return light[0] if light else levels[-1]


def _count_triangles(tile: Usd.Prim, channels: Collection[str], level: int) -> int:
    found = (mesh_at(tile, channel, level) for channel in channels)
    return sum(count_faces(prim) for prim in found if prim is not None)


def _read_parts(
    stage: Usd.Stage, prims: list[Usd.Prim], channels: Collection[str], level: int
) -> Iterator[_Part]:
    """Yield each drawn mesh with triangles, at a level of detail or else the next finer one."""
    for name in [str(prim.GetName()) for prim in prims]:
        with loaded(stage, name) as (tile, _):
            for channel in channels:
                wanted = [one for one in reversed(lod_levels(tile) or [0]) if one <= level]
                lod = next(read_lods(tile, channel, wanted=wanted), None)
                if lod is not None and len(lod.mesh.triangles):
                    yield _Part(name, channel, lod)


def _new_stage(name: str, longest_um: float, size_m: float, level: int) -> Usd.Stage:
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    layer.defaultPrim = ROOT.name
    layer.customLayerData = {
        "stereocell": {
            "lod": level,
            "note": f"Scaled: the longest edge of {longest_um:g} um is {size_m:g} m here.",
            "scale": size_m / (longest_um * METERS_PER_UNIT),
            "size": size_m,
        }
    }
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UP_AXIS)
    root = UsdGeom.Xform.Define(stage, ROOT).GetPrim()
    root.SetDisplayName(name)
    Usd.ModelAPI(root).SetKind(Kinds.Tokens.component)
    return stage


def _define_parts(
    stage: Usd.Stage,
    parts: list[_Part],
    foot: NDArray[np.float64],
    scale: float,
) -> None:
    """Define the meshes of a usdz, tile by tile.

    foot   point (x, y, z) that moves to the origin, world um
    scale  metres in the file per um

    The meshes of a channel share one material. A mesh gets its own material if it has maps, values
    at vertices, or other material values than the first mesh of its channel.
    """
    looks = UsdGeom.Scope.Define(stage, ROOT.AppendChild("Looks")).GetPath()
    usual: dict[str, Material] = {}
    for part in parts:
        branch = UsdGeom.Xform.Define(stage, ROOT.AppendChild(part.tile)).GetPath()
        leaf = f"{part.channel}_{part.tile}"
        is_usual = usual.setdefault(part.channel, part.lod.material) == part.lod.material
        mesh_itself = part.lod.mesh.colors is not None or part.lod.mesh.openness is not None
        is_own = not is_usual or part.lod.maps.any or mesh_itself
        look = looks.AppendChild(f"{leaf if is_own else part.channel}_look")
        mesh = UsdGeom.Mesh.Define(stage, branch.AppendChild(leaf))
        material = _define_look(stage, look, part, mesh)
        _fill_mesh(mesh, part.lod.mesh, (part.lod.mesh.positions - foot) * scale)
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)


def _define_additions(
    stage: Usd.Stage, additions: list[Addition], foot: NDArray[np.float64], scale: float
) -> None:
    """Define the meshes that layers add, each with its own material."""
    for number, addition in enumerate(additions):
        name = f"addition{number}"
        mesh = UsdGeom.Mesh.Define(stage, ROOT.AppendPath(f"Annotations/{name}"))
        mesh.GetPrim().SetDisplayName(addition.name)
        _fill_mesh(mesh, addition.mesh, (addition.mesh.positions - foot) * scale)
        look = ROOT.AppendPath(f"Looks/{name}_look")
        material = _define_surface(stage, look, addition.material)
        if addition.mesh.colors is not None:
            feed_vertices(mesh, look, "color", addition.mesh.colors)
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)


def _fill_mesh(mesh: UsdGeom.Mesh, shape: Mesh, positions: NDArray[np.float64]) -> None:
    points, triangles = vec3f(positions), shape.triangles.astype(np.int32)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateDoubleSidedAttr(True)  # its inside can be seen, since it is open at the tile's faces
    mesh.CreatePointsAttr(points)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray(len(triangles), 3))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(triangles.ravel()))
    mesh.CreateNormalsAttr(vec3f(shape.normals))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    if shape.uvs is not None:
        primvars = UsdGeom.PrimvarsAPI(mesh)
        st = primvars.CreatePrimvar("st", _Types.TexCoord2fArray, UsdGeom.Tokens.vertex)
        uvs = np.ascontiguousarray(shape.uvs, dtype=np.float32)
        st.Set(Vt.Vec2fArray.FromNumpy(uvs))


def _define_look(
    stage: Usd.Stage, path: Sdf.Path, part: _Part, mesh: UsdGeom.Mesh
) -> UsdShade.Material:
    material = _define_surface(stage, path, part.lod.material)
    for kind in _images(part):
        feed_image(stage, path, kind, _texture_name(part, kind))
    if part.lod.mesh.openness is not None:
        feed_vertices(mesh, path, "occlusion", part.lod.mesh.openness)
    if part.lod.mesh.colors is not None:
        feed_vertices(mesh, path, "color", part.lod.mesh.colors)
    return material


def _define_surface(stage: Usd.Stage, path: Sdf.Path, given: Material) -> UsdShade.Material:
    """Define a material of a usdz with plain values, without images."""
    material = UsdShade.Material.Define(stage, path)
    surface = UsdShade.Shader.Define(stage, path.AppendChild("surface"))
    surface.CreateIdAttr("UsdPreviewSurface")
    surface.CreateInput("diffuseColor", _Types.Color3f).Set(Gf.Vec3f(*given.color))
    surface.CreateInput("metallic", _Types.Float).Set(given.metallic)
    surface.CreateInput("roughness", _Types.Float).Set(given.roughness)
    if given.opacity < 1:
        surface.CreateInput("opacity", _Types.Float).Set(given.opacity)
    if any(given.emission):
        surface.CreateInput("emissiveColor", _Types.Color3f).Set(Gf.Vec3f(*given.emission))
    surface.CreateOutput("surface", _Types.Token)
    material.CreateSurfaceOutput().ConnectToSource(surface.GetOutput("surface"))
    return material


def _images(part: _Part) -> dict[Kind, Path]:
    """Return the image files of a mesh's maps, by kind."""
    maps = part.lod.maps
    named: dict[Kind, Path | None] = {
        "normal": maps.normal,
        "occlusion": maps.occlusion,
        "color": maps.color,
    }
    return {kind: file for kind, file in named.items() if file is not None}


def _texture_name(part: _Part, kind: Kind) -> str:
    return f"textures/{part.channel}_{part.tile}_{kind}.png"


def _pack(layer: Sdf.Layer, images: Mapping[str, bytes], path: Path) -> None:
    """Write an archive with the layer first, and then the images by name.

    Raises OutputError if it can't be written.
    """
    with tempfile.TemporaryDirectory() as folder:
        export(layer, Path(folder) / _LAYER)
        files = {_LAYER: (Path(folder) / _LAYER).read_bytes(), **images}
        with replacing(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
            for name, content in files.items():
                archive.writestr(_entry(name, archive.start_dir), content)


def _entry(name: str, offset: int) -> zipfile.ZipInfo:
    """Return the header of an uncompressed file that is added to an archive at an offset.

    The header is padded so that the file's bytes start at a multiple of 64, as usdz requires. USD's
    own writer stores the current time, so its archives would differ in each run.
    """
    info = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
    padding = -(offset + _HEAD_BYTES + len(name.encode()) + _EXTRA_BYTES) % 64
    info.extra = struct.pack("<HH", _PADDING_ID, padding) + bytes(padding)
    return info
