"""Hold a bundle against the stage that it was exported from: what each file decodes to.

Surfaces: every vertex of a decoded .glb lies within the lattice's half diagonal of a vertex of the
composed mesh, and the other way round, triangle by triangle too; colours within 1/255; maps as the
stage's images would be encoded now. Volumes: every voxel of every mip level. And what the manifest
says of each channel and tile.
"""

import io
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import alktx2
import numpy as np
import zstandard
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial import cKDTree

from stereocell.bricks import mip_levels
from stereocell.documents import read_json
from stereocell.errors import CheckError
from stereocell.mesh import Mesh
from stereocell.specimen import evaluate
from stereocell.tilesets import walk
from stereocell.write.bundle import MANIFEST
from stereocell.write.bundle_tile import read_image
from stereocell.write.composed import (
    ComposedLod,
    ComposedVolume,
    loaded,
    modality_of,
    open_stage,
    read_lods,
    read_volume,
    specimen_name,
    tile_prims,
)
from stereocell.write.composed_look import ComposedLook, read_looks
from stereocell.write.exr import read_atlas
from stereocell.write.gltf_read import Drawn, read_glb
from stereocell.write.ktx2 import encode_color_map, encode_normal_map, encode_occlusion_map

_COLOR = 1 / 255 + 1e-6
_UM_PER_METRE = 1e6
_MAP_DIFFERENCE = 1.0  # of 255, in the mean: the same image by another version of the encoder
_ENCODERS: dict[str, tuple[str, Callable[[NDArray[np.uint8]], bytes]]] = {
    "normalTexture": ("normal", encode_normal_map),
    "occlusionTexture": ("occlusion", encode_occlusion_map),
    "baseColorTexture": ("color", encode_color_map),
}
_REMEDY = "run `stereocell bundle OUT`"


@dataclass(frozen=True, slots=True)
class BundleTask:
    """One tile of a bundle, and the stage that it was exported from."""

    stage_file: Path
    bundle: Path
    tile_id: str


@dataclass(frozen=True, slots=True)
class TileFinding:
    """What was seen of one tile. `worst`: a vertex's way from its place, in lattice steps."""

    name: str
    surfaces: int
    volumes: int
    worst: float
    problems: tuple[str, ...]


def hold_manifest(stage_file: Path, bundle: Path) -> list[str]:
    """Return what the manifest says otherwise than the composed stage. Raises StereoCellError."""
    stage = open_stage(stage_file)
    manifest = read_json(bundle / MANIFEST, "bundle.schema.json", _REMEDY)
    specimen = {"name": specimen_name(stage), "modality": modality_of(stage)}
    problems = list(_unlike("specimen", manifest["specimen"], specimen))
    tiles = [str(prim.GetName()) for prim in tile_prims(stage)]
    listed = [tile["id"] for tile in manifest["tiles"]]
    if tiles != listed:
        problems.append(f"tiles are {', '.join(listed)}, the stage's {', '.join(tiles)}")
    looks = read_looks(stage)
    if [look.id for look in looks] != [channel["id"] for channel in manifest["channels"]]:
        return [*problems, "the channels are not the stage's"]
    for look, channel in zip(looks, manifest["channels"], strict=True):
        problems += _hold_channel(look, channel, bundle)
    return problems


def _hold_channel(look: ComposedLook, channel: dict[str, Any], bundle: Path) -> Iterator[str]:
    away = max(abs(a - b) for a, b in zip(look.color, channel["color"], strict=True))
    if away > _COLOR:
        yield f"{look.id}: color is {channel['color']}, the stage's {list(look.color)}"
    expected = {
        "name": look.name,
        "window": list(look.window),
        "iso_value": look.iso_value,
        "iso_normalized": look.iso_normalized,
        "threshold_normalized": look.threshold_normalized,
        "surface": "none" if channel["tileset"] is None else look.surface,
        "transfer_function": look.chosen,
        "transfer_functions": list(look.transfer_functions),
    }
    yield from _unlike(look.id, channel, expected)
    yield from _unlike(look.id, channel["transfer_functions_2d"], {"names": list(look.shapes)})
    (rows,) = _texels(bundle / channel["lut"]["path"])
    for row, (name, points) in zip(rows[0], look.transfer_functions.items(), strict=True):
        if np.abs(row[:, 3] / 255 - evaluate(points)).max() > _COLOR:
            yield f"{look.id}: the lookup table of {name!r} is not the stage's"


