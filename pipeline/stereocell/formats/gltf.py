"""Write one mesh as a binary glTF 2.0 file that a phone decodes fast.

This module assembles the file, because no package on PyPI writes EXT_meshopt_compression. It also
uses KHR_mesh_quantization and, for baked maps, KHR_texture_basisu.

There are no cracks between tiles. Neighbouring tiles have the vertices on their common plane as
equal floats, and the decoded positions must be equal too. So all files of a bundle share ONE
lattice: a vertex becomes round(position / step), with the same `step` everywhere, a power of two in
METRES. A file stores 16-bit offsets from its own origin, which is a lattice point as well. Its node
has scale = step and translation = origin * step. Every factor is then a dyadic number. A viewer's
float32 `scale * q + translation` is exact while a coordinate is below 2^24 steps. For tiles of
72 um that is a step of 7.5 nm, and specimens may reach 125 mm from the world's origin. All levels
of detail share the lattice, so a tile fits its neighbour at any pair of levels.

The coarsest level of a small tile is a few kB, of which JSON could be half. So names and extras are
written once, on the node, and default values are not written.
"""

import json
import math
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.gltf_features import (
    Features,
    add_feature_ids,
    describe_features,
    require_whole,
)
from stereocell.formats.meshopt import CompressedBuffers, reorder
from stereocell.model.mesh import Mesh
from stereocell.model.version import GENERATOR

_METRES_PER_UM = 1e-6
_MAX_STEPS = 0xFFFF  # largest number of steps along an axis: 16 bits
# Wanted number of lattice steps along a tile's longest edge, about 20 for each voxel; more low bits
# would not compress
_WANTED_STEPS = 1 << 14
_UNSIGNED_BYTE, _UNSIGNED_SHORT, _FLOAT = 5121, 5123, 5126
AMBIENT_SHARE = 0.4  # approximate share of ambient light in the viewer's scene, 0..1
_OF_COLOR = {"baseColorTexture"}  # maps that belong to the pbrMetallicRoughness of the material
_LINEAR, _LINEAR_MIPMAP_LINEAR, _CLAMP = 9729, 9987, 33071


@dataclass(frozen=True, slots=True)
class Material:
    """The appearance of a surface: linear RGB, metallic, roughness, opacity and emitted light.

    All values are 0..1.
    """

    color: tuple[float, float, float]
    metallic: float = 0.0
    roughness: float = 0.5
    opacity: float = 1.0
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def to_gltf(self, name: str) -> dict[str, Any]:
        """Return the material as a glTF object without default values."""
        described: dict[str, Any] = {
            "name": name,
            "doubleSided": True,
            "pbrMetallicRoughness": {
                "baseColorFactor": [*self.color, self.opacity],
                "metallicFactor": self.metallic,
                "roughnessFactor": self.roughness,
            },
        }
        if self.opacity < 1:
            described["alphaMode"] = "BLEND"
        if any(self.emission):
            described["emissiveFactor"] = list(self.emission)
        return described


@dataclass(frozen=True, slots=True)
class Textures:
    """Baked maps as KTX2 files of Basis Universal: normals and occlusion linear, colours sRGB."""

    normal: bytes | None = None
    occlusion: bytes | None = None
    color: bytes | None = None


@dataclass(frozen=True, slots=True)
class Glb:
    """A complete .glb file, and the box of its decoded vertices (x, y, z) in metres, y up."""

    data: bytes
    min_m: tuple[float, float, float]
    max_m: tuple[float, float, float]


def choose_step(extent_um: float) -> float:
    """Return the lattice step in metres for meshes whose longest edge is `extent_um` or less.

    The step is the smallest power of two for which 14 bits span the extent: 8192 to 16384 steps.
    """
    if extent_um <= 0:
        return 2.0**-30
    return float(2.0 ** math.ceil(math.log2(extent_um * _METRES_PER_UM / _WANTED_STEPS)))


