"""Take a .glb apart, by the tables of glTF 2.0 and EXT_meshopt_compression."""

import json
import struct

import meshopt
import numpy as np

_NUMBERS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def read(data):
    """Return the document and the decoded accessors."""
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    json_length, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    document = json.loads(data[20 : 20 + json_length])
    binary_length, kind = struct.unpack_from("<I4s", data, 20 + json_length)
    assert kind == b"BIN\0"
    binary = data[28 + json_length :]
    assert binary_length == len(binary) == document["buffers"][0]["byteLength"]
    types = {5120: np.int8, 5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
    arrays = []
    for accessor in document["accessors"]:
        view = document["bufferViews"][accessor["bufferView"]]["extensions"][
            "EXT_meshopt_compression"
        ]
        start = view.get("byteOffset", 0)
        stored = binary[start : start + view["byteLength"]]
        dtype = types[accessor["componentType"]]
        if view["mode"] == "TRIANGLES":
            assert stored[0] == 0xE1
            arrays.append(meshopt.decode_index_buffer(stored, view["count"], view["byteStride"]))
        else:
            assert stored[0] == 0xA0  # version 0 of the vertex codec, the only one of the extension
            rows = meshopt.decode_vertex_buffer(
                stored, view["count"], view["byteStride"], view.get("filter")
            )
            arrays.append(rows.view(dtype)[:, : _NUMBERS[accessor["type"]]])
    return document, arrays


def property_table(data):
    """Return the one property table of a document, by EXT_structural_metadata.

    Enums are names, other values numbers. A value that the schema calls missing is None.
    """
    document, _ = read(data)
    binary = data[28 + struct.unpack_from("<I", data, 12)[0] :]
    metadata = document["extensions"]["EXT_structural_metadata"]
    (table,) = metadata["propertyTables"]
    properties = metadata["schema"]["classes"][table["class"]]["properties"]
    found = {}
    for name, entry in table["properties"].items():
        view, shape = document["bufferViews"][entry["values"]], properties[name]
        assert view["byteOffset"] % 8 == 0
        enum = metadata["schema"]["enums"][shape["enumType"]] if "enumType" in shape else None
        kind = np.dtype((enum["valueType"] if enum else shape["componentType"]).lower())
        assert view["byteLength"] == kind.itemsize * table["count"]
        values = np.frombuffer(binary, kind, table["count"], view["byteOffset"]).tolist()
        if enum:
            names = {each["value"]: each["name"] for each in enum["values"]}
            assert len(set(names.values())) == len(enum["values"])
            values = [names[value] for value in values]
        none = shape.get("noData")
        found[name] = [None if none is not None and v == none else v for v in values]
    return found


def decoded_positions_m(data):
    """World positions as a viewer gets them: in float32."""
    document, arrays = read(data)
    node = document["nodes"][0]
    offsets = arrays[document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
    scale, translation = np.float32(node["scale"]), np.float32(node["translation"])
    return offsets.astype(np.float32) * scale + translation


def decoded_colors(data):
    """Factors of the base colour at the vertices, uint8 (n, 3)."""
    document, arrays = read(data)
    return arrays[document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]][:, :3]
