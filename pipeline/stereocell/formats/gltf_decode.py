"""Decode a .glb of the bundle, by the tables of glTF 2.0 and of EXT_meshopt_compression."""

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import meshopt
import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import CheckError

_TYPES = {
    5120: np.int8,
    5121: np.uint8,
    5123: np.uint16,
    5125: np.uint32,
    5126: np.float32,
}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
# Largest size of a decoded bufferView in bytes, checked before its memory is allocated
_MAX_BYTES = 1 << 30
_HEAD = struct.Struct("<4sII")
_CHUNK = struct.Struct("<I4s")


@dataclass(frozen=True, slots=True)
class DecodedMesh:
    """The mesh and material of a file as a viewer draws them.

    positions_m  float32 (n, 3), world space, metres (x, y, z)
    triangles    int64 (m, 3)
    normals      float64 (n, 3), unit vectors
    colors       float64 (n, 3), of the vertices, 0..1, or None
    color        linear RGB of the material, 0..1
    maps         KTX2 files by their names in the material
    uvs          float64 (n, 2), v downwards, or None
    step_m       distance between two possible positions of a vertex, metres
    objects      int64 (n,), object of each vertex by its number in the tile, or None
    paint        float64 (n,), painted intensity of a channel, 0..1, or None
    opacity      opacity of the material, 0..1
    emission     linear RGB of the light that the material emits, 0..1
    """

    positions_m: NDArray[np.float32]
    triangles: NDArray[np.int64]
    normals: NDArray[np.float64]
    colors: NDArray[np.float64] | None
    color: tuple[float, float, float]
    maps: dict[str, bytes]
    uvs: NDArray[np.float64] | None
    step_m: float
    objects: NDArray[np.int64] | None = None
    paint: NDArray[np.float64] | None = None
    opacity: float = 1.0
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)


def read_glb(path: Path) -> DecodedMesh:
    """Return the only mesh of a file. Raises CheckError for a file of another kind."""
    try:
        return _drawn(*_open(path.read_bytes()))
    except OSError as error:
        raise CheckError(f"{path}: {error.strerror or error}") from error
    except (ValueError, LookupError, TypeError, struct.error, RuntimeError) as error:
        raise CheckError(f"{path}: can't be decoded: {error!r}") from error


def _open(data: bytes) -> tuple[dict[str, Any], bytes]:
    magic, version, length = _HEAD.unpack_from(data)
    if (magic, version, length) != (b"glTF", 2, len(data)):
        raise ValueError("not a glTF 2.0 file of the stated length")
    text_length, _ = _CHUNK.unpack_from(data, _HEAD.size)
    start = _HEAD.size + _CHUNK.size
    document = json.loads(data[start : start + text_length])
    return document, data[start + text_length + _CHUNK.size :]


def _drawn(document: dict[str, Any], binary: bytes) -> DecodedMesh:
    (node,) = document["nodes"]
    (mesh,) = document["meshes"]
    (primitive,) = mesh["primitives"]
    attributes = primitive["attributes"]
    offsets = _decode(document, binary, attributes["POSITION"]).astype(np.float32)
    directions = _decode(document, binary, attributes["NORMAL"])
    scale, translation = (np.array(node[key], np.float32) for key in ("scale", "translation"))
    colors = None
    if "COLOR_0" in attributes:
        colors = _decode(document, binary, attributes["COLOR_0"])[:, :3] / 255.0
    uvs = None
    if "TEXCOORD_0" in attributes:
        stored = _decode(document, binary, attributes["TEXCOORD_0"])
        uvs = stored / (0xFFFF if stored.dtype == np.uint16 else 1.0)
    objects = None
    if "_FEATURE_ID_0" in attributes:
        objects = _decode(document, binary, attributes["_FEATURE_ID_0"])[:, 0].astype(np.int64)
    paint = None
    if "_PAINT" in attributes:
        paint = _decode(document, binary, attributes["_PAINT"])[:, 0] / 255.0
    material = document["materials"][primitive["material"]]
    shading = material["pbrMetallicRoughness"]
    red, green, blue, opacity = shading["baseColorFactor"]
    emission = material.get("emissiveFactor", (0.0, 0.0, 0.0))
    return DecodedMesh(
        offsets * scale + translation,
        _decode(document, binary, primitive["indices"]).reshape(-1, 3).astype(np.int64),
        directions / float(np.iinfo(directions.dtype).max),
        colors,
        (red, green, blue),
        {
            name: _image(document, binary, holder[name]["index"])
            for holder in (material, shading)
            for name in holder
            if name.endswith("Texture")
        },
        uvs,
        float(scale[0]),
        objects,
        paint,
        opacity if material.get("alphaMode") == "BLEND" else 1.0,
        (emission[0], emission[1], emission[2]),
    )


def _decode(document: dict[str, Any], binary: bytes, index: int) -> NDArray[Any]:
    """Return the rows of an accessor (n, components)."""
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]["extensions"]["EXT_meshopt_compression"]
    start = view.get("byteOffset", 0)
    stored = binary[start : start + view["byteLength"]]
    count, stride = view["count"], view["byteStride"]
    if count * stride > _MAX_BYTES:
        raise ValueError(f"a bufferView of {count} x {stride} bytes, expected at most {_MAX_BYTES}")
    decoded: NDArray[Any] = meshopt.decode_gltf_buffer(
        stored, count, stride, view["mode"], view.get("filter")
    )
    if view["mode"] == "TRIANGLES":
        return decoded
    return decoded.view(_TYPES[accessor["componentType"]])[:, : _WIDTHS[accessor["type"]]]


def _image(document: dict[str, Any], binary: bytes, texture: int) -> bytes:
    source = document["textures"][texture]["extensions"]["KHR_texture_basisu"]["source"]
    view = document["bufferViews"][document["images"][source]["bufferView"]]
    start = view.get("byteOffset", 0)
    return binary[start : start + view["byteLength"]]
