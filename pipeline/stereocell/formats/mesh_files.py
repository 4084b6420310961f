"""Write bodies as PLY or OBJ, by trimesh.

The other formats have their own writers here. trimesh's 3MF lacks units, colours and slicers' lists
of parts, and its glTF holds the whole scene in memory. A build also writes STL, and each of its
worker processes would need a second to import trimesh.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from stereocell.formats.body import Body
from stereocell.model.identifiers import to_identifier
from stereocell.model.version import GENERATOR

_DIGITS = 9  # significant digits of a 32-bit float


def write_ply(path: Path, bodies: Sequence[Body], *, unit: str) -> None:
    """Write one binary mesh with a colour at each vertex. `unit` is written in a comment."""
    import trimesh  # slow to import

    meshes = [
        trimesh.Trimesh(body.positions, body.triangles, process=False, vertex_colors=body.srgb)
        for body in bodies
    ]
    data = trimesh.util.concatenate(meshes).export(file_type="ply")
    magic, encoding, rest = data.split(b"\n", 2)
    comment = f"comment {GENERATOR}, unit {unit}".encode()
    path.write_bytes(b"\n".join([magic, encoding, comment, rest]))


def write_obj(path: Path, bodies: Sequence[Body], *, unit: str) -> None:
    """Write `path` and a .mtl file beside it. Names become identifiers, without spaces."""
    import trimesh  # slow to import

    scene = trimesh.Scene()
    for body in bodies:
        name = to_identifier(body.name)
        material = trimesh.visual.material.SimpleMaterial(name=name, diffuse=body.srgb)
        visual = trimesh.visual.TextureVisuals(material=material)
        mesh = trimesh.Trimesh(body.positions, body.triangles, process=False, visual=visual)
        scene.add_geometry(mesh, geom_name=name)
    largest = max(float(np.abs(body.positions).max()) for body in bodies)
    text, beside = trimesh.exchange.obj.export_obj(
        scene,
        include_normals=False,
        return_texture=True,
        digits=max(_DIGITS - 1 - math.floor(math.log10(largest)), 0),
        mtl_name=path.with_suffix(".mtl").name,
        header=f"{GENERATOR}, unit {unit}",
    )
    path.write_text(text, encoding="utf-8", newline="\n")
    for name, data in beside.items():
        (path.parent / name).write_bytes(data)
