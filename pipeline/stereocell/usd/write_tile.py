"""Write one tile of a stage: tile.usdc with its volumes and baked maps.

A tile's materials inherit the prim /Specimen/Channels/<channel>, which is not in this file. USD
finds it in the stage that loads the tile as a payload. So this one prim sets the appearance of all
tiles, and an edit of it in any layer over the stage changes all of them. The tile also states the
colour itself. That opinion is weaker and counts only if the tile is opened alone.

Baked maps belong to the tile. The maps of each level (normals, occlusion, intensity of the sampled
channel) feed the shader inside the level's variant. An opinion of the channel's material would be
stronger, so a channel that shows a sampled channel has no opinion about diffuseColor.

In the same way, a channel's surface and volume inherit the visibility of /Specimen/Shown/<channel>.

`lod1` is the default. Artists arrange and light all tiles at once, and all finest levels together
would have millions of triangles too many. They select `lod0` for the final frame. Neither of the
two limits the detail of the bundle, but a coarser level does (usd/read_variants.py).
"""

import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdVol, Vt
from pxr import Kind as Kinds

from stereocell.formats.exr import write_atlas
from stereocell.formats.vdb import GRID_NAME, MEASURED_NAME, write_vdb
from stereocell.formats.vdb_read import read_vdb_head
from stereocell.meshes.weld import weld_seams
from stereocell.model.color import to_srgb8
from stereocell.model.errors import StageError
from stereocell.model.identifiers import from_identifier
from stereocell.model.mesh import Lod, Mesh
from stereocell.model.tile_content import APRON, ChannelContent, TileContent
from stereocell.model.world_box import world_box
from stereocell.storage.atomic_write import replacing_folder
from stereocell.storage.file_list import FileList, measure
from stereocell.storage.workspace import move
from stereocell.usd.layer import (
    CHANNELS,
    DISTANCE,
    DISTANCE_SAMPLES,
    LARGEST_DISTANCE,
    SHAPE_HASH,
    SHOWN,
    SURFACE_API,
    export,
    hash_shape,
    new_stage,
    set_attribute,
    vec3d,
    vec3f,
)
from stereocell.usd.preview_surface import define_surface, repeat_color
from stereocell.usd.shader_inputs import Kind, feed_image, feed_primvar, feed_vertices
from stereocell.usd.write_objects import define_objects, write_objects

DEFAULT_LOD = 1  # level of detail that a stage selects by default
LAYER_NAME = "tile.usdc"

_STEPS = np.arange(256, dtype=np.uint8)  # possible values of bytes that are baked at vertices

_Types = Sdf.ValueTypeNames


@dataclass(frozen=True, slots=True)
class Written:
    """Files that were written into a folder.

    files           list of the files, by name
    measured_bytes  bytes of the voxels as measured in them
    """

    files: FileList
    measured_bytes: int


def write_tile(
    stage_dir: Path,
    tile: TileContent,
    *,
    has_vdb: bool = True,
    parts: Mapping[Path, Written] | None = None,
) -> Written:
    """Write the folder `stage_dir`/tiles/<tile>/, and replace an older one.

    has_vdb  whether volumes get OpenVDB fields, which other programs draw
    parts    folders of the files of all channels, in their order, which `write_channel` wrote.
             They are moved into the tile's folder, and the channels need no voxels. None: the files
             are written here

    Tiles do not depend on each other. Raises OutputError if a file can't be written, and ValueError
    (a bug) if the shape of a volume does not fit its tile.
    """
    for channel in tile.channels:
        _check_shape(tile, channel)
    with replacing_folder(stage_dir / "tiles" / tile.id) as folder:
        if parts is None:
            written = [write_channel(folder, tile, one, has_vdb=has_vdb) for one in tile.channels]
        else:
            written = list(parts.values())
            for part, one in parts.items():
                for name in one.files:
                    move(part / name, folder / name)
        export(_compose(tile, written), folder / LAYER_NAME)
        files = {LAYER_NAME: measure(folder / LAYER_NAME)}
        files |= {name: dict(entry) for one in written for name, entry in one.files.items()}
        measured_bytes = sum(one.measured_bytes for one in written)
        return Written(dict(sorted(files.items())), measured_bytes)


