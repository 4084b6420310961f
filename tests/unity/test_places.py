"""The Unity importer puts volumes and surfaces at the right positions, in left-handed metres.

Expected positions are those of the specimen, mirrored in x. glTFast mirrors x on import, and so
does its stub (stubs/GltFast.cs) with each .glb.
"""

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom

from stereocell.engine.run import Engine
from stereocell.formats import tiles3d
from support.bundles import load, write_bundle
from support.unity_import import UM, boxes, child, texels_of, volume_of, world_of

Run = Callable[..., subprocess.CompletedProcess[bytes]]
Import = Callable[..., Any]


@pytest.fixture
def edited(stage: Path, tmp_path: Path) -> Callable[[Gf.Matrix4d], Path]:
    """Return a function that writes a bundle whose second tile has a matrix (row vectors, um)."""

    def write(matrix: Gf.Matrix4d) -> Path:
        layer = Sdf.Layer.CreateNew(str(tmp_path / "edited.usda"))
        layer.subLayerPaths = [str(stage)]
        over = Usd.Stage.Open(layer)
        tile = UsdGeom.Xformable(over.GetPrimAtPath("/Specimen/Tiles/r0_c1"))
        tile.MakeMatrixXform().Set(matrix)
        layer.Save()
        out = tmp_path / "edited"
        write_bundle(Path(layer.realPath), out, None, engine=Engine(0))
        return out

    return write


def check_volumes(found: Any, bundle: Path) -> None:
    """Check each voxel's texture coordinates, from Unity's world by the shader's own values."""
    root = found["root"]
    ids = [c["id"] for c in found["channels"]]
    places = list(boxes(root))
    assert {tile for tile, _ in places} == {
        t["id"] for t in load(bundle / "manifest.json")["tiles"]
    }
    for tile, box in places:
        material = box["material"]
        texels = texels_of(material["_Volume"])
        to_box = np.array([material[f"_ToBox{row}"] for row in range(3)])
        size = np.array(material["_Size"][:3])
        low, high = (np.array(material[name][:3]) for name in ("_TexLow", "_TexHigh"))
        for component, channel in enumerate(box["channels"]):
            volume, voxels = volume_of(bundle, ids[channel], tile)
            assert np.array_equal(texels[..., component], voxels)
            n, apron = np.array(volume["size"]), volume["apron"]
            spacing = np.subtract(volume["bounds_um"]["max"], volume["bounds_um"]["min"]) / (
                n - 1 - 2 * apron
            )
            index = np.stack(np.meshgrid(*(np.arange(k) for k in n), indexing="ij"), -1).reshape(
                -1, 3
            )
            x, y, z = ((index - apron) * spacing).T
            a, b = volume["bounds_um"]["min"], volume["bounds_um"]["max"]
            at = np.stack([a[0] + x, b[1] - y, a[2] + z], axis=1)
            matrix = np.array(volume["matrix"]).reshape(4, 4).T  # column by column
            world = world_of(root, bundle, at @ matrix[:3, :3].T + matrix[:3, 3])
            # As in Unity, from the world to the object's space, and then to the shader's space
            scale = root["scale"][0] * box["scale"][0]
            inside = (world - box["position"]) / scale
            in_box = inside @ to_box[:, :3].T + to_box[:, 3]
            texture = low + in_box / size * (high - low)
            assert np.allclose(texture, (index + 0.5) / n, atol=2e-5)
            assert box["scale"] == [1, 1, 1]
            assert material["_Voxel"] == pytest.approx(spacing.min())
        corners = np.array(box["vertices"]) @ to_box[:, :3].T + to_box[:, 3]
        k = np.arange(8)
        expected = np.stack([k & 1, k >> 1 & 1, k >> 2], axis=1) * size
        assert np.allclose(corners, expected, atol=1e-4)
        vertices = np.array(box["vertices"])
        triangles = vertices[np.array(box["triangles"]).reshape(-1, 3)]
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        outwards = (normals * (triangles.mean(axis=1) - vertices.mean(axis=0))).sum(axis=1)
        assert (outwards > 0).all()  # a front face in Unity: clockwise, left-handed
        assert len(triangles) == 12
        around = [material["_AllLow"][:3], material["_AllHigh"][:3]]
        for _, other in places:
            scale = root["scale"][0] * box["scale"][0]
            inside = (np.array(other["world"]) - box["position"]) / scale
            there = inside @ to_box[:, :3].T + to_box[:, 3]
            assert (there > np.array(around[0]) - 1e-3).all()
            assert (there < np.array(around[1]) + 1e-3).all()