def encode_glb(
    mesh: Mesh,
    step_m: float,
    *,
    material: Material,
    name: str,
    extras: dict[str, str],
    textures: Textures | None = None,
    features: Features | None = None,
) -> Glb:
    """Return a mesh as the content of a .glb file.

    mesh      positions float32 (n, 3) in um (x, y, z), triangles uint32 (m, 3), normals
    step_m    step of the lattice in metres, see `choose_step`
    extras    texts for the `extras` of the file's only node
    textures  UVs are written only if there is a map, and tangents only if it is a normal map
    features  table of the tile's objects, in the order of their numbers; None: no table is written

    Raises ValueError for a mesh without triangles, for one larger than 65535 steps along an axis,
    and for maps without UVs. It does so too for objects that share a triangle, and for more than
    65536 of them.

    >>> import trimesh
    >>> ball = trimesh.creation.icosphere(subdivisions=3, radius=10)
    >>> corners, normals = np.float32(ball.vertices), np.float32(ball.vertex_normals)
    >>> mesh = Mesh(corners, np.uint32(ball.faces), normals)
    >>> color = Material((1.0, 0.5, 0.0))
    >>> glb = encode_glb(mesh, choose_step(20), material=color, name="ball", extras={})
    >>> glb.data[:4], [round(1e6 * length) for length in (*glb.min_m, *glb.max_m)]  # um
    (b'glTF', [-10, -10, -10, 10, 10, 10])
    """
    maps = _pick(textures or Textures())
    if len(mesh.triangles) == 0:
        raise ValueError(f"{name} has no triangles")
    if mesh.objects is not None:
        require_whole(mesh.objects, mesh.triangles, name, features)
    indices, order = reorder(mesh.triangles, objects=mesh.objects)

    steps = np.rint(mesh.positions[order].astype(np.float64) * (_METRES_PER_UM / step_m))
    lattice = steps.astype(np.int64)
    origin = lattice.min(axis=0)
    offsets = lattice - origin
    if offsets.max() > _MAX_STEPS:
        raise ValueError(f"{name} spans {offsets.max()} lattice steps, more than {_MAX_STEPS}")
    max_offset = offsets.max(axis=0)

    buffers = CompressedBuffers()
    attributes = {
        "POSITION": buffers.add_attribute(
            padded(offsets.astype(np.uint16)),
            {
                "componentType": _UNSIGNED_SHORT,
                "type": "VEC3",
                "min": [0, 0, 0],
                "max": [int(m) for m in max_offset],
            },
        ),
        "NORMAL": buffers.add_directions(_unit(mesh.normals[order]), "VEC3"),
    }
    if maps:
        if mesh.uvs is None:
            raise ValueError(f"{name} has baked maps and no UVs")
        attributes["TEXCOORD_0"] = _add_uvs(buffers, mesh.uvs[order])
        if mesh.tangents is not None and "normalTexture" in maps:
            attributes["TANGENT"] = _add_tangents(buffers, mesh.tangents[order])
    colors = vertex_colors(mesh)
    if colors is not None:
        attributes["COLOR_0"] = _add_colors(buffers, colors[order])
    if mesh.objects is not None:
        attributes["_FEATURE_ID_0"] = add_feature_ids(buffers, mesh.objects[order])
        if mesh.paint is not None:
            attributes["_PAINT"] = _add_paint(buffers, mesh.paint[order])
    primitive: dict[str, Any] = {
        "attributes": attributes,
        "indices": buffers.add_indices(indices, len(order)),
        "material": 0,
    }

    drawn = material.to_gltf(extras.get("channel", name))
    extensions = ["EXT_meshopt_compression", "KHR_mesh_quantization"]
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": GENERATOR},
        "extensionsUsed": extensions,
        "extensionsRequired": extensions,
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {
                "name": name,
                "mesh": 0,
                "translation": list(_to_metres(origin, step_m)),
                "scale": [step_m] * 3,
                "extras": extras,
            }
        ],
        "meshes": [{"primitives": [primitive]}],
        "materials": [drawn],
    }
    if maps:
        extensions.append("KHR_texture_basisu")
        for i, name_of_map in enumerate(maps):
            holder = drawn["pbrMetallicRoughness"] if name_of_map in _OF_COLOR else drawn
            holder[name_of_map] = {"index": i}
        document["textures"] = [
            {"sampler": 0, "extensions": {"KHR_texture_basisu": {"source": i}}}
            for i in range(len(maps))
        ]
        document["images"] = [
            {"mimeType": "image/ktx2", "bufferView": buffers.add(data)} for data in maps.values()
        ]
        document["samplers"] = [
            {
                "magFilter": _LINEAR,
                "minFilter": _LINEAR_MIPMAP_LINEAR,
                "wrapS": _CLAMP,
                "wrapT": _CLAMP,
            }
        ]
    if features is not None:
        # These extensions are not required: a viewer can draw the mesh without them.
        of_objects = ["EXT_mesh_features", "EXT_structural_metadata"]
        document["extensionsUsed"] = [*extensions, *of_objects]
        ids, metadata = describe_features(buffers, features, extras.get("channel", name))
        primitive["extensions"] = {"EXT_mesh_features": ids}
        document["extensions"] = {"EXT_structural_metadata": metadata}
    binary = buffers.finish(document)
    return Glb(
        _pack(document, binary), _to_metres(origin, step_m), _to_metres(origin + max_offset, step_m)
    )


