"""Write the part of a bundle for one channel of a tile: its meshes, its volume, and its record.

Parts do not depend on each other. See tile_part.py for the folder of a part.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Usd

from stereocell.bundle.edited_meshes import shown_lods, with_vertex_occlusion
from stereocell.bundle.tile_part import (
    BundleTile,
    FileRef,
    PackedObjects,
    TileChannel,
    write_file,
    write_record,
)
from stereocell.bundle.windowed_voxels import read_windowed
from stereocell.bundle.write_volume import write_volume
from stereocell.formats.basis_textures import (
    encode_color_map,
    encode_normal_map,
    encode_occlusion_map,
)
from stereocell.formats.gltf import Glb, Textures, encode_glb
from stereocell.formats.gltf_features import Features
from stereocell.formats.tiles3d import TileLod
from stereocell.model.errors import StageError
from stereocell.model.mesh import Mesh
from stereocell.model.world_box import move_box
from stereocell.storage.atomic_write import replacing_folder
from stereocell.usd.composed_appearance import ComposedAppearance
from stereocell.usd.read_attributes import Point
from stereocell.usd.read_levels import ComposedLod, mesh_at
from stereocell.usd.read_objects import read_columns, read_tile_objects
from stereocell.usd.read_stage import hinted_box, loaded, open_stage
from stereocell.usd.read_textures import read_image
from stereocell.usd.read_volume import ComposedVolume, read_volume
from stereocell.usd.typed_values import usd_boundary
from stereocell.usd.written_files import AsWritten

FIRST_COLUMN = "volume_um3"  # ID of the first column in every table of objects


def write_tile(
    stage_path: Path,
    tile_id: str,
    part: Path,
    *,
    appearances: tuple[ComposedAppearance, ...],
    step_m: float,
    only: str | None = None,
) -> None:
    """Write the part of a bundle for one channel of a tile, or for all of them.

    part         folder of the part
    appearances  appearances of all channels
    step_m       step of the lattice for vertices, metres, see formats/gltf.py
    only         ID of the channel; None: all channels

    Opens the stage and loads only this tile. So it can run in any process, and tiles do not stay in
    memory. Raises StageError and OutputError.
    """
    as_written = AsWritten()
    stage = open_stage(stage_path)
    with (
        usd_boundary(stage_path),
        replacing_folder(part) as root,
        loaded(stage, tile_id, as_written=as_written) as (tile, choice),
    ):
        volumes = [read_volume(tile, appearance.id) for appearance in appearances]
        channels = [
            _export_channel(
                root,
                tile,
                appearance,
                volume=volume,
                finest_lod=choice.finest_lod,
                step_m=step_m,
                as_written=as_written,
            )
            for appearance, volume in zip(appearances, volumes, strict=True)
            if only in (None, appearance.id)
        ]
        low, high = find_bounds(tile, volumes)
        changed = tuple(sorted(path_from_stage(file, stage_path) for file in as_written.changed))
        made = BundleTile(
            tile_id,
            choice.representation,
            low,
            high,
            tuple(channels),
            changed,
            str(tile.GetDisplayName()),
        )
        write_record(root, made)


def path_from_stage(file: Path, stage_path: Path) -> str:
    """Return a layer's path relative to the stage's folder, or else its whole path."""
    folder = stage_path.absolute().parent
    return file.relative_to(folder).as_posix() if file.is_relative_to(folder) else str(file)


def find_bounds(tile: Usd.Prim, volumes: Sequence[ComposedVolume | None]) -> tuple[Point, Point]:
    """Return the corners (x, y, z), world um, of the box around a loaded tile's volumes.

    Without volumes, these are the corners of the tile's extentsHint.

    Raises StageError if the hint is missing or invalid.
    """
    boxes = [
        move_box(np.array(volume.low), np.array(volume.high), volume.matrix)
        for volume in volumes
        if volume is not None
    ]
    low, high = (np.array(corners) for corners in zip(*boxes or [hinted_box(tile)], strict=True))
    return _point(low.min(axis=0)), _point(high.max(axis=0))


def _export_channel(
    root: Path,
    tile: Usd.Prim,
    appearance: ComposedAppearance,
    *,
    volume: ComposedVolume | None,
    finest_lod: int,
    step_m: float,
    as_written: AsWritten,
) -> TileChannel:
    channel_id = appearance.id
    files: list[FileRef] = []
    lods: list[TileLod] = []
    triangles: list[int] = []
    distances: list[tuple[float, float]] = []
    finer = b""
    shown = shown_lods(tile, channel_id, finest_lod)
    levels = shown.lods
    objects, features = _objects(tile, channel_id, levels)
    for lod in levels:
        for image in lod.maps.files:
            as_written.require(image)
        glb = _encode(tile, channel_id, lod, step_m, features)
        triangles += [len(lod.mesh.triangles)] * (lod.level + 1 - len(triangles))
        distances += [(lod.distance_um, lod.largest_um)] * (lod.level + 1 - len(distances))
        if glb.data == finer:
            continue  # a channel with fewer levels than others repeats its coarsest level
        finer = glb.data
        if lod is levels[-1] and lods:
            lod = _bare(lod)
            glb = _encode(tile, channel_id, lod, step_m, features)
        uri = f"{tile.GetName()}/lod{lod.level}.glb"
        file = write_file(root, f"channels/{channel_id}/{uri}", glb.data)
        files.append(file)
        lods.append(TileLod(uri, file.sha256, lod.largest_um, glb.min_m, glb.max_m))
    entry = joint = None
    if volume is not None:
        voxels = read_windowed(volume, appearance, as_written=as_written)
        entry, written, joint = write_volume(root, tile.GetName(), appearance, volume, voxels)
        files += written
    return TileChannel(
        channel_id,
        tuple(lods),
        tuple(triangles),
        tuple(distances),
        entry,
        tuple(files),
        joint,
        shown.edit,
        objects,
    )


def _bare(lod: ComposedLod) -> ComposedLod:
    """Return the coarsest level of detail without values that show only at close range.

    Users wait for this level first. In the sample, maps, UVs and vertices that charts had split
    were five sixths of the coarsest level's bytes. The occlusion moves from the map to the
    vertices, as the finest level has it, so a tile's brightness does not change with the level.

    The lattice is that of all other levels. With a longer step, positions would take a third less,
    but there would be gaps of up to three quarters of a voxel to a finer neighbour.
    """
    mesh = with_vertex_occlusion(lod)
    maps = replace(lod.maps, normal=None, occlusion=None)
    images = lod.images and replace(lod.images, normal=None, occlusion=None)
    lod = replace(lod, mesh=mesh, maps=maps, images=images)
    if maps.color is not None or (images is not None and images.color is not None):
        return lod
    return replace(lod, mesh=_welded(replace(mesh, uvs=None, tangents=None)))


def _welded(mesh: Mesh) -> Mesh:
    """Merge vertices that are equal in all values."""
    parts = [mesh.positions, mesh.normals, mesh.colors, mesh.openness, mesh.objects, mesh.paint]
    values = [part.reshape(len(mesh.positions), -1) for part in parts if part is not None]
    _, first, twin = np.unique(
        np.concatenate(values, axis=1), axis=0, return_index=True, return_inverse=True
    )
    kept = np.sort(first)  # keeps the order of vertices
    triangles = np.searchsorted(kept, first)[twin.ravel()][mesh.triangles].astype(np.uint32)
    return replace(
        mesh,
        positions=mesh.positions[kept],
        triangles=triangles,
        normals=mesh.normals[kept],
        colors=None if mesh.colors is None else mesh.colors[kept],
        openness=None if mesh.openness is None else mesh.openness[kept],
        objects=None if mesh.objects is None else mesh.objects[kept],
        paint=None if mesh.paint is None else mesh.paint[kept],
    )


def _objects(
    tile: Usd.Prim, channel_id: str, levels: Sequence[ComposedLod]
) -> tuple[PackedObjects | None, Features | None]:
    """Return the objects of a tile's channel, and the features that its .glb files get."""
    described = read_columns(tile.GetStage(), channel_id)
    prim = mesh_at(tile, channel_id, levels[0].level) if levels else None
    if described is None or prim is None:
        return None, None
    columns, default = described
    found = read_tile_objects(prim, columns)
    mesh = levels[0].mesh
    if found is None or mesh.objects is None:
        return None, None
    boxes = np.full((len(found.labels), 6), np.nan, np.float32)
    order = np.argsort(mesh.objects, kind="stable")
    present, firsts = np.unique(mesh.objects[order], return_index=True)
    boxes[present, :3] = np.minimum.reduceat(mesh.positions[order], firsts)
    boxes[present, 3:] = np.maximum.reduceat(mesh.positions[order], firsts)
    packed = PackedObjects(
        found.labels.astype("<u8").tobytes(),
        found.names,
        {name: values.astype("<f4").tobytes() for name, values in found.values.items()},
        boxes.astype("<f4").tobytes(),
        found.touching.labels.astype("<u8").tobytes(),
        found.touching.area_um2.astype("<f4").tobytes(),
    )
    shown = [column for column in columns if column.id in (FIRST_COLUMN, default)]
    filled = tuple(replace(column, values=found.values[column.id]) for column in shown)
    return packed, Features(found.labels, filled)


def _encode(
    tile: Usd.Prim, channel_id: str, lod: ComposedLod, step_m: float, features: Features | None
) -> Glb:
    prim = f"{tile.GetPath()}/{channel_id}/{channel_id}_{tile.GetName()}"
    maps = lod.images or lod.maps
    textures = Textures(
        None if maps.normal is None else encode_normal_map(read_image(maps.normal)),
        None if maps.occlusion is None else encode_occlusion_map(read_image(maps.occlusion)),
        None if maps.color is None else encode_color_map(read_image(maps.color)),
    )
    try:
        return encode_glb(
            lod.mesh,
            step_m,
            material=lod.material,
            name=f"{channel_id}_{tile.GetName()}",
            extras={"tile": tile.GetName(), "channel": channel_id},
            textures=textures,
            features=features if lod.mesh.objects is not None else None,
        )
    except ValueError as error:  # an artist's edit made the mesh invalid
        raise StageError(f"{prim}: lod{lod.level}: {error}") from error


def _point(values: Any) -> Point:
    x, y, z = (float(n) for n in values)
    return x, y, z