def write_channel(
    folder: Path, tile: TileContent, channel: ChannelContent, *, has_vdb: bool = True
) -> Written:
    """Write all files of one channel of a tile, except the layer, into a folder.

    Raises OutputError if a file can't be written, and ValueError (a bug) if the shape of the volume
    does not fit the tile.
    """
    _check_shape(tile, channel)
    files = list(_write_files(folder, tile, channel, has_vdb))
    grids = [grid for file in files if file.suffix == ".vdb" for grid in read_vdb_head(file)]
    measured_bytes = sum(grid.end - grid.start for grid in grids if grid.name == MEASURED_NAME)
    return Written({file.name: measure(file) for file in files}, measured_bytes)


def closed_file(stage_dir: Path, tile_id: str, channel_id: str) -> Path:
    """Return the path of the closed copy of a channel's surface, which `write_tile` writes."""
    return stage_dir / "tiles" / tile_id / _closed_name(channel_id)


def has_mesh(stage_dir: Path, tile_id: str, channel_id: str) -> bool:
    """Return whether a channel has a surface in a tile.

    Raises StageError if the tile's layer is missing or damaged.
    """
    path = stage_dir / "tiles" / tile_id / LAYER_NAME
    layer = Sdf.Layer.FindOrOpen(str(path)) if path.is_file() else None
    if layer is None:
        raise StageError(f"{path}: missing or damaged: run `stereocell stage OUT`")
    prim = f"/{tile_id}/{channel_id}/{channel_id}_{tile_id}"
    return layer.GetPrimAtPath(prim) is not None


def _fields_name(channel: ChannelContent) -> str:
    return f"{channel.channel_id}.vdb"


def _atlas_name(channel: ChannelContent) -> str:
    return f"{channel.channel_id}.exr"


def _closed_name(channel_id: str) -> str:
    return f"{channel_id}_closed.stl"


def _compose(tile: TileContent, written: Sequence[Written]) -> Sdf.Layer:
    """Return the layer of a tile, tile.usdc, before it is written.

    written  files of each channel, to which the layer refers
    """
    stage = new_stage(".usdc", tile.id)
    root = UsdGeom.Xform.Define(stage, Sdf.Path.absoluteRootPath.AppendChild(tile.id)).GetPrim()
    Usd.ModelAPI(root).SetKind(Kinds.Tokens.component)
    for channel, own in zip(tile.channels, written, strict=True):
        branch = UsdGeom.Xform.Define(stage, root.GetPath().AppendChild(channel.channel_id))
        branch.GetPrim().SetDisplayName(from_identifier(channel.channel_id))
        branch.GetPrim().GetInherits().AddInherit(SHOWN.AppendChild(channel.channel_id))
        _define_look(branch, tile, channel)
        if channel.lods:
            _define_mesh(branch, tile, channel)
        if _atlas_name(channel) in own.files:
            volume = _define_volume(branch, tile, channel)
            if _fields_name(channel) in own.files:
                _define_fields(volume, channel, has_measured=own.measured_bytes > 0)
    _author_lods(root, tile)
    _author_representations(root, tile, written)
    return stage.GetRootLayer()


def _volume_shape(tile: TileContent) -> tuple[int, int, int]:
    """Return the number of voxels (z, y, x) of the tile's volumes, with their apron."""
    box = np.subtract(tile.last_um, tile.first_um) / tile.spacing_um
    depth, height, width = (int(n) + 1 + 2 * APRON for n in np.rint(box))
    return depth, height, width


def _check_shape(tile: TileContent, channel: ChannelContent) -> None:
    if channel.volume is None:
        return
    expected = _volume_shape(tile)
    if channel.volume.shape != expected or channel.volume.dtype != np.uint8:
        found = f"{channel.volume.dtype} {channel.volume.shape}"
        raise ValueError(f"{tile.id}/{channel.channel_id}: {found}, expected uint8 {expected}")
    if channel.measured is not None and channel.measured.shape != expected:
        found = f"{channel.measured.shape} measured"
        raise ValueError(f"{tile.id}/{channel.channel_id}: {found}, expected {expected}")


