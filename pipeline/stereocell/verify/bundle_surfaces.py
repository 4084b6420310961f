"""Compare a tile's surfaces in a bundle with those of the stage.

Every vertex of a decoded .glb must lie within half a lattice cell's diagonal of a vertex of the
composed mesh, and vice versa. The same holds for the centres of triangles
(verify/paired_surfaces.py). Triangles must face the same way and have the same place in the maps.
Colours must agree within 1/255, and maps with a new encoding of the stage's images. The tilesets'
boxes and errors must agree with surfaces and stage.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.bundle.edited_meshes import with_vertex_occlusion
from stereocell.formats.basis_textures import (
    decode_map,
    encode_color_map,
    encode_normal_map,
    encode_occlusion_map,
)
from stereocell.formats.gltf import AMBIENT_SHARE
from stereocell.formats.gltf_decode import DecodedMesh, read_glb
from stereocell.formats.tiles3d_walk import Content, walk
from stereocell.model.mesh import Mesh
from stereocell.usd.read_levels import ComposedLod
from stereocell.usd.read_textures import read_image
from stereocell.verify.bundle_files import COLOR_STEP
from stereocell.verify.paired_surfaces import Pairs, Surface, pair_surfaces

_UM_PER_METRE = 1e6
_MAP_DIFFERENCE = 1.0  # 0..255, largest mean difference of texels, since encoders may differ
# Share of a surface's area that may differ between stage and bundle, since rounded positions turn
# very thin triangles
_ODD_SHARE = 0.01
_TURNED = math.radians(3)  # rad, largest difference of normals: two steps of 8-bit octahedral ones
_UV_STEP = 1e-4  # largest difference of a UV coordinate, 0..1; six steps of 16 bits
# Factor by which a stated error may exceed the measured one, since it is rounded up to four digits
_ROUNDED = 1.001
# Metres by which a stated box may exceed its surfaces, since it is rounded outwards to whole nm
_BOX_M = 2e-9
_ENCODERS: dict[str, tuple[str, Callable[[NDArray[np.uint8]], bytes]]] = {
    "normalTexture": ("normal", encode_normal_map),
    "occlusionTexture": ("occlusion", encode_occlusion_map),
    "baseColorTexture": ("color", encode_color_map),
}


def surfaces_of(
    bundle: Path, channel: dict[str, Any], tile_id: str
) -> Iterator[tuple[int, Content]]:
    """Yield a tile's surfaces in a channel's tileset, each with its level of detail."""
    if channel["tileset"] is None:
        return
    for content in walk(bundle, bundle / channel["tileset"]["path"], tile_id):
        if not content.is_tileset:
            yield int(content.path.stem.removeprefix("lod")), content


def compare_surfaces(
    contents: dict[int, Content], lods: dict[int, ComposedLod]
) -> tuple[float, list[str]]:
    """Return the largest distance of a vertex from its stage position, and the problems.

    A bundle has no file of a level that would have the same bytes as the next finer one. The finer
    file then stands for that level, too. Its positions are rounded to the lattice, so the levels
    may differ a little in the stage.

    The distance is in lattice steps.
    """
    problems = [f"the stage lacks lod{level}" for level in contents if level not in lods]
    worst, error_m, corners = 0.0, 0.0, []
    drawn: DecodedMesh | None = None  # the last level that has a file
    is_last = False
    for level, lod in sorted(lods.items()):
        content = contents.get(level)
        if content is None:
            apart, faults = (0.0, [""]) if drawn is None else _compare_surface(drawn, lod, is_last)
            if faults:
                problems.append(f"the bundle lacks lod{level}")
            else:
                worst = max(worst, apart)
            continue
        is_last = level == max(contents) and len(contents) > 1
        drawn = read_glb(content.path)
        apart, faults = _compare_surface(drawn, lod, is_last)
        worst = max(worst, apart)
        problems += [f"lod{level}: {fault}" for fault in faults]
        # Errors must not decrease from fine to coarse levels. The finest level is the reference and
        # states no error.
        if level > min(contents):
            error_m = max(error_m, lod.largest_um / _UM_PER_METRE)
        if not error_m * (1 - 1e-6) <= content.error_m <= error_m * _ROUNDED:
            problems.append(
                f"lod{level}: the tileset states {content.error_m * _UM_PER_METRE:.4g} um, "
                f"expected {error_m * _UM_PER_METRE:.4g}"
            )
        corners.append((drawn.positions_m.min(axis=0), drawn.positions_m.max(axis=0)))
    problems += _compare_boxes(contents, corners)
    return worst, problems


def _compare_boxes(
    contents: dict[int, Content], corners: Sequence[tuple[NDArray[Any], NDArray[Any]]]
) -> Iterator[str]:
    """Yield a problem for each box of a tileset that doesn't fit its surfaces.

    corners  the lowest and highest corner (x, y, z) of each surface, m
    """
    if not corners:
        return
    low = np.min([low for low, _ in corners], axis=0).astype(np.float64)
    high = np.max([high for _, high in corners], axis=0).astype(np.float64)
    # In meshes y points up, and in the boxes of tilesets z points up.
    low, high = np.array([low[0], -high[2], low[1]]), np.array([high[0], -low[2], high[1]])
    slack = _BOX_M + 4e-7 * max(float(np.abs(low).max()), float(np.abs(high).max()))
    for level, content in contents.items():
        for k, box in enumerate(content.boxes):
            centre, half = np.array(box[:3]), np.array(box[3:]).reshape(3, 3)
            reach = np.abs(half).sum(axis=0)
            lacks = max((centre - reach - low).max(), (high - centre - reach).max())
            exceeds = max((low - centre + reach).max(), (centre + reach - high).max())
            if lacks > slack or (k == 0 and exceeds > slack):
                yield f"lod{level}: a box of the tileset does not fit the surfaces: {list(box)}"
                break


def _compare_surface(
    drawn: DecodedMesh, lod: ComposedLod, is_last: bool
) -> tuple[float, list[str]]:
    """Return the largest distance of a vertex from its stage position, and the problems.

    is_last  whether this is the coarsest of several levels; without maps, it has its occlusion at
             the vertices

    The distance is in lattice steps.
    """
    problems = []
    if is_last and "occlusionTexture" not in drawn.maps:
        lod = replace(lod, mesh=with_vertex_occlusion(lod))
    triangles = lod.mesh.triangles
    if len(drawn.triangles) != len(triangles):
        found = f"found {len(drawn.triangles)} triangles"
        return 0.0, [f"{found}, expected {len(triangles)} as in the stage"]
    places = lod.mesh.positions.astype(np.float64) / _UM_PER_METRE
    decoded = drawn.positions_m.astype(np.float64)
    # Half the diagonal of a lattice cell, plus the rounding of a viewer's float32 metres.
    limit_m = math.sqrt(3) / 2 * drawn.step_m + 4e-7 * float(np.abs(places).max())
    if (drawn.objects is None) != (lod.mesh.objects is None):
        which = ("bundle", "stage") if drawn.objects is None else ("stage", "bundle")
        return 0.0, [
            f"the vertices in the {which[0]} have no objects, but those in the {which[1]} have"
        ]
    if drawn.objects is not None and lod.mesh.objects is not None:
        # Objects touch each other. They are moved apart along x, so that each is compared with
        # itself.
        length = 2 * float(np.ptp(places, axis=0).max())
        places[:, 0] += lod.mesh.objects * length
        decoded[:, 0] += drawn.objects * length
    composed = Surface(places, triangles, lod.mesh.objects)
    pairs = pair_surfaces(composed, Surface(decoded, drawn.triangles), limit_m)
    if pairs.apart > limit_m:
        problems.append(
            f"a vertex is {pairs.apart * _UM_PER_METRE:.4g} um from its place in the stage, "
            f"expected at most {limit_m * _UM_PER_METRE:.4g}"
        )
    else:
        problems += _compare_faces(places, decoded, pairs, drawn, lod.mesh)
    away = max(abs(a - b) for a, b in zip(drawn.color, lod.material.color, strict=True))
    if away > COLOR_STEP:
        problems.append(
            f"its colour is {drawn.color}, expected {lod.material.color} as in the stage"
        )
    if abs(drawn.opacity - lod.material.opacity) > COLOR_STEP:
        problems.append(
            f"its opacity is {drawn.opacity:g}, expected {lod.material.opacity:g} as in the stage"
        )
    glow = max(abs(a - b) for a, b in zip(drawn.emission, lod.material.emission, strict=True))
    if glow > COLOR_STEP:
        problems.append(
            f"its emission is {drawn.emission}, expected {lod.material.emission} as in the stage"
        )
    problems += _compare_vertex_colors(drawn, lod.mesh, pairs)
    problems += _compare_maps(drawn, lod, is_last)
    if (drawn.paint is None) != (lod.mesh.paint is None):
        which = ("bundle", "stage") if drawn.paint is None else ("stage", "bundle")
        problems.append(f"only the {which[1]}, not the {which[0]}, has colours painted on objects")
    elif drawn.paint is not None and lod.mesh.paint is not None:
        painted = np.clip(lod.mesh.paint[pairs.vertices], 0, 1)
        off = np.abs(drawn.paint[pairs.twins] - painted)
        if np.mean(off > COLOR_STEP) > _ODD_SHARE:
            problems.append(
                f"{np.mean(off > COLOR_STEP):.0%} of its vertices have another painted colour"
            )
    return pairs.apart / drawn.step_m, problems


def _compare_faces(
    places: NDArray[np.float64],
    decoded: NDArray[np.float64],
    pairs: Pairs,
    drawn: DecodedMesh,
    mesh: Mesh,
) -> Iterator[str]:
    """Yield problems with the facing of triangles, and with their texture coordinates.

    places, decoded  vertices (n, 3) of the stage and of the bundle, m
    """
    triangles, here_of = pairs.triangles, pairs.twin_triangles
    normals, turned = _normals(places, triangles), _normals(decoded, here_of)
    # numpy takes several times as long along an axis of length 3 by `sum` and `norm`.
    areas = np.sqrt(np.einsum("mk,mk->m", normals, normals))
    whole = float(areas.sum())
    odd = float(areas[np.einsum("mk,mk->m", normals, turned) < 0].sum())
    if odd > _ODD_SHARE * whole:
        yield f"{odd / whole:.0%} of its area faces the other way"
    off = _means(mesh.normals, triangles) - _means(drawn.normals, here_of)
    odd = float(areas[np.einsum("mk,mk->m", off, off) > _TURNED**2].sum())
    if odd > _ODD_SHARE * whole:
        yield f"{odd / whole:.0%} of its area has other normals"
    dimmed = _dimmed(mesh)
    if (dimmed is None) != (drawn.colors is None):
        yield (
            "its vertices have colours, but those in the stage have none"
            if dimmed is None
            else "the occlusion at its vertices is missing"
        )
    elif dimmed is not None and drawn.colors is not None:
        off = np.abs(dimmed[triangles].mean(axis=1) - drawn.colors[here_of].mean(axis=1))
        odd = float(areas[off.max(axis=1) > COLOR_STEP].sum())
        if odd > _ODD_SHARE * whole:
            yield f"{odd / whole:.0%} of its area has other colours or occlusion at its vertices"
    if drawn.uvs is None or mesh.uvs is None:
        return  # missing UVs are reported with the map
    wanted = mesh.uvs.astype(np.float64)[triangles].mean(axis=1)
    found = drawn.uvs[here_of].mean(axis=1)
    off = np.abs(found - np.stack([wanted[:, 0], 1 - wanted[:, 1]], axis=1)).max(axis=1)
    odd = float(areas[off > _UV_STEP].sum())
    if odd > _ODD_SHARE * whole:
        yield f"{odd / whole:.0%} of its area has other texture coordinates"


def _normals(at: NDArray[np.float64], triangles: NDArray[Any]) -> NDArray[np.float64]:
    """Return the normal (m, 3) of each triangle, as long as twice its area."""
    a, b, c = (at[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def _means(normals: NDArray[Any], triangles: NDArray[Any]) -> NDArray[np.float64]:
    """Return the mean (m, 3) of each triangle's three unit normals.

    The mean is not normalised: at a sharp edge, where the normals cancel each other, it is short,
    and its direction depends on rounding.
    """
    units = normals.astype(np.float64)
    units /= np.maximum(np.sqrt(np.einsum("nk,nk->n", units, units)), 1e-12)[:, np.newaxis]
    a, b, c = (units[triangles[:, k]] for k in range(3))
    return np.asarray((a + b + c) / 3)


def _dimmed(mesh: Mesh) -> NDArray[np.float64] | None:
    """Return the factor (n, 3), 0..1, of each vertex's colour, or None if there is none.

    The factor includes occlusion; see formats/gltf.py.
    """
    if mesh.colors is None and mesh.openness is None:
        return None
    colors = np.ones((len(mesh.positions), 3))
    if mesh.colors is not None:
        colors = np.clip(mesh.colors.astype(np.float64), 0, 1)
    if mesh.openness is None:
        return colors
    openness = np.clip(mesh.openness.astype(np.float64), 0, 1)[:, np.newaxis]
    return np.asarray(colors * (1 - AMBIENT_SHARE * (1 - openness)))


def _compare_vertex_colors(drawn: DecodedMesh, mesh: Mesh, pairs: Pairs) -> Iterator[str]:
    if mesh.colors is None:
        return
    if drawn.colors is None:
        yield "the mesh's own colours are missing"
        return
    dimmed = drawn.colors[pairs.twins]  # occlusion may have dimmed the colours
    if float((dimmed - np.clip(mesh.colors[pairs.vertices], 0, 1)).max()) > 2 * COLOR_STEP:
        yield "the mesh's own colours differ from the stage"


def _compare_maps(drawn: DecodedMesh, lod: ComposedLod, is_last: bool) -> Iterator[str]:
    for name, (kind, encode) in _ENCODERS.items():
        path: Path | NDArray[np.uint8] | None = getattr(lod.images or lod.maps, kind)
        named = path.name if isinstance(path, Path) else f"lod{lod.level}_{kind}"
        if path is None or (is_last and kind != "color" and name not in drawn.maps):
            if path is None and name in drawn.maps:
                yield f"found a map ({kind}), but the stage has none"
            continue  # the coarsest level may have its values at vertices instead
        if name not in drawn.maps:
            yield f"the map {named} is missing"
            continue
        again = encode(read_image(path))
        if again == drawn.maps[name]:
            continue
        found, wanted = (decode_map(map_).astype(np.float64) for map_ in (drawn.maps[name], again))
        if found.shape != wanted.shape or np.abs(found - wanted).mean() > _MAP_DIFFERENCE:
            yield f"the map {named} differs from the image in the stage"