def _to_metres(point: NDArray[np.int64], step_m: float) -> tuple[float, float, float]:
    x, y, z = (float(n * step_m) for n in point)
    return x, y, z


def _add_uvs(buffers: CompressedBuffers, uvs: NDArray[np.float32]) -> int:
    """Store UVs, with v downwards as in glTF; in 16 bits unless some lie outside 0..1."""
    flipped = np.stack([uvs[:, 0], 1 - uvs[:, 1]], axis=1)
    if flipped.min() < 0 or flipped.max() > 1:
        floats = np.ascontiguousarray(flipped, dtype=np.float32)
        return buffers.add_attribute(floats, {"componentType": _FLOAT, "type": "VEC2"})
    values = np.rint(flipped * 0xFFFF).astype(np.uint16)
    return buffers.add_attribute(
        values, {"componentType": _UNSIGNED_SHORT, "normalized": True, "type": "VEC2"}
    )


def _pick(textures: Textures) -> dict[str, bytes]:
    """Return the maps that exist, by their names in a material."""
    named = {
        "normalTexture": textures.normal,
        "occlusionTexture": textures.occlusion,
        "baseColorTexture": textures.color,
    }
    return {name: data for name, data in named.items() if data is not None}


def vertex_colors(mesh: Mesh, *, occlusion: bool = True) -> NDArray[np.uint8] | None:
    """Return the factors of the base colour, uint8 (n, 3), or None if the mesh has none.

    They are the mesh's colours, darker where light is occluded. glTF has no occlusion at vertices.
    An occlusion map dims only ambient light, while a factor of the colour dims all light. So the
    occlusion is multiplied by the share of ambient light.
    """
    openness = mesh.openness if occlusion else None
    if mesh.colors is None and openness is None:
        return None
    colors = np.ones((len(mesh.positions), 3))
    if mesh.colors is not None:
        colors *= np.clip(mesh.colors, 0, 1)
    if openness is not None:
        hidden = 1 - np.clip(openness.astype(np.float64), 0, 1)
        colors *= (1 - AMBIENT_SHARE * hidden)[:, np.newaxis]
    return np.rint(colors * 255).astype(np.uint8)


def _add_colors(buffers: CompressedBuffers, colors: NDArray[np.uint8]) -> int:
    return buffers.add_attribute(
        padded(colors), {"componentType": _UNSIGNED_BYTE, "normalized": True, "type": "VEC3"}
    )


def _add_paint(buffers: CompressedBuffers, paint: NDArray[np.float32]) -> int:
    """Store the intensity of a channel at vertices of objects, whose colour the viewer chooses."""
    rows = np.zeros((len(paint), 4), dtype=np.uint8)  # vertex strides are multiples of 4 bytes
    rows[:, 0] = np.rint(np.clip(paint, 0, 1) * 255)
    return buffers.add_attribute(
        rows, {"componentType": _UNSIGNED_BYTE, "normalized": True, "type": "SCALAR"}
    )


def _add_tangents(buffers: CompressedBuffers, tangents: NDArray[np.float32]) -> int:
    signs = np.where(tangents[:, 3:] < 0, -1.0, 1.0)
    return buffers.add_directions(np.hstack([_unit(tangents[:, :3]), signs]), "VEC4")


def _unit(vectors: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """Return unit vectors (n, 3); a zero vector becomes +z."""
    wide = vectors.astype(np.float64)
    lengths = np.linalg.norm(wide, axis=1, keepdims=True)
    wide[lengths[:, 0] == 0] = (0.0, 0.0, 1.0)
    return wide / np.where(lengths == 0, 1.0, lengths)


def padded(values: NDArray[Any]) -> NDArray[Any]:
    """Return rows of 3 numbers with a zero appended, as vertex strides are multiples of 4 bytes."""
    return np.pad(values, ((0, 0), (0, 1)))


def _pack(document: dict[str, Any], binary: bytes) -> bytes:
    text = json.dumps(document, separators=(",", ":"), ensure_ascii=True).encode()
    text += b" " * (-len(text) % 4)
    length = 12 + 8 + len(text) + 8 + len(binary)
    return b"".join(
        [
            struct.pack("<4sII", b"glTF", 2, length),
            struct.pack("<I4s", len(text), b"JSON"),
            text,
            struct.pack("<I4s", len(binary), b"BIN\0"),
            binary,
        ]
    )