def _write_files(
    folder: Path, tile: TileContent, channel: ChannelContent, has_vdb: bool
) -> Iterator[Path]:
    """Write the files of a channel, and yield the path of each."""
    if channel.volume is not None and has_vdb:
        write_vdb(
            fields := folder / _fields_name(channel),
            channel.volume[tuple(slice(APRON, APRON + n) for n in tile.own_shape)],
            first_um=tile.first_um,
            spacing_um=tile.spacing_um,
            measured=channel.measured,
            apron=APRON,
        )
        yield fields
    if channel.volume is not None:
        write_atlas(atlas := folder / _atlas_name(channel), channel.volume)
        yield atlas
    if channel.closed is not None:
        yield shutil.copyfile(channel.closed, folder / _closed_name(channel.channel_id))
    for level, lod in enumerate(channel.lods):
        for kind, image in _images(channel, lod):
            file = folder / _map_name(channel, level, kind)
            Image.fromarray(image).save(file, format="PNG")
            yield file


def _images(channel: ChannelContent, lod: Lod) -> Iterator[tuple[Kind, NDArray[np.uint8]]]:
    """Yield the baked maps of a level of detail with UVs: uint8, (h, w, 3) or (h, w)."""
    if lod.normal_map is None:
        return
    yield "normal", lod.normal_map
    if lod.baked is not None:
        yield "occlusion", lod.baked.openness
        if lod.baked.paint is not None and channel.paint is not None:
            yield "color", to_srgb8(channel.paint.mix(lod.baked.paint))


def _map_name(channel: ChannelContent, level: int, kind: Kind) -> str:
    return f"{channel.channel_id}_lod{level}_{kind}.png"


def _leaf(tile: TileContent, channel: ChannelContent, suffix: str = "") -> str:
    """Return a prim name that is unique in the stage, for programs that flatten the tree."""
    return f"{channel.channel_id}_{tile.id}{suffix}"


def _define_look(branch: UsdGeom.Xform, tile: TileContent, channel: ChannelContent) -> None:
    stage, path = branch.GetPrim().GetStage(), branch.GetPath()
    look = UsdShade.Material.Define(stage, path.AppendChild(_leaf(tile, channel, "_look")))
    look.GetPrim().GetInherits().AddInherit(CHANNELS.AppendChild(channel.channel_id))
    define_surface(look, channel.color)


def _bind(gprim: UsdGeom.Gprim, branch: UsdGeom.Xform, look: str) -> None:
    binding = UsdShade.MaterialBindingAPI.Apply(gprim.GetPrim())
    path = branch.GetPath().AppendChild(look)
    binding.Bind(UsdShade.Material.Get(gprim.GetPrim().GetStage(), path))


def _define_mesh(branch: UsdGeom.Xform, tile: TileContent, channel: ChannelContent) -> None:
    """Define the mesh with the properties that all levels of detail share."""
    stage = branch.GetPrim().GetStage()
    mesh = UsdGeom.Mesh.Define(stage, branch.GetPath().AppendChild(_leaf(tile, channel)))
    mesh.GetPrim().AddAppliedSchema(SURFACE_API)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateDoubleSidedAttr(True)  # its inside can be seen, since it is open at the tile's faces
    _bind(mesh, branch, _leaf(tile, channel, "_look"))
    if channel.objects is not None:
        look = branch.GetPath().AppendChild(_leaf(tile, channel, "_look"))
        feed_primvar(mesh, look, "color")
        define_objects(mesh, look, channel.channel_id, channel.objects, channel.touching)