def check_surfaces(found: Any, bundle: Path) -> int:
    """Check that each surface lies in its tile; return the number of surfaces."""
    count = 0
    for tile in load(bundle / "manifest.json")["tiles"]:
        made = child(found["root"], tile["id"])
        bounds = np.array([tile["bounds_um"]["min"], tile["bounds_um"]["max"]])
        low, high = np.sort(world_of(found["root"], bundle, bounds), axis=0)
        assert np.allclose(made["position"], (low + high) / 2, atol=1e-6)
        assert np.allclose(
            np.array(made["collider"]) * found["root"]["scale"][0], high - low, atol=1e-6
        )
        for channel in child(made, "surfaces").get("children", []):
            for level in channel["children"]:
                corners = np.array(level["world"])
                slack = 1e-3 * (high - low).max()
                assert (corners > low - slack).all()
                assert (corners < high + slack).all()
                assert (np.ptp(corners, axis=0) > 0.2 * (high - low).min()).all()
                count += 1
    return count


@pytest.mark.slow
def test_volumes_and_surfaces_are_in_their_places(bundle: Path, imported: Import) -> None:
    found = imported(bundle)
    check_volumes(found, bundle)
    assert check_surfaces(found, bundle) == 6
    root = found["root"]
    assert root["name"] == "two tiles"
    assert [t["name"] for t in root["children"]] == ["r0_c0", "r0_c1"]
    tiles = load(bundle / "manifest.json")["tiles"]
    for tile, made in zip(tiles, root["children"], strict=True):
        assert child(made, "surfaces")["active"] == (tile["representation"] != "volume")
        assert child(made, "volume")["active"] == (tile["representation"] != "mesh")
        assert made["tile"] == (tile["representation"] != "mesh")
    size = np.ptp([b for t in tiles for b in t["bounds_um"].values()], axis=0).max()
    assert root["scale"][0] * size * UM == pytest.approx(0.5)


@pytest.mark.slow
def test_surface_and_volume_of_a_sphere_coincide(bundle: Path, imported: Import) -> None:
    """The .glb's own positions and the shader's positions of voxels have the same bounds."""
    found = imported(bundle)
    root = found["root"]
    tile = child(root, "r0_c0")
    (lod0,) = (c for c in child(tile, "surfaces", "CD31")["children"] if c["name"] == "lod0")
    (box,) = (box for name, box in boxes(root) if name == "r0_c0")
    surface = np.sort(np.array(lod0["world"]), axis=0)
    texels = texels_of(box["material"]["_Volume"])[..., box["channels"].index(0)]
    z, y, x = np.nonzero(texels > texels.max() / 2)
    material = box["material"]
    low, high = (np.array(material[name][:3]) for name in ("_TexLow", "_TexHigh"))
    size = np.array(material["_Size"][:3])
    texture = (np.stack([x, y, z], axis=1) + 0.5) / texels.shape[::-1]
    in_box = (texture - low) / (high - low) * size
    to_box = np.array([material[f"_ToBox{row}"] for row in range(3)])
    inside = (in_box - to_box[:, 3]) @ np.linalg.inv(to_box[:, :3]).T
    world = np.array(box["position"]) + inside * root["scale"][0]
    voxel = material["_Voxel"] * root["scale"][0] * UM
    assert np.allclose(world.min(axis=0), surface[0], atol=2.1 * voxel)
    assert np.allclose(world.max(axis=0), surface[1], atol=2.1 * voxel)


