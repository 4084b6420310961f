import json
from dataclasses import replace

import numpy as np
import pytest

from stereocell.formats.gltf import Material, Textures, choose_step, encode_glb
from stereocell.model.mesh import Mesh
from support.glbs import decoded_positions_m, read

EXTRAS = {"tile": "r0_c0", "channel": "CD31"}
RED = Material((1.0, 0.25, 0.0), 0.0, 0.75)
MAP = Textures(b"map")


def patch(x0, x1, y=-40.0, n=9):
    """Return a square in the plane y = `y`, x from x0 to x1, with UVs and tangents along x."""
    u, v = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    positions = np.stack([x0 + u * (x1 - x0), np.full_like(u, y), v * 17.3], -1).reshape(-1, 3)
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1], i[:-1, 1:], i[1:, 1:], i[1:, :-1]
    quads = [np.stack(corner, -1).reshape(-1, 3) for corner in ((a, c, b), (a, d, c))]
    return Mesh(
        positions.astype(np.float32),
        np.concatenate(quads).astype(np.uint32),
        np.tile(np.float32([0, 1, 0]), (n * n, 1)),
        np.stack([u, v], -1).reshape(-1, 2).astype(np.float32),
        np.tile(np.float32([1, 0, 0, -1]), (n * n, 1)),
    )


def test_neighbours_decode_their_common_vertices_to_equal_floats():
    left, right = patch(-13.7, 72.31), patch(72.31, 181.2)
    step = choose_step(109.0)
    edges = []
    for mesh in (left, right):
        points = decoded_positions_m(
            encode_glb(mesh, step, material=RED, name="mesh", extras=EXTRAS).data
        )
        edge = points[np.abs(points[:, 0] - 72.31e-6) < 1e-7]
        edges.append(edge[np.argsort(edge[:, 2])])
    assert len(edges[0]) == 9
    assert edges[0].tobytes() == edges[1].tobytes()


def test_positions_are_in_metres_to_half_a_step():
    mesh = patch(-13.7, 72.31)
    step = choose_step(90.0)
    glb = encode_glb(mesh, step, material=RED, name="mesh", extras=EXTRAS)
    points = decoded_positions_m(glb.data)
    distances = np.abs(points[:, None] * 1e6 - mesh.positions[None]).max(-1).min(1)
    assert distances.max() <= 0.51 * step * 1e6
    assert np.allclose(glb.min_m, points.min(0), atol=1e-12)
    assert np.allclose(glb.max_m, points.max(0), atol=1e-12)


@pytest.mark.parametrize("extent_um", [0.0, 1e-3, 71.68, 200.0, 3e5])
def test_step_is_a_power_of_two_that_spans_the_extent(extent_um):
    step = choose_step(extent_um)
    assert np.log2(step) == round(np.log2(step))
    assert extent_um * 1e-6 / step <= 2**14


def test_triangles_keep_their_winding_and_number():
    mesh = patch(0, 10)
    document, arrays = read(
        encode_glb(mesh, choose_step(20), material=RED, name="mesh", extras=EXTRAS).data
    )
    primitive = document["meshes"][0]["primitives"][0]
    corners = arrays[primitive["attributes"]["POSITION"]].astype(float)[
        arrays[primitive["indices"]].reshape(-1, 3)
    ]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert len(facing) == len(mesh.triangles)
    # Counter-clockwise as seen from above, in agreement with the normals
    assert (facing[:, 1] > 0).all()


def test_vertices_without_a_triangle_are_left_out():
    mesh = patch(0, 10)
    half = Mesh(mesh.positions, mesh.triangles[:1], mesh.normals)
    document, _ = read(
        encode_glb(half, choose_step(20), material=RED, name="mesh", extras=EXTRAS).data
    )
    assert document["accessors"][0]["count"] == 3


def test_color_and_extras_are_written():
    document, _ = read(
        encode_glb(patch(0, 10), choose_step(20), material=RED, name="mesh", extras=EXTRAS).data
    )
    factor = document["materials"][0]["pbrMetallicRoughness"]
    assert factor["baseColorFactor"] == [1.0, 0.25, 0.0, 1.0]
    assert (factor["metallicFactor"], factor["roughnessFactor"]) == (0, 0.75)
    assert document["materials"][0]["doubleSided"]
    assert document["nodes"][0]["extras"] == EXTRAS
    assert document["nodes"][0]["name"] == "mesh"
    assert "KHR_texture_basisu" not in document["extensionsUsed"]


def test_the_json_of_a_small_level_repeats_nothing():
    """Otherwise the JSON would be as large as the level's triangles."""
    names = {"tile": "r10_c10", "channel": "MART1"}
    data = encode_glb(
        patch(0, 10), choose_step(20), material=RED, name="MART1_r10_c10", extras=names
    ).data
    document, _ = read(data)
    text = json.dumps(document)
    assert [text.count(f'"{each}"') for each in ("MART1_r10_c10", "r10_c10", "extras")] == [1, 1, 1]
    assert '"byteOffset": 0,' not in text
    assert int.from_bytes(data[12:16], "little") < 1800