def _define_volume(
    branch: UsdGeom.Xform, tile: TileContent, channel: ChannelContent
) -> UsdVol.Volume:
    """Define the volume, and refer to the file with its voxels that the bundle reads."""
    stage = branch.GetPrim().GetStage()
    path = branch.GetPath().AppendChild(_leaf(tile, channel, "_volume"))
    volume = UsdVol.Volume.Define(stage, path)
    _bind(volume, branch, _leaf(tile, channel, "_look"))

    first, spacing = np.asarray(tile.first_um), np.asarray(tile.spacing_um)
    low, high = world_box(first - spacing / 2, first + (np.asarray(tile.own_shape) - 0.5) * spacing)
    volume.CreateExtentAttr(vec3f([low, high]))
    depth, height, width = _volume_shape(tile)
    low, high = world_box(tile.first_um, tile.last_um)
    prim = volume.GetPrim()
    set_attribute(prim, "stereocell:atlas", _Types.Asset, f"./{_atlas_name(channel)}", custom=True)
    size = Gf.Vec3i(width, height, depth)
    set_attribute(prim, "stereocell:atlasSize", _Types.Int3, size, custom=True)
    set_attribute(prim, "stereocell:apron", _Types.Int, APRON, custom=True)
    set_attribute(prim, "stereocell:boundsMin", _Types.Double3, vec3d(low), custom=True)
    set_attribute(prim, "stereocell:boundsMax", _Types.Double3, vec3d(high), custom=True)
    return volume


def _define_fields(volume: UsdVol.Volume, channel: ChannelContent, *, has_measured: bool) -> None:
    """Define a volume's fields as its children, all in one file: programs read one per volume.

    The field `measured` includes the apron. The bundle applies an edited window to it, and the
    bundle's volumes need the apron.
    """
    stage, path = volume.GetPrim().GetStage(), volume.GetPath()
    tokens = UsdVol.Tokens
    fields = [(GRID_NAME, tokens.fogVolume, tokens.half)]
    if has_measured:
        fields.append((MEASURED_NAME, tokens.unknown, tokens.float_))
    for name, kind, numbers in fields:
        field = UsdVol.OpenVDBAsset.Define(stage, path.AppendChild(name))
        field.CreateFilePathAttr(f"./{_fields_name(channel)}")
        field.CreateFieldNameAttr(name)
        field.CreateFieldClassAttr(kind)
        field.CreateFieldDataTypeAttr(numbers)
        volume.CreateFieldRelationship(name, field.GetPath())


def _author_lods(root: Usd.Prim, tile: TileContent) -> None:
    """Write each level's geometry into a variant. A channel with fewer repeats its coarsest."""
    count = max((len(channel.lods) for channel in tile.channels), default=0)
    if count == 0:
        return
    variants = root.GetVariantSets().AddVariantSet("lod")
    for level in range(count):
        variants.AddVariant(f"lod{level}")
        variants.SetVariantSelection(f"lod{level}")
        with variants.GetVariantEditContext():
            for channel in tile.channels:
                if channel.lods:
                    own = min(level, len(channel.lods) - 1)
                    _author_lod(root, tile, channel, own)
    variants.SetVariantSelection(f"lod{min(DEFAULT_LOD, count - 1)}")


def _author_lod(root: Usd.Prim, tile: TileContent, channel: ChannelContent, level: int) -> None:
    lod = channel.lods[level]
    branch = root.GetPath().AppendChild(channel.channel_id)
    mesh = UsdGeom.Mesh.Get(root.GetStage(), branch.AppendChild(_leaf(tile, channel)))
    kept, welded = weld_seams(lod.mesh)
    points = vec3f(lod.mesh.positions[kept])
    triangles = welded[lod.mesh.triangles].astype(np.int32)
    mesh.CreatePointsAttr(points)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray(len(triangles), 3))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(triangles.ravel()))
    mesh.CreateNormalsAttr(vec3f(lod.mesh.normals[kept]))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    if len(points):
        mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    set_attribute(mesh.GetPrim(), DISTANCE, _Types.Float, lod.distance_um)
    set_attribute(mesh.GetPrim(), LARGEST_DISTANCE, _Types.Float, lod.largest_um)
    if lod.quality is not None:
        set_attribute(mesh.GetPrim(), DISTANCE_SAMPLES, _Types.Int, lod.quality.samples)
    set_attribute(mesh.GetPrim(), SHAPE_HASH, _Types.String, hash_shape(mesh))
    _author_uvs(mesh, lod.mesh)
    look = branch.AppendChild(_leaf(tile, channel, "_look"))
    if channel.objects is not None:
        write_objects(mesh, look, lod.mesh, channel.objects, kept)
    _author_maps(mesh, look, channel, level)