def _unlike(name: str, found: dict[str, Any], expected: dict[str, Any]) -> Iterator[str]:
    for key, value in expected.items():
        if found[key] != value:
            yield f"{name}: {key} is {found[key]!r}, the stage's {value!r}"


def hold_tile(task: BundleTask) -> TileFinding:
    """Return how one tile's files agree with the composed stage. Raises StereoCellError."""
    manifest = read_json(task.bundle / MANIFEST, "bundle.schema.json", _REMEDY)
    problems: list[str] = []
    surfaces = volumes = 0
    worst = 0.0
    stage = open_stage(task.stage_file)
    looks = read_looks(stage)
    listed = next((one for one in manifest["tiles"] if one["id"] == task.tile_id), None)
    with loaded(stage, task.tile_id) as (tile, choice):
        if listed is not None:  # else it is told of the manifest
            problems += _unlike(task.tile_id, listed, {"representation": choice.representation})
        for look, channel in zip(looks, manifest["channels"], strict=True):
            name = f"{task.tile_id}/{look.id}"
            lods = list(read_lods(tile, look.id, choice.finest_lod))
            contents = dict(_contents(task.bundle, channel, task.tile_id))
            for level, (file, error_um) in contents.items():
                surfaces += 1
                lod = next((lod for lod in lods if lod.level == level), None)
                if lod is None:
                    problems.append(f"{name}: lod{level} is not in the stage")
                    continue
                is_last = level == max(contents) and len(contents) > 1
                apart, faults = _hold_surface(file, lod, error_um, is_last)
                worst = max(worst, apart)
                problems += [f"{name}: lod{level}: {fault}" for fault in faults]
            lacking = sorted({lod.level for lod in lods} - contents.keys())
            problems += [f"{name}: the bundle lacks lod{level}" for level in lacking]
            composed = read_volume(tile, look.id)
            entry = _volume_entry(task.bundle, channel, task.tile_id)
            if (composed is None) != (entry is None):
                which = ("stage", "bundle") if composed is None else ("bundle", "stage")
                problems.append(f"{name}: the {which[0]} has no volume, the {which[1]} has one")
            elif composed is not None and entry is not None:
                volumes += 1
                problems += _unlike(name, entry, _placed(composed))
                voxels = look.window_voxels(read_atlas(composed.atlas))
                file = task.bundle / entry["file"]["path"]
                problems += [f"{name}: {fault}" for fault in _hold_volume(file, voxels)]
    return TileFinding(task.tile_id, surfaces, volumes, worst, tuple(problems))


def _placed(volume: ComposedVolume) -> dict[str, Any]:
    """Return where a volume is, as the bundle says it."""
    return {
        "size": list(volume.size),
        "apron": volume.apron,
        "bounds_um": {"min": list(volume.low), "max": list(volume.high)},
        "matrix": [float(number) for number in volume.matrix.ravel()],
    }


def _contents(
    bundle: Path, channel: dict[str, Any], tile_id: str
) -> Iterator[tuple[int, tuple[Path, float]]]:
    """Yield level, file and stated distance (um) of a tile's surfaces in a channel's tileset."""
    if channel["tileset"] is None:
        return
    for content in walk(bundle, bundle / channel["tileset"]["path"], tile_id):
        if not content.is_tileset:
            level = int(content.path.stem.removeprefix("lod"))
            yield level, (content.path, content.error_m * _UM_PER_METRE)


def _hold_surface(
    file: Path, lod: ComposedLod, error_um: float, is_last: bool
) -> tuple[float, list[str]]:
    """Return how far a vertex is from its place, in lattice steps, and what is wrong."""
    drawn = read_glb(file)
    problems = []
    triangles = lod.mesh.triangles
    if len(drawn.triangles) != len(triangles):
        return 0.0, [f"{len(drawn.triangles)} triangles, the stage has {len(triangles)}"]
    places = lod.mesh.positions.astype(np.float64) / _UM_PER_METRE
    decoded = drawn.positions_m.astype(np.float64)
    # float32 metres of a viewer, beside half the diagonal of a lattice cell
    limit_m = math.sqrt(3) / 2 * drawn.step_m + 4e-7 * float(np.abs(places).max())
    apart = max(
        _farthest(places, decoded),
        _farthest(places[triangles].mean(axis=1), decoded[drawn.triangles].mean(axis=1)),
    )
    if apart > limit_m:
        problems.append(
            f"a vertex is {apart * _UM_PER_METRE:.4g} um from its place, the lattice allows "
            f"{limit_m * _UM_PER_METRE:.4g}"
        )
    if lod.level and error_um < lod.distance_um * (1 - 1e-6):
        problems.append(f"the tileset states {error_um:.4g} um, the stage {lod.distance_um:.4g}")
    away = max(abs(a - b) for a, b in zip(drawn.color, lod.material.color, strict=True))
    if away > _COLOR:
        problems.append(f"drawn in {drawn.color}, the stage's colour is {lod.material.color}")
    problems += _hold_vertex_colors(drawn, lod.mesh, places, decoded)
    problems += _hold_maps(drawn, lod, is_last)
    return apart / drawn.step_m, problems