def test_normals_and_tangents_are_kept_to_about_a_degree():
    rng = np.random.default_rng(0)
    mesh = patch(0, 10, n=40)
    normals = rng.normal(size=(1600, 3))
    normals[:6] = [*np.eye(3), *-np.eye(3)]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    signs = rng.choice([-1.0, 1.0], size=(1600, 1))
    tangents = np.hstack([normals[::-1], signs]).astype(np.float32)
    mesh = replace(mesh, normals=normals.astype(np.float32), tangents=tangents)
    document, arrays = read(
        encode_glb(mesh, choose_step(20), material=RED, name="m", extras=EXTRAS, textures=MAP).data
    )
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    # Vertices are in another order, so each is found by its position.
    x, _, z = arrays[attributes["POSITION"]].astype(float).T
    u, v = (np.rint(39 * axis / axis.max()).astype(int) for axis in (x, z))
    for name, expected in (("NORMAL", normals), ("TANGENT", tangents)):
        found = arrays[attributes[name]] / 127
        there = expected[40 * v + u]
        cosines = (found[:, :3] * there[:, :3]).sum(1) / np.linalg.norm(found[:, :3], axis=1)
        assert np.degrees(np.arccos(cosines.clip(-1, 1))).max() < 1.1
        assert np.abs(np.linalg.norm(found[:, :3], axis=1) - 1).max() < 0.01
        assert (found[:, 3:] == there[:, 3:]).all()


def test_a_normal_map_adds_tangents_and_uvs_with_v_down():
    mesh = patch(0, 10)
    document, arrays = read(
        encode_glb(
            mesh,
            choose_step(20),
            material=RED,
            name="m",
            extras=EXTRAS,
            textures=Textures(b"not looked into"),
        ).data
    )
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    uvs = arrays[attributes["TEXCOORD_0"]] / 65535
    tangents = arrays[attributes["TANGENT"]]
    z = arrays[attributes["POSITION"]][:, 2]
    assert np.corrcoef(z, uvs[:, 1])[0, 1] == pytest.approx(-1)  # v of USD's st grows with z here
    assert (tangents == [127, 0, 0, -127]).all()
    assert document["extensionsRequired"][-1] == "KHR_texture_basisu"
    image = document["bufferViews"][document["images"][0]["bufferView"]]
    assert image["byteLength"] == len(b"not looked into")


def test_occlusion_and_colour_maps_are_written_with_the_normal_map():
    maps = Textures(b"normals", b"occlusion", b"colours")
    document, _ = read(
        encode_glb(
            patch(0, 10), choose_step(20), material=RED, name="m", extras=EXTRAS, textures=maps
        ).data
    )
    (material,) = document["materials"]
    texture = {
        b"normals": material["normalTexture"],
        b"occlusion": material["occlusionTexture"],
        b"colours": material["pbrMetallicRoughness"]["baseColorTexture"],
    }
    for content, reference in texture.items():
        source = document["textures"][reference["index"]]["extensions"]["KHR_texture_basisu"]
        view = document["bufferViews"][document["images"][source["source"]]["bufferView"]]
        assert view["byteLength"] == len(content)
    assert "COLOR_0" not in document["meshes"][0]["primitives"][0]["attributes"]


def test_vertex_colours_are_linear_and_darker_where_the_sky_is_hidden():
    mesh = patch(0, 10, n=2)
    colors = np.float32([[1, 0.5, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])
    openness = np.float32([1, 1, 0, 0])
    painted = replace(mesh, colors=colors, openness=openness)
    document, arrays = read(
        encode_glb(painted, choose_step(20), material=RED, name="m", extras=EXTRAS).data
    )
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    expected = np.rint(colors * np.where(openness, 1, 0.6)[:, None] * 255)
    points = arrays[attributes["POSITION"]][:, [0, 2]].astype(float)
    order = np.lexsort((points[:, 0], points[:, 1]))  # in the order of the patch's corners
    assert np.abs(arrays[attributes["COLOR_0"]][order] - expected).max() <= 1


def test_uvs_outside_the_unit_square_are_kept():
    mesh = patch(0, 10)
    wide = Mesh(mesh.positions, mesh.triangles, mesh.normals, mesh.uvs * 3 - 1, mesh.tangents)
    document, arrays = read(
        encode_glb(wide, choose_step(20), material=RED, name="m", extras=EXTRAS, textures=MAP).data
    )
    uvs = arrays[document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"]]
    assert (uvs.min(), uvs.max()) == (-1, 2)


def test_many_vertices_have_32_bit_indices():
    document, arrays = read(
        encode_glb(patch(0, 9, n=260), choose_step(20), material=RED, name="m", extras={}).data
    )
    indices = document["meshes"][0]["primitives"][0]["indices"]
    assert document["accessors"][indices]["componentType"] == 5125
    assert arrays[indices].max() == 260 * 260 - 1


def test_the_same_mesh_gives_the_same_bytes():
    first, second = (
        encode_glb(patch(0, 9), choose_step(20), material=RED, name="m", extras=EXTRAS)
        for _ in range(2)
    )
    assert first == second


def test_meshes_that_cannot_be_written_are_refused():
    mesh = patch(0, 10)
    nothing = Mesh(mesh.positions, mesh.triangles[:0], mesh.normals)
    plain = Mesh(mesh.positions, mesh.triangles, mesh.normals)
    with pytest.raises(ValueError, match="no triangles"):
        encode_glb(nothing, choose_step(20), material=RED, name="m", extras=EXTRAS)
    with pytest.raises(ValueError, match="no UVs"):
        encode_glb(plain, choose_step(20), material=RED, name="m", extras=EXTRAS, textures=MAP)
    with pytest.raises(ValueError, match="lattice steps"):
        encode_glb(mesh, choose_step(1), material=RED, name="m", extras=EXTRAS)
