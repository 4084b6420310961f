"""Write closed solids for 3D printers and mesh programs: .stl, .3mf, .ply, .obj.

There is one body per channel, united from all tiles, or one per object of a label map. STL has no
names, so all channels become one body there: separate ones would overlap. Without --scale, the
specimen is scaled to the size of a hand.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import manifold3d
import numpy as np
from numpy.typing import NDArray

from stereocell.export.cap import close_cuts
from stereocell.export.chosen import Chosen, Piece
from stereocell.export.options import UNITS_M, ExportOptions
from stereocell.export.thin_walls import describe_thin
from stereocell.export.unite import Corners, cut_to, to_mesh, to_solid, unite, weld
from stereocell.formats.body import Body
from stereocell.formats.mesh_files import write_obj, write_ply
from stereocell.formats.stl import write_stl_file
from stereocell.formats.threemf import write_3mf
from stereocell.meshes.validity import border
from stereocell.model.color import to_srgb8
from stereocell.model.counted import counted
from stereocell.model.errors import StageError
from stereocell.model.physical_size import describe_size
from stereocell.objects.split import split_objects
from stereocell.usd.layer import METERS_PER_UNIT
from stereocell.usd.read_provenance import has_caps
from stereocell.usd.read_stage import specimen_name

HAND_M = 0.1  # m, size of a hand: limit for the specimen's longest edge without --scale
UNIT = "mm"  # unit that slicers assume for numbers without a unit
WALL_MM = 0.8  # mm, two lines of the usual nozzle of 0.4 mm
# Largest number of parts (channels or objects) whose thin bodies are reported; a label map may have
# thousands
_MAX_REPORTED = 8
Color = tuple[float, float, float]


Mesh = tuple[NDArray[np.float32], NDArray[np.uint32]]  # positions and triangles


@dataclass(slots=True)
class _Surface:
    """Meshes of tiles that fit together, and the faces of these tiles; see `Piece`."""

    moved: tuple[float, ...]
    meshes: list[Mesh] = field(default_factory=list)
    cuts: set[tuple[int, float]] = field(default_factory=set)


@dataclass(frozen=True, slots=True)
class _Part:
    """A channel, or an object of a label map, which becomes one body of the file.

    channel   ID of the channel
    color     linear RGB
    surfaces  by label (None: not a label map) and by `Piece.moved`
    """

    channel: str
    name: str
    color: Color
    surfaces: dict[tuple[int | None, tuple[float, ...]], _Surface] = field(default_factory=dict)


def _write_3mf(path: Path, bodies: Sequence[Body], title: str, options: ExportOptions) -> None:
    unit, components = options.units or UNIT, bool(options.components)
    write_3mf(path, bodies, title=title, unit=unit, components=components)


# Functions that write bodies, by the file's ending; the text is the specimen's name
_WRITERS: dict[str, Callable[[Path, Sequence[Body], str, ExportOptions], None]] = {
    ".stl": lambda path, bodies, _, asked: write_stl_file(path, bodies, unit=asked.units or UNIT),
    ".3mf": _write_3mf,
    ".ply": lambda path, bodies, _, asked: write_ply(path, bodies, unit=asked.units or UNIT),
    ".obj": lambda path, bodies, _, asked: write_obj(path, bodies, unit=asked.units or UNIT),
}


def write_print(chosen: Chosen, path: Path, level: int) -> str:
    """Write the solids; return a line about them, and lines about thin bodies.

    Raises StageError and OutputError.
    """
    options = chosen.options
    scale = options.scale or _handy(chosen)
    unit = options.units or UNIT
    factor = scale * METERS_PER_UNIT / UNITS_M[unit]
    wall = options.wall_mm if options.wall_mm is not None else WALL_MM
    ending = path.suffix.lower()
    sized: list[tuple[float, Body]] = []
    filaments: dict[str, int] = {}
    thin: list[str] = []
    for part, solid in _solids(chosen, level, is_one=ending == ".stl"):
        thin += describe_thin(
            solid,
            part.name,
            wall_um=wall * 1e-3 / scale / METERS_PER_UNIT,
            um_per_mm=1e3 / scale,
            um_per_unit=1 / factor,
        )
        places, triangles = to_mesh(solid)
        red, green, blue = to_srgb8(np.array(part.color, np.float32)).tolist()
        positions = (places.astype(np.float64) * factor).astype(np.float32)
        filament = filaments.setdefault(part.channel, len(filaments) + 1)
        body = Body(part.name, (red, green, blue), positions, triangles, filament)
        sized.append((solid.volume(), body))
    if not sized:
        raise chosen.nothing("surface")
    # Where two bodies overlap, slicers print the later one, so the enclosing one comes first.
    bodies = [body for _, body in sorted(sized, key=lambda one: -one[0])]
    _WRITERS[ending](path, bodies, specimen_name(chosen.stage), options)
    x, y, z = np.ptp(np.concatenate([body.positions for body in bodies]), axis=0).tolist()
    count = sum(len(body.triangles) for body in bodies)
    low, high = chosen.box
    size = f"{x:.3g} x {y:.3g} x {z:.3g} {unit}, {scale:g} times the specimen of "
    size += describe_size(high - low)
    line = f"{counted(len(bodies), 'body', 'bodies')}, {count:,} triangles at lod{level}, {size}"
    if len(thin) > _MAX_REPORTED:
        thin[_MAX_REPORTED:] = [f"... and {len(thin) - _MAX_REPORTED} more parts with thin bodies"]
    return "\n".join([line, *thin])


def _handy(chosen: Chosen) -> float:
    """Return the scale at which the specimen fits a hand: 1, 2 or 5 times a power of ten."""
    low, high = chosen.box
    most = HAND_M / (float((high - low).max()) * METERS_PER_UNIT)
    power = 10.0 ** math.floor(math.log10(most))
    return max(step * power for step in (1, 2, 5) if step * power <= most)


def _solids(
    chosen: Chosen, level: int, *, is_one: bool
) -> Iterator[tuple[_Part, manifold3d.Manifold]]:
    """Yield each channel, or object of a label map, with its solid.

    is_one  whether all channels become one solid
    """
    boxes, is_capped = _boxes(chosen), has_caps(chosen.stage)
    found = []
    for part in _parts(chosen, level, is_one):
        solid = unite([_close(one, part.name, is_capped) for one in part.surfaces.values()])
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


def _close(surface: _Surface, name: str, is_capped: bool) -> manifold3d.Manifold:
    positions, triangles = weld(surface.meshes)
    if not is_capped and len(border(triangles)):
        raise StageError(
            f"{name}: found a surface that is open at the block's faces (--no-caps), expected a "
            "closed one: build with --caps, or export .glb or .usdz"
        )
    back = np.linalg.inv(np.array(surface.moved).reshape(4, 4))
    own = positions.astype(np.float64) @ back[:3, :3] + back[3, :3]
    return to_solid(positions, close_cuts(own, triangles, sorted(surface.cuts)), name)


def _parts(chosen: Chosen, level: int, is_one: bool) -> Iterator[_Part]:
    """Yield a part for each channel, or for each object of a label map unless `is_one`."""
    for channel in chosen.channels:
        parts: dict[int | None, _Part] = {}
        for piece in chosen.pieces(level, whole=True, channel=channel.id):
            for label, name, color, mesh in _meshes(piece):
                key = None if is_one else label
                if key is None:
                    name, color = channel.name, _color_of(piece)
                part = parts.setdefault(key, _Part(channel.id, name, color))
                same = label, piece.moved
                surface = part.surfaces.setdefault(same, _Surface(piece.moved))
                surface.meshes.append(mesh)
                surface.cuts.update(piece.cuts)
        yield from parts.values()


def _meshes(piece: Piece) -> Iterator[tuple[int | None, str, Color, Mesh]]:
    """Yield label, name, colour and mesh of a piece's surface, or of each object in it."""
    mesh = piece.mesh
    if piece.objects is None or mesh.objects is None:
        yield None, "", piece.material.color, (mesh.positions, mesh.triangles)
        return
    names, labels = piece.object_names, piece.objects.labels.tolist()
    for number, part in split_objects(mesh):
        color = piece.material.color
        if part.colors is not None:
            red, green, blue = part.colors.mean(axis=0).astype(float).tolist()
            color = red, green, blue
        yield labels[number], names[number], color, (part.positions, part.triangles)


def _color_of(piece: Piece) -> Color:
    """Return the colour of a body: the channel's if vertices have colours, else the material's."""
    return piece.channel.color if piece.mesh.colors is not None else piece.material.color


def _boxes(chosen: Chosen) -> list[Corners]:
    """Return the boxes that solids are cut to, world um; empty: solids are not cut."""
    options = chosen.options
    if not options.tiles and options.region is None:
        return []
    all_boxes = chosen.tile_boxes()
    lows, highs = (np.array([box[end] for box in all_boxes.values()]) for end in (0, 1))
    low, high = lows.min(axis=0), highs.max(axis=0)
    far = float((high - low).max())  # caps lie one voxel outside the outermost tiles
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
        raise chosen.nothing("tile")
    return boxes
