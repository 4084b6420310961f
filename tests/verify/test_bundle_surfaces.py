"""A bundle's surface agrees with the stage's as closely as 8 bits and a lattice allow."""

import json
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stereocell.formats.gltf import Material, choose_step, encode_glb
from stereocell.formats.gltf_decode import read_glb
from stereocell.formats.tiles3d_walk import Content
from stereocell.model.errors import CheckError
from stereocell.model.mesh import Mesh
from stereocell.usd.read_levels import ComposedLod
from stereocell.usd.read_textures import ComposedMaps
from stereocell.verify.bundle_surfaces import _compare_faces, compare_surfaces
from stereocell.verify.paired_surfaces import Surface, pair_surfaces


@pytest.fixture
def fins() -> Mesh:
    """Triangles whose three vertex normals nearly cancel out, as those over sharp edges do."""
    rng = np.random.default_rng(0)
    corners = rng.normal(size=(200, 3, 3)).astype(np.float32)
    corners += 10 * np.arange(200, dtype=np.float32)[:, None, None]
    x, y = np.linalg.qr(rng.normal(size=(200, 3, 2)))[0].transpose(2, 0, 1)
    angles = 2 / 3 * np.pi * np.arange(3)[:, None, None] + rng.normal(0, 0.03, (3, 200, 1))
    normals = (np.cos(angles) * x + np.sin(angles) * y).transpose(1, 0, 2).reshape(-1, 3)
    triangles = np.arange(600, dtype=np.uint32).reshape(-1, 3)
    return Mesh(corners.reshape(-1, 3), triangles, normals.astype(np.float32))


def _faults(stage: Mesh, bundle: Mesh, tmp_path: Path) -> list[str]:
    file = tmp_path / "fins.glb"
    grey = Material((0.5, 0.5, 0.5))
    file.write_bytes(
        encode_glb(bundle, choose_step(2100), material=grey, name="fins", extras={}).data
    )
    drawn = read_glb(file)
    places, decoded = stage.positions / 1e6, drawn.positions_m.astype(np.float64)
    pairs = pair_surfaces(
        Surface(places, stage.triangles), Surface(decoded, drawn.triangles), drawn.step_m
    )
    return list(_compare_faces(places, decoded, pairs, drawn, stage))


def test_rounded_normals_that_nearly_cancel_out_are_no_fault(fins: Mesh, tmp_path: Path) -> None:
    assert _faults(fins, fins, tmp_path) == []


def test_normals_turned_by_five_degrees_are_a_fault(fins: Mesh, tmp_path: Path) -> None:
    alike = replace(fins, normals=np.repeat(fins.normals[::3], 3, axis=0))
    turned = alike.normals + np.float32(np.tan(np.radians(5))) * np.cross(
        alike.normals, [0.6, 0.0, 0.8]
    ).astype(np.float32)
    assert _faults(alike, alike, tmp_path) == []
    [faults] = _faults(alike, replace(alike, normals=turned), tmp_path)
    assert faults.endswith("% of its area has other normals")


def test_a_file_that_states_more_rows_than_memory_holds_is_refused(
    fins: Mesh, tmp_path: Path
) -> None:
    grey = Material((0.5, 0.5, 0.5))
    data = encode_glb(fins, choose_step(2100), material=grey, name="fins", extras={}).data
    (length,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + length])
    for view in document["bufferViews"]:
        view["extensions"]["EXT_meshopt_compression"]["count"] = 3 << 40
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    size = 20 + len(text) + len(data) - 20 - length
    head = struct.pack("<4s3I4s", b"glTF", 2, size, len(text), b"JSON")
    (tmp_path / "large.glb").write_bytes(head + text + data[20 + length :])
    with pytest.raises(CheckError, match="expected at most 1073741824"):
        read_glb(tmp_path / "large.glb")


@pytest.mark.parametrize(("moved_um", "problems"), [(1e-4, []), (3, ["the bundle lacks lod1"])])
def test_a_level_without_a_file_is_drawn_by_the_finer_one_if_only_rounding_parts_them(
    moved_um: float, problems: list[str], fins: Mesh, tmp_path: Path
) -> None:
    def level(number: int, mesh: Mesh) -> ComposedLod:
        return ComposedLod(
            number, mesh, 0.0, 0.0, grey, ComposedMaps(), np.eye(4), "", "", tuple(np.eye(4).flat)
        )

    grey, file = Material((0.5, 0.5, 0.5)), tmp_path / "lod0.glb"
    glb = encode_glb(fins, choose_step(2100), material=grey, name="fins", extras={})
    file.write_bytes(glb.data)
    moved = replace(fins, positions=fins.positions + np.float32(moved_um))
    worst, found = compare_surfaces(
        {0: Content(tmp_path / "tileset.json", file, {}, 0.0, 0.0, ())},
        {0: level(0, fins), 1: level(1, moved)},
    )
    assert found == problems
    assert worst < 1
