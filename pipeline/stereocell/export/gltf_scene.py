"""Write the specimen as one glTF file, in metres, y up.

There is a node for each channel, and below it one for each tile. In a label map, each object has
its own node with its name. If there would be more than MAX_NODES of them, the objects of a tile
become one mesh with colours at vertices. Meshes and curves that layers add also have nodes, unless
only some tiles or a region are exported.
"""

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from stereocell.export.chosen import Chosen, Piece
from stereocell.export.packed_gltf import packed_buffers
from stereocell.formats.gltf import Material
from stereocell.formats.plain_gltf import Buffers, Document, PlainBuffers
from stereocell.model.counted import counted
from stereocell.model.errors import StageError
from stereocell.model.mesh import Mesh
from stereocell.objects.split import split_objects
from stereocell.usd.layer import METERS_PER_UNIT
from stereocell.usd.read_additions import read_additions
from stereocell.usd.read_attributes import shortest
from stereocell.usd.read_stage import specimen_name

_ADDED = "Added"  # name of the node above the meshes and curves that layers add
MAX_NODES = 5000  # largest number of objects with nodes; programs take minutes to open more


def write_gltf(chosen: Chosen, path: Path, level: int) -> str:
    """Write .glb or .gltf; return a sentence about it. Raises OutputError and StageError."""
    options = chosen.options
    scale = METERS_PER_UNIT * (options.scale or 1.0)
    with tempfile.TemporaryFile(dir=path.parent) as file:
        buffers = _buffers(chosen, file, level)
        extras = {"lod": level, "metres_per_um": scale}
        document = Document(specimen_name(chosen.stage), buffers, extras)
        count = triangles = 0
        for piece in chosen.pieces(level):
            is_split = count + len(piece.object_names) <= MAX_NODES
            for name, mesh, more in _parts(piece, is_split):
                positions = mesh.positions.astype(np.float64) * scale
                where = {"tile": piece.tile, "channel": piece.channel.name, **more}
                if not np.isfinite(positions).all():
                    raise StageError(
                        f"{piece.tile}/{piece.channel.id}: found a point that is not finite, "
                        "expected finite positions"
                    )
                mesh, material = _of_one_color(mesh, piece.material)
                document.add(
                    piece.channel.name,
                    name,
                    mesh,
                    positions,
                    material,
                    where,
                    occlusion=bool(options.occlusion),
                )
                count += 1
                triangles += len(mesh.triangles)
        if not count:
            raise chosen.nothing("surface")
        for addition in [] if chosen.is_part else read_additions(chosen.stage):
            mesh, material = _of_one_color(addition.mesh, addition.material)
            positions = mesh.positions.astype(np.float64) * scale
            where = {"addition": addition.path}
            document.add(_ADDED, addition.name, mesh, positions, material, where)
            count += 1
            triangles += len(mesh.triangles)
        document.write(path)
    meshes = f"{counted(count, 'mesh', 'meshes')}, {triangles:,} triangles at lod{level}"
    return f"{meshes}, in metres; {chosen.describe_scale(options.scale or 1.0)}"


def _of_one_color(mesh: Mesh, material: Material) -> tuple[Mesh, Material]:
    """Move the colour of a mesh from its vertices to its material, if all vertices have the same.

    More programs show the colour of a material than colours of vertices.
    """
    if mesh.colors is None or (mesh.colors != mesh.colors[0]).any():
        return mesh, material
    red, green, blue = (shortest(part) for part in mesh.colors[0].clip(0, 1))
    return replace(mesh, colors=None), replace(material, color=(red, green, blue))


def _buffers(chosen: Chosen, file: BinaryIO, level: int) -> Buffers:
    if chosen.options.compress is None:
        return PlainBuffers(file)
    low, high = chosen.box
    scale = METERS_PER_UNIT * (chosen.options.scale or 1.0)
    return packed_buffers(chosen.options.compress, low * scale, high * scale)


def _parts(piece: Piece, is_split: bool) -> Iterator[tuple[str, Mesh, dict[str, str | int]]]:
    """Yield name, mesh and extras of a whole piece, or of each object in it."""
    objects, mesh = piece.objects, piece.mesh
    if objects is None or mesh.objects is None or not is_split:
        yield f"{piece.channel.name} {piece.tile}", mesh, {}
        return
    names = piece.object_names
    for number, part in split_objects(mesh):
        yield names[number], part, {"label": int(objects.labels[number])}