def _author_uvs(mesh: UsdGeom.Mesh, made: Mesh) -> None:
    """Write UVs and tangents by face corner, so that points need not be split at seams of charts.

    Both have one value for each vertex of `made`, whose seams are split, and an index per corner.
    """
    primvars, corner = UsdGeom.PrimvarsAPI(mesh), UsdGeom.Tokens.faceVarying
    indices = Vt.IntArray.FromNumpy(made.triangles.astype(np.int32).ravel())
    if made.uvs is not None:
        st = primvars.CreatePrimvar("st", _Types.TexCoord2fArray, corner)
        st.Set(Vt.Vec2fArray.FromNumpy(_float32(made.uvs)))
        st.SetIndices(indices)
    if made.tangents is not None:
        tangents = primvars.CreatePrimvar("tangents", _Types.Float4Array, corner)
        tangents.Set(Vt.Vec4fArray.FromNumpy(_float32(made.tangents)))
        tangents.SetIndices(indices)


def _author_maps(mesh: UsdGeom.Mesh, look: Sdf.Path, channel: ChannelContent, level: int) -> None:
    """Connect a level's baked maps, or its baked values at vertices, to the surface shader."""
    lod, stage = channel.lods[level], mesh.GetPrim().GetStage()
    has_maps = lod.normal_map is not None
    if has_maps and lod.mesh.uvs is None:
        raise ValueError(f"{look}: maps of lod{level} on a mesh without UVs")
    if has_maps:
        feed_image(stage, look, "normal", f"./{_map_name(channel, level, 'normal')}")
    baked = lod.baked
    is_painted = baked is not None and baked.paint is not None and channel.paint is not None
    if channel.color is not None and channel.objects is None and not is_painted:
        repeat_color(mesh, channel.color)
    if baked is None:
        return
    if has_maps:
        feed_image(stage, look, "occlusion", f"./{_map_name(channel, level, 'occlusion')}")
    else:
        _feed_steps(
            mesh, look, "occlusion", np.divide(_STEPS, 255, dtype=np.float32), baked.openness
        )
    if baked.paint is None or channel.paint is None:
        return
    if has_maps:
        feed_image(stage, look, "color", f"./{_map_name(channel, level, 'color')}")
        # The average colour, for programs that draw without materials.
        average = channel.paint.mix(baked.paint).reshape(-1, 3).mean(axis=0)
        UsdGeom.Gprim(mesh).CreateDisplayColorAttr([Gf.Vec3f(*map(float, average))])
    else:
        _feed_steps(mesh, look, "color", channel.paint.mix(_STEPS), baked.paint)


def _feed_steps(
    mesh: UsdGeom.Mesh,
    look: Sdf.Path,
    kind: Kind,
    table: NDArray[np.float32],
    at_vertices: NDArray[np.uint8],
) -> None:
    """Connect baked bytes at vertices to the surface shader, as indices into a short table.

    table        (256,) or (256, 3), the value that each byte stands for; only used ones are stored
    at_vertices  (n,), the byte of each vertex
    """
    used, indices = np.unique(at_vertices, return_inverse=True)
    feed_vertices(mesh, look, kind, table[used], indices.reshape(-1).astype(np.int32))


def _author_representations(root: Usd.Prim, tile: TileContent, written: Sequence[Written]) -> None:
    variants = root.GetVariantSets().AddVariantSet("representation")
    for name in ("mesh", "volume", "both"):
        variants.AddVariant(name)
        variants.SetVariantSelection(name)
        with variants.GetVariantEditContext():
            for channel, own in zip(tile.channels, written, strict=True):
                if _atlas_name(channel) not in own.files or name == "both":
                    continue  # a channel without a volume shows its surface in every variant
                if name == "mesh" or channel.lods:
                    suffix = "_volume" if name == "mesh" else ""
                    branch = root.GetPath().AppendChild(channel.channel_id)
                    path = branch.AppendChild(_leaf(tile, channel, suffix))
                    root.GetStage().OverridePrim(path).SetActive(False)
    variants.SetVariantSelection("mesh")


def _float32(values: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.ascontiguousarray(values, dtype=np.float32)
