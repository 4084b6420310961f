"""Closed solids for 3D printers and mesh programs: .stl, .3mf, .ply, .obj.

A body a channel, all tiles united; of a label map a body an object. STL has no names: there all
channels become one body, or they would be solid twice where they overlap. Lengths are scaled so
that the specimen fits a hand, if --scale says nothing else.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import manifold3d
import numpy as np
from numpy.typing import NDArray

from stereocell.export.chosen import Chosen, Piece
from stereocell.export.options import UNITS_M
from stereocell.export.thin_walls import describe_thin
from stereocell.export.unite import Corners, cut_to, to_mesh, to_solid, unite, weld
from stereocell.formats.body import Body
from stereocell.formats.obj import write_obj
from stereocell.formats.ply import write_ply
from stereocell.formats.stl import write_stl_file
from stereocell.formats.threemf import write_3mf
from stereocell.model.color import to_srgb8
from stereocell.model.errors import StageError
from stereocell.objects.split import split_objects
from stereocell.usd.layer import METERS_PER_UNIT
from stereocell.usd.read_stage import specimen_name

HAND_M = 0.1  # longest edge of a specimen in print, if no --scale is given
WALL_MM = 0.8  # two lines of the usual nozzle of 0.4 mm
Color = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class _Part:
    """What becomes one body: surfaces of several tiles. `color`: linear RGB."""

    name: str
    color: Color
    meshes: list[tuple[NDArray[np.float32], NDArray[np.uint32]]]


def write_print(chosen: Chosen, path: Path, level: int) -> str:
    """Write the solids; return a line about them. Raises StageError and OutputError."""
    options = chosen.options
    scale = options.scale or _handy(chosen)
    unit = options.units or "mm"
    factor = scale * METERS_PER_UNIT / UNITS_M[unit]
    wall = options.wall_mm if options.wall_mm is not None else WALL_MM
    ending = path.suffix.lower()
    bodies: list[Body] = []
    thin: list[str] = []
    for part, solid in _solids(chosen, level, is_one=ending == ".stl"):
        thin += describe_thin(
            solid, part.name, wall_um=wall * 1e-3 / scale / METERS_PER_UNIT, um_per_mm=1e3 / scale
        )
        places, triangles = to_mesh(solid)
        red, green, blue = to_srgb8(np.array(part.color, np.float32)).tolist()
        positions = (places.astype(np.float64) * factor).astype(np.float32)
        bodies.append(Body(part.name, (red, green, blue), positions, triangles))
    if not bodies:
        raise StageError(f"{chosen.path}: no surface is left to export")
    if ending == ".3mf":
        write_3mf(path, bodies, title=specimen_name(chosen.stage), unit=unit)
    elif ending == ".ply":
        write_ply(path, bodies, unit=unit)
    elif ending == ".obj":
        write_obj(path, bodies, unit=unit)
    else:
        write_stl_file(path, bodies, unit=unit)
    x, y, z = np.ptp(np.concatenate([body.positions for body in bodies]), axis=0).tolist()
    count = sum(len(body.triangles) for body in bodies)
    size = f"{x:.3g} x {y:.3g} x {z:.3g} {unit}, {scale:g} times the specimen"
    line = f"{_counted(len(bodies), 'body', 'bodies')}, {count} triangles at lod{level}, {size}"
    return "\n".join([line, *thin])


def _counted(count: int, one: str, many: str) -> str:
    return f"{count} {one if count == 1 else many}"


def _handy(chosen: Chosen) -> float:
    """Return 1, 2 or 5 times a power of ten, by which the specimen fits a hand."""
    low, high = chosen.box
    most = HAND_M / (float((high - low).max()) * METERS_PER_UNIT)
    power = 10.0 ** math.floor(math.log10(most))
    return max(step * power for step in (1, 2, 5) if step * power <= most)


def _solids(
    chosen: Chosen, level: int, *, is_one: bool
) -> Iterator[tuple[_Part, manifold3d.Manifold]]:
    """Yield the bodies; `is_one`: one of all."""
    boxes = _boxes(chosen)
    found = []
    for part, own in _parts(chosen, level, is_one):
        solid = unite([to_solid(*weld(one.meshes), one.name) for one in own])
        if boxes:
            solid = cut_to(solid, boxes)
        if solid.is_empty():
            continue
        if is_one:
            found.append((part, solid))
        else:
            yield part, solid
    if found:
        name = " ".join(part.name for part, _ in found)
        yield replace(found[0][0], name=name), unite([solid for _, solid in found])


def _parts(chosen: Chosen, level: int, is_one: bool) -> Iterator[tuple[_Part, list[_Part]]]:
    """Yield each body, and the closed surfaces that it is united from."""
    for channel in chosen.channels:
        found: dict[object, _Part] = {}
        color: Color | None = None
        for piece in chosen.pieces(level, whole=True, channel=channel.id):
            color = color or _color_of(piece)
            for key, name, own, mesh in _surfaces(piece):
                part = found.setdefault(key, _Part(name, own, []))
                part.meshes.append(mesh)
        if color is None:
            continue
        parts = list(found.values())
        if len(parts) == 1 or is_one or not all(isinstance(key, int) for key in found):
            yield _Part(channel.name, color, []), parts
        else:
            yield from ((part, [part]) for part in parts)


def _surfaces(
    piece: Piece,
) -> Iterator[tuple[object, str, Color, tuple[NDArray[np.float32], NDArray[np.uint32]]]]:
    """Yield a piece's surfaces: the key of what they are a part of, its name and colour, the mesh.

    The key of an object is its number; that of a tile how it was moved: equally moved tiles fit.
    """
    mesh = piece.mesh
    if piece.objects is None or mesh.objects is None:
        yield piece.moved, piece.channel.name, _color_of(piece), (mesh.positions, mesh.triangles)
        return
    names, labels = piece.object_names, piece.objects.labels.tolist()
    for number, part in split_objects(mesh):
        color = piece.material.color
        if part.colors is not None:
            red, green, blue = part.colors.mean(axis=0).astype(float).tolist()
            color = red, green, blue
        yield labels[number], names[number], color, (part.positions, part.triangles)


def _color_of(piece: Piece) -> Color:
    """Return the colour of a body: a channel's own, though vertices may have colours."""
    return piece.channel.color if piece.mesh.colors is not None else piece.material.color


def _boxes(chosen: Chosen) -> list[Corners]:
    """Return the boxes that solids are cut to; none: they stay whole."""
    options = chosen.options
    if not options.tiles and options.region is None:
        return []
    all_boxes = chosen.tile_boxes()
    lows, highs = (np.array([box[end] for box in all_boxes.values()]) for end in (0, 1))
    low, high = lows.min(axis=0), highs.max(axis=0)
    far = float((high - low).max())  # surfaces are closed a voxel beyond the outermost tiles
    boxes = []
    for name in chosen.tiles:
        start, end = all_boxes[name]
        start, end = (
            np.where(start <= low, low - far, start),
            np.where(end >= high, high + far, end),
        )
        if options.region is not None:
            start = np.maximum(start, options.region.low)
            end = np.minimum(end, options.region.high)
        if (start < end).all():
            boxes.append((start, end))
    if not boxes:
        raise StageError(f"{chosen.path}: no tile is in --region")
    return boxes
