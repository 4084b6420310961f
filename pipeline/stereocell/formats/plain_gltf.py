"""Write many meshes as one glTF 2.0 file of floats, without extensions, that any program opens.

Vertices are written to a file beside the target as meshes arrive, so that only one mesh is in
memory at a time. Other buffers pack them by an extension that readers must know:
export/packed_gltf.py.
"""

import base64
import json
import shutil
import struct
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO, Protocol

import numpy as np
from numpy.typing import NDArray

from stereocell.formats.gltf import Material, vertex_colors
from stereocell.model.errors import OutputError
from stereocell.model.mesh import Mesh
from stereocell.model.version import GENERATOR
from stereocell.storage.atomic_write import replacing

_UNSIGNED_BYTE, _UNSIGNED_SHORT, _UNSIGNED_INT, _FLOAT = 5121, 5123, 5125, 5126
_VERTICES, _INDICES = 34962, 34963  # bufferView.target
_MAX_BYTES = 2**32 - 1  # largest size of a .glb in bytes, since its length is a number of 32 bits


class Buffers(Protocol):
    """A store for the vertices and indices of a glTF file's meshes."""

    extensions: tuple[str, ...]

    def add_mesh(
        self, mesh: Mesh, positions: NDArray[np.float64], colors: NDArray[np.uint8] | None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Store a mesh; return its primitive, and the properties that place its node.

        positions  float64 (n, 3), in metres
        colors     uint8 (n, 3), linear, or None
        """

    def finish(self, document: dict[str, Any], binary: BinaryIO) -> None:
        """Add accessors, bufferViews and buffers to the document, and the bytes to a file."""


class PlainBuffers:
    """One buffer of floats, whose bytes are written as they arrive."""

    extensions: tuple[str, ...] = ()

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._size = 0
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []

    def add_mesh(
        self, mesh: Mesh, positions: NDArray[np.float64], colors: NDArray[np.uint8] | None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        places = positions.astype("<f4")
        ends = {"min": places.min(axis=0).tolist(), "max": places.max(axis=0).tolist()}
        attributes = {
            "POSITION": self._add(places, _FLOAT, "VEC3", _VERTICES, ends),
            "NORMAL": self._add(_unit(mesh.normals), _FLOAT, "VEC3", _VERTICES),
        }
        if colors is not None:
            rgba = np.pad(colors, ((0, 0), (0, 1)), constant_values=255)
            more = {"normalized": True}
            attributes["COLOR_0"] = self._add(rgba, _UNSIGNED_BYTE, "VEC4", _VERTICES, more)
        is_short = len(positions) < 0xFFFF  # index 65535 itself would restart a strip
        indices = mesh.triangles.ravel().astype("<u2" if is_short else "<u4")
        kind = _UNSIGNED_SHORT if is_short else _UNSIGNED_INT
        return {
            "attributes": attributes,
            "indices": self._add(indices, kind, "SCALAR", _INDICES),
        }, {}

    def finish(self, document: dict[str, Any], binary: BinaryIO) -> None:
        document["accessors"] = self._accessors
        document["bufferViews"] = self._views
        document["buffers"] = [{"byteLength": self._size}]
        self._file.seek(0)
        shutil.copyfileobj(self._file, binary)

    def _add(
        self,
        values: NDArray[Any],
        component: int,
        kind: str,
        target: int,
        more: Mapping[str, Any] | None = None,
    ) -> int:
        data = np.ascontiguousarray(values).tobytes()
        view = {
            "buffer": 0, "byteOffset": self._size, "byteLength": len(data), "target": target,
        }  # fmt: skip
        self._views.append(view)
        self._file.write(data + bytes(-len(data) % 4))
        self._size += -(-len(data) // 4) * 4
        accessor = {"bufferView": len(self._views) - 1, "componentType": component, "type": kind}
        self._accessors.append({**accessor, "count": len(values), **(more or {})})
        return len(self._accessors) - 1


class Document:
    """The tree of nodes of one glTF file: a root, groups below it, meshes below these."""

    def __init__(self, name: str, buffers: Buffers, extras: Mapping[str, Any]) -> None:
        self._buffers = buffers
        self._nodes: list[dict[str, Any]] = [{"name": name, "children": [], "extras": extras}]
        self._groups: dict[str, int] = {}
        self._materials: dict[tuple[str, Material], int] = {}
        self._meshes: list[dict[str, Any]] = []

    def add(
        self,
        group: str,
        name: str,
        mesh: Mesh,
        positions: NDArray[np.float64],
        material: Material,
        extras: Mapping[str, Any],
        *,
        occlusion: bool = True,
    ) -> None:
        """Add a mesh to a group, in which each appearance has one material.

        positions  float64 (n, 3), in metres, used in place of the mesh's own
        occlusion  whether vertices are darker where light is occluded
        """
        if group not in self._groups:
            self._nodes.append({"name": group, "children": []})
            self._groups[group] = len(self._nodes) - 1
            self._nodes[0]["children"].append(len(self._nodes) - 1)
        key = group, material
        number = self._materials.setdefault(key, len(self._materials))
        primitive, place = self._buffers.add_mesh(
            mesh, positions, vertex_colors(mesh, occlusion=occlusion)
        )
        self._meshes.append({"name": name, "primitives": [{**primitive, "material": number}]})
        node = {"name": name, "mesh": len(self._meshes) - 1, **place, "extras": dict(extras)}
        self._nodes.append(node)
        self._nodes[self._groups[group]]["children"].append(len(self._nodes) - 1)

    def write(self, path: Path) -> None:
        """Write a .glb, or a .gltf with its buffer inside. Raises OutputError."""
        document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": GENERATOR},
            "scene": 0,
            "scenes": [{"name": self._nodes[0]["name"], "nodes": [0]}],
            "nodes": self._nodes,
            "meshes": self._meshes,
            "materials": [one.to_gltf(group) for group, one in self._materials],
        }
        if self._buffers.extensions:
            document["extensionsUsed"] = list(self._buffers.extensions)
            document["extensionsRequired"] = list(self._buffers.extensions)
        with tempfile.TemporaryFile(dir=path.parent) as binary, replacing(path) as temporary:
            self._buffers.finish(document, binary)
            size = binary.tell()
            binary.seek(0)
            with temporary.open("wb") as file:
                if path.suffix.lower() == ".gltf":
                    data = base64.b64encode(binary.read()).decode()
                    document["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{data}"
                    file.write(_text(document))
                    return
                text = _text(document)
                length = 12 + 8 + len(text) + 8 + size
                if length > _MAX_BYTES:
                    raise OutputError(
                        f"{path}: found {length} bytes, expected at most {_MAX_BYTES} in a .glb: "
                        "use a coarser --lod, fewer --tiles, or --compress meshopt"
                    )
                file.write(struct.pack("<4sII", b"glTF", 2, length))
                file.write(struct.pack("<I4s", len(text), b"JSON") + text)
                file.write(struct.pack("<I4s", size, b"BIN\0"))
                shutil.copyfileobj(binary, file)


def _text(document: dict[str, Any]) -> bytes:
    text = json.dumps(document, separators=(",", ":"), ensure_ascii=True).encode()
    return text + b" " * (-len(text) % 4)


def _unit(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return unit vectors; a zero vector becomes +z."""
    wide = normals.astype(np.float64)
    lengths = np.linalg.norm(wide, axis=1, keepdims=True)
    wide[lengths[:, 0] == 0] = (0.0, 0.0, 1.0)
    return (wide / np.where(lengths == 0, 1.0, lengths)).astype("<f4")