@pytest.mark.slow
def test_the_package_s_own_test_in_the_editor_finds_a_mirrored_surface(
    run: Run, bundle: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lies = "SurfacesLieInTheirVolumes"
    unset = "STEREOCELL_BUNDLE is not set to the folder of a bundle"
    assert json.loads(run("tests", -1).stdout)[lies] == unset
    monkeypatch.setenv("STEREOCELL_BUNDLE", str(bundle))
    found = json.loads(run("tests", -1).stdout)
    assert found == {"TheShaderCompiles": "passed", lies: "passed"}
    assert "lies outside its volume" in json.loads(run("tests", 1).stdout)[lies]


def turned() -> Gf.Matrix4d:
    turn = Gf.Matrix4d().SetRotate(Gf.Rotation((0.3, 1, 0.2), 40))
    return turn * Gf.Matrix4d().SetTranslate((3, -4, 5))


def sheared() -> Gf.Matrix4d:
    return Gf.Matrix4d(1, 0, 0, 0, 0.4, 1, 0, 0, 0, 0.3, 1.5, 0, 2, 3, 4, 1)


def flipped() -> Gf.Matrix4d:
    return Gf.Matrix4d().SetScale((-1, 1, 1)) * Gf.Matrix4d().SetTranslate((40, 0, 0))


@pytest.mark.slow
@pytest.mark.parametrize("move", [turned, sheared, flipped])
def test_a_tile_that_was_moved_keeps_its_matrix(
    edited: Callable[[Gf.Matrix4d], Path], imported: Import, move: Callable[[], Gf.Matrix4d]
) -> None:
    bundle = edited(move())
    volume, _ = volume_of(bundle, "CD31", "r0_c1")
    assert not np.allclose(volume["matrix"], np.eye(4).ravel())
    check_volumes(imported(bundle), bundle)


@pytest.mark.slow
def test_levels_of_detail_follow_their_errors(bundle: Path, imported: Import) -> None:
    found = imported(bundle)
    root_error: dict[str, list[float]] = {}
    (entry,) = (c for c in load(bundle / "manifest.json")["channels"] if c["id"] == "CD31")

    def walk(node: Any) -> None:
        if "content" in node:
            tile = node["content"]["uri"].split("/")[0]
            root_error.setdefault(tile, []).append(node["geometricError"])
        for each in node.get("children", []):
            walk(each)

    walk(load(bundle / entry["tileset"]["path"])["root"])
    for tile, errors in root_error.items():
        made = child(found["root"], tile)
        group = child(made, "surfaces", "CD31")
        size = max(made["collider"])
        assert group["size"] == pytest.approx(size)
        # If an object takes the share h of a screen of 1080 pixels, its error e takes
        # e / size * h * 1080 pixels.
        *errors, finest = errors
        assert finest == 0
        expected = [2 * size / (1080 * e) for e in reversed(errors)] + [0]
        expected = [min(1, h) for h in expected]
        assert [height for height, _ in group["lods"]] == pytest.approx(expected, rel=0.02)
        assert all(count == 1 for _, count in group["lods"])
        assert [level["name"] for level in group["children"]] == ["lod0", "lod1", "lod2"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("errors", "expected"),
    [
        ("0", [0]),
        ("0,1,2", [0.5, 0.25, 0]),
        ("0,1,1,1", [0.5, 0.495, 0.49005, 0]),  # Unity needs falling heights
        ("0,0,1", [1, 0.5, 0]),
        ("0,0.001,1", [1, 0.5, 0]),
    ],
)
def test_heights_of_levels_fall(run: Run, errors: str, expected: list[float]) -> None:
    done = run("heights", errors, 25, 2, 100)
    assert json.loads(done.stdout) == pytest.approx(expected)


@pytest.mark.slow
def test_tilesets_of_tilesets_are_followed(
    stage: Path, tmp_path: Path, imported: Import, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tiles3d, "MAX_WHOLE_TILES", 1)
    bundle = tmp_path / "many"
    write_bundle(stage, bundle, None, engine=Engine(0))
    assert (bundle / "channels" / "CD31" / "r0_c0" / "finer.json").exists()
    found = imported(bundle)
    assert check_surfaces(found, bundle) == 6
    lods = [
        level["name"] for level in child(found["root"], "r0_c1", "surfaces", "CD31")["children"]
    ]
    assert lods == ["lod0", "lod1", "lod2"]