def _farthest(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Return the largest distance from a point of either set to the nearest of the other."""
    there, back = (np.asarray(cKDTree(c).query(d)[0]) for c, d in ((a, b), (b, a)))
    return float(max(there.max(), back.max()))


def _hold_vertex_colors(
    drawn: Drawn, mesh: Mesh, places: NDArray[np.float64], decoded: NDArray[np.float64]
) -> Iterator[str]:
    if mesh.colors is None:
        return
    if drawn.colors is None:
        yield "the mesh's own colours are lost"
        return
    _, nearest = cKDTree(decoded).query(places)
    dimmed = np.asarray(drawn.colors[np.asarray(nearest)])  # by occlusion, or not at all
    if float((dimmed - np.clip(mesh.colors, 0, 1)).max()) > 2 * _COLOR:
        yield "the mesh's own colours are others"


def _hold_maps(drawn: Drawn, lod: ComposedLod, is_last: bool) -> Iterator[str]:
    for name, (kind, encode) in _ENCODERS.items():
        path: Path | None = getattr(lod.maps, kind)
        if path is None or (is_last and kind != "color" and name not in drawn.maps):
            if path is None and name in drawn.maps:
                yield f"a map ({kind}) that the stage has not"
            continue  # the coarsest level goes without
        if name not in drawn.maps:
            yield f"the map {path.name} is missing"
            continue
        anew = encode(read_image(path))
        if anew == drawn.maps[name]:
            continue
        found, wanted = _pixels(drawn.maps[name]), _pixels(anew)
        if found.shape != wanted.shape or np.abs(found - wanted).mean() > _MAP_DIFFERENCE:
            yield f"the map {path.name} is another image in the stage"


def _pixels(ktx2: bytes) -> NDArray[np.float64]:
    png, _ = alktx2.decode_ktx2_to_bytes(ktx2)
    with Image.open(io.BytesIO(png)) as image:
        return np.asarray(image.convert("RGB"), dtype=np.float64)


def _volume_entry(bundle: Path, channel: dict[str, Any], tile_id: str) -> dict[str, Any] | None:
    content = read_json(bundle / channel["volumes"]["path"], "volumes.schema.json", _REMEDY)
    return next((one for one in content["volumes"] if one["tile"] == tile_id), None)


def _hold_volume(file: Path, voxels: NDArray[np.uint8]) -> Iterator[str]:
    found, expected = _texels(file), mip_levels(voxels)
    if [level.shape[:3] for level in found] != [level.shape for level in expected]:
        yield f"{file.name}: its levels have other sizes than the stage's volume gives"
        return
    for k, (level, wanted) in enumerate(zip(found, expected, strict=True)):
        wrong = int((level[..., 0] != wanted).sum())
        if wrong:
            yield f"{file.name}: level {k}: {wrong} of {wanted.size} voxels are not the stage's"


def _texels(file: Path) -> list[NDArray[np.uint8]]:
    """Return the levels of a KTX2 file of ours, finest first, each (z, y, x, components)."""
    try:
        data = file.read_bytes()
        width, height, depth, _, _, count = np.frombuffer(data, "<u4", 6, 20).tolist()
        components = {9: 1, 16: 2, 37: 4}[int(np.frombuffer(data, "<u4", 1, 12)[0])]
        levels = []
        for k in range(count):
            offset, length, size = np.frombuffer(data, "<u8", 3, 80 + 24 * k).tolist()
            frame = data[offset : offset + length]
            texels = zstandard.ZstdDecompressor().decompress(frame, max_output_size=size)
            shape = [max(1, n >> k) for n in (max(1, depth), height, width)]
            levels.append(np.frombuffer(texels, np.uint8).reshape(*shape, components))
    except OSError as error:
        raise CheckError(f"{file}: {error.strerror or error}") from error
    except (ValueError, LookupError, zstandard.ZstdError) as error:
        raise CheckError(f"{file}: can't be decoded: {error!r}") from error
    return levels
