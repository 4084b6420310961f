"""The Unity importer run on bundles: what lies where, in Unity's left-handed metres.

Expected places are those of the specimen, mirrored in x: so glTFast mirrors what it imports, and
the stand-in of the editor (stubs/UnityEditor.cs) does with each .glb.
"""

import base64
import json
import shutil
import subprocess
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdGeom

from stereocell.bundle.write import write_bundle
from stereocell.engine.run import Engine
from stereocell.formats import tiles3d
from stereocell.formats.ktx2 import decode_finest
from support.bundles import load, write_tiles

Run = Callable[..., subprocess.CompletedProcess[bytes]]
Import = Callable[..., Any]
MIRROR = np.diag([-1.0, 1.0, 1.0])
UM = 1e-6


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tiles(tmp_path_factory.mktemp("stage"))


@pytest.fixture(scope="module")
def bundle(stage: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of two tiles and two channels, one without surfaces; to be read only."""
    out = tmp_path_factory.mktemp("bundle") / "bundle"
    write_bundle(stage, out, None, run=Engine(0).run)
    return out


@pytest.fixture
def edited(stage: Path, tmp_path: Path) -> Callable[[Gf.Matrix4d], Path]:
    """The bundle in which the second tile is moved by a matrix (row vectors, um)."""

    def write(matrix: Gf.Matrix4d) -> Path:
        layer = Sdf.Layer.CreateNew(str(tmp_path / "edited.usda"))
        layer.subLayerPaths = [str(stage)]
        over = Usd.Stage.Open(layer)
        tile = UsdGeom.Xformable(over.GetPrimAtPath("/Specimen/Tiles/r0_c1"))
        tile.MakeMatrixXform().Set(matrix)
        layer.Save()
        out = tmp_path / "edited"
        write_bundle(Path(layer.realPath), out, None, run=Engine(0).run)
        return out

    return write


def child(of: Any, *names: str) -> Any:
    for name in names:
        (of,) = (each for each in of["children"] if each["name"] == name)
    return of


def boxes(root: Any) -> Iterator[tuple[str, Any]]:
    for tile in root["children"]:
        for box in child(tile, "volume").get("children", []):
            yield tile["name"], box


def world_of(root: Any, bundle: Path, places_um: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where places of the specimen (n, 3) are in Unity: mirrored, round its middle."""
    bounds = load(bundle / "manifest.json")["specimen"]["bounds_um"]
    middle = np.mean([bounds["min"], bounds["max"]], axis=0)
    scale = root["scale"][0]
    moved: NDArray[np.float64] = (places_um - middle) @ MIRROR * UM * scale
    return moved


def volume_of(bundle: Path, channel: str, tile: str) -> tuple[Any, NDArray[np.uint8]]:
    (entry,) = (c for c in load(bundle / "manifest.json")["channels"] if c["id"] == channel)
    volumes = load(bundle / entry["volumes"]["path"])["volumes"]
    (volume,) = (v for v in volumes if v["tile"] == tile)
    return volume, decode_finest((bundle / volume["file"]["path"]).read_bytes())[..., 0]


def texels_of(texture: Any) -> NDArray[np.uint8]:
    x, y, z = texture["size"]
    data = np.frombuffer(base64.b64decode(texture["texels"]), np.uint8)
    return data.reshape(z, y, x, -1)


def check_volumes(found: Any, bundle: Path) -> None:
    """Each voxel is where the specimen has it, from Unity's world by the shader's own numbers."""
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
            # as Unity does it: the object's own space, then the shader's
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
        assert (outwards > 0).all()  # Unity's front: clockwise, left-handed
        assert len(triangles) == 12
        around = [material["_AllLow"][:3], material["_AllHigh"][:3]]
        for _, other in places:
            scale = root["scale"][0] * box["scale"][0]
            inside = (np.array(other["world"]) - box["position"]) / scale
            there = inside @ to_box[:, :3].T + to_box[:, 3]
            assert (there > np.array(around[0]) - 1e-3).all()
            assert (there < np.array(around[1]) + 1e-3).all()


def check_surfaces(found: Any, bundle: Path, matrix: NDArray[np.float64] | None = None) -> int:
    """Each level is where its tile is; return how many there are."""
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
    assert found["saved"] == [
        next(p for p in found["saved"] if p.endswith("Mine/two tiles.prefab"))
    ]
    assert found["bars"] == 0


def test_surface_and_volume_of_a_sphere_are_one(bundle: Path, imported: Import) -> None:
    """The glb by its own places, the volume by the shader's: both about the same centre."""
    found = imported(bundle)
    root = found["root"]
    tile = child(root, "r0_c0")
    (lod0,) = (c for c in child(tile, "surfaces", "CD31")["children"] if c["name"] == "lod0")
    (box,) = child(tile, "volume")["children"]
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


def turned() -> Gf.Matrix4d:
    turn = Gf.Matrix4d().SetRotate(Gf.Rotation((0.3, 1, 0.2), 40))
    return turn * Gf.Matrix4d().SetTranslate((3, -4, 5))


def sheared() -> Gf.Matrix4d:
    return Gf.Matrix4d(1, 0, 0, 0, 0.4, 1, 0, 0, 0, 0.3, 1.5, 0, 2, 3, 4, 1)


def flipped() -> Gf.Matrix4d:
    return Gf.Matrix4d().SetScale((-1, 1, 1)) * Gf.Matrix4d().SetTranslate((40, 0, 0))


@pytest.mark.parametrize("move", [turned, sheared, flipped])
def test_a_tile_that_was_moved_keeps_its_matrix(
    edited: Callable[[Gf.Matrix4d], Path], imported: Import, move: Callable[[], Gf.Matrix4d]
) -> None:
    bundle = edited(move())
    volume, _ = volume_of(bundle, "CD31", "r0_c1")
    assert not np.allclose(volume["matrix"], np.eye(4).ravel())
    check_volumes(imported(bundle), bundle)


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
        # an object of share h of a screen of 1080 pixels: an error e of it is e / size * h * 1080
        *errors, finest = errors
        assert finest == 0
        expected = [2 * size / (1080 * e) for e in reversed(errors)] + [0]
        expected = [min(1, h) for h in expected]
        assert [height for height, _ in group["lods"]] == pytest.approx(expected, rel=0.02)
        assert all(count == 1 for _, count in group["lods"])
        assert [level["name"] for level in group["children"]] == ["lod0", "lod1", "lod2"]


@pytest.mark.parametrize(
    ("errors", "expected"),
    [
        ("0", [0]),
        ("0,1,2", [0.5, 0.25, 0]),
        ("0,1,1,1", [0.5, 0.495, 0.49005, 0]),  # they have to fall
        ("0,0,1", [1, 0.5, 0]),
        ("0,0.001,1", [1, 0.5, 0]),
    ],
)
def test_heights_fall(run: Run, errors: str, expected: list[float]) -> None:
    done = run("heights", errors, 25, 2, 100)
    assert json.loads(done.stdout) == pytest.approx(expected)


def test_tilesets_of_tilesets_are_followed(
    stage: Path, tmp_path: Path, imported: Import, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tiles3d, "MOST_WHOLE_TILES", 1)
    bundle = tmp_path / "many"
    write_bundle(stage, bundle, None, run=Engine(0).run)
    assert (bundle / "channels" / "CD31" / "r0_c0" / "finer.json").exists()
    found = imported(bundle)
    assert check_surfaces(found, bundle) == 6
    lods = [
        level["name"] for level in child(found["root"], "r0_c1", "surfaces", "CD31")["children"]
    ]
    assert lods == ["lod0", "lod1", "lod2"]


def test_transfer_functions_are_rows_of_one_table(bundle: Path, imported: Import) -> None:
    found = imported(bundle)
    channels = load(bundle / "manifest.json")["channels"]
    rows = [decode_finest((bundle / c["lut"]["path"]).read_bytes())[0] for c in channels]
    table = found["table"]
    assert np.array_equal(texels_of(table)[0], np.concatenate(rows))
    assert table["linear"]
    assert table["wrap"] == "Clamp"
    for c, channel in enumerate(channels):
        made = found["channels"][c]
        assert made["name"] == channel["name"]
        assert made["functions"][made["function"]] == channel["transfer_function"]
    for _, box in boxes(found["root"]):
        for place, c in enumerate(box["channels"]):
            made, block = found["channels"][c], box["block"]
            row = made["firstRow"] + made["function"] + 0.5
            assert block["_Rows"][place] == pytest.approx(row / table["size"][1])
            assert block["_Colors"][place][:3] == pytest.approx(channels[c]["color"], abs=1e-6)
            assert block["_Shown"][place] == 1
        assert block["_Shown"][len(box["channels"]) :] == [0] * (4 - len(box["channels"]))
        assert block["_Steps"] == 100
        assert box["keywords"] == []


def test_channels_are_shown_coloured_and_classified_by_name(bundle: Path, imported: Import) -> None:
    calls = [
        {"name": "SetVisible", "args": ["Hoechst 33342", False]},
        {"name": "SetFunction", "args": ["CD31", "sharp"]},
        {"name": "SetColor", "args": ["CD31", [0.5, 1.0, 0.0]]},
        {"name": "endsAtSurfaces", "args": []},
    ]
    found = imported(bundle, calls=calls, camera=True)
    by_id = {c["id"]: i for i, c in enumerate(found["channels"])}
    red = by_id["CD31"]
    for _, box in boxes(found["root"]):
        place = box["channels"].index(red)
        row = (
            found["channels"][red]["functions"].index("sharp") + found["channels"][red]["firstRow"]
        )
        assert box["block"]["_Rows"][place] == pytest.approx(
            (row + 0.5) / found["table"]["size"][1]
        )
        assert box["block"]["_Colors"][place] == pytest.approx([0.21404114, 1, 0, 1])
        assert box["block"]["_Shown"][1 - place] == 0
        assert box["enabled"]
        assert box["keywords"] == ["STEREOCELL_SCENE_DEPTH"]
        assert (box["material"]["_ZTest"], box["material"]["_SceneDepth"]) == (8, 1)
    assert found["depth"] == "Depth"
    for tile in found["root"]["children"]:
        for level in child(tile, "surfaces", "CD31")["children"]:
            assert level["block"]["baseColorFactor"] == pytest.approx([0.5, 1, 0, 1], abs=1e-5)
            assert level["enabled"]


def test_hidden_channels_hide_their_surfaces_and_empty_boxes(
    bundle: Path, imported: Import
) -> None:
    names = [c["name"] for c in load(bundle / "manifest.json")["channels"]]
    calls = [{"name": "SetVisible", "args": [name, False]} for name in names]
    found = imported(bundle, calls=calls)
    assert not any(box["enabled"] for _, box in boxes(found["root"]))
    for tile in found["root"]["children"]:
        for level in child(tile, "surfaces", "CD31")["children"]:
            assert not level["enabled"]
            assert "block" not in level  # its material as it was imported


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"name": "SetVisible", "args": ["CD8", True]}, "the specimen has no channel CD8"),
        ({"name": "SetFunction", "args": ["CD31", "x"]}, "CD31 has no transfer function x"),
    ],
)
def test_an_unknown_name_is_named(bundle: Path, imported: Import, call: Any, message: str) -> None:
    assert imported(bundle, calls=[call]) == message


def test_large_volumes_are_read_at_a_coarser_level(bundle: Path, imported: Import) -> None:
    fine, coarse = imported(bundle), imported(bundle, mostTexels=12)
    for (tile, box), (_, whole) in zip(boxes(coarse["root"]), boxes(fine["root"]), strict=True):
        volume, _ = volume_of(bundle, "CD31", tile)
        sizes = [level["size"] for level in volume["levels"]]
        level = next(k for k, size in enumerate(sizes) if max(size) <= 12)
        assert level > 0
        assert box["material"]["_Volume"]["size"] == sizes[level]
        assert box["material"]["_MinStep"] == pytest.approx(2**level * whole["material"]["_Voxel"])
        same = ("_Size", "_TexLow", "_TexHigh", "_Voxel")
        assert all(box["material"][name] == whole["material"][name] for name in same)


def test_more_than_four_channels_are_marched_apart(
    bundle: Path, imported: Import, tmp_path: Path
) -> None:
    shutil.copytree(bundle, tmp_path / "five")
    manifest = load(bundle / "manifest.json")
    channels = manifest["channels"]
    manifest["channels"] = [
        {**channels[i % 2], "id": f"c{i}", "name": f"channel {i}"} for i in range(5)
    ]
    (tmp_path / "five" / "manifest.json").write_text(json.dumps(manifest))
    found = imported(tmp_path / "five")
    for tile in found["root"]["children"]:
        made = child(tile, "volume")["children"]
        assert [box["channels"] for box in made] == [[0, 1, 2, 3], [4]]
        assert [box["material"]["_Volume"]["format"] for box in made] == ["RGBA32", "R8"]
        assert made[0]["name"] == "c0 + c1 + c2 + c3"
        assert [box["enabled"] for box in made] == [True, False]  # four show at first
    paths = [Path(path).name for path in found["assets"] if "/volumes/" in path]
    assert paths == ["r0_c0.asset", "r0_c0_1.asset", "r0_c1.asset", "r0_c1_1.asset"]
    assert [c["isVisible"] for c in found["channels"]] == [True] * 4 + [False]

    manifest["channels"][2]["objects"] = {"path": "x", "bytes": 0, "sha256": "0" * 64}
    (tmp_path / "five" / "manifest.json").write_text(json.dumps(manifest))
    found = imported(tmp_path / "five")
    assert [c["isVisible"] for c in found["channels"]] == [False, False, True, False, False]


def test_a_bad_bundle_is_told_in_a_line_and_leaves_no_prefab(
    run: Run, bundle: Path, tmp_path: Path
) -> None:
    def refuse(name: str, spoil: Callable[[Path], None], *expected: str, **how: Any) -> None:
        copy = tmp_path / name
        shutil.copytree(bundle, copy)
        spoil(copy)
        done = run("import", copy, tmp_path / "Assets", json.dumps(how))
        assert done.returncode == 1
        line = done.stderr.decode().strip()
        assert "\n" not in line
        assert all(part in line for part in expected), line
        assert not done.stdout

    def change(path: str, **values: Any) -> Callable[[Path], None]:
        def write(folder: Path) -> None:
            content = {**load(folder / path), **values}
            (folder / path).write_text(json.dumps(content))

        return write

    def rename(what: str) -> Callable[[Path], None]:
        def write(folder: Path) -> None:
            manifest = load(folder / "manifest.json")
            manifest[what][0]["id"] = "../../x"
            (folder / "manifest.json").write_text(json.dumps(manifest))

        return write

    def lead_out(folder: Path) -> None:
        manifest = load(folder / "manifest.json")
        manifest["files"]["path"] = "../files.json"
        (folder / "manifest.json").write_text(json.dumps(manifest))

    def flip(path: str) -> Callable[[Path], None]:
        def write(folder: Path) -> None:
            data = bytearray((folder / path).read_bytes())
            data[-1] ^= 1
            (folder / path).write_bytes(data)

        return write

    volume, _ = volume_of(bundle, "CD31", "r0_c1")
    place = volume["file"]["path"]
    glb = "channels/CD31/r0_c0/lod1.glb"
    refuse("flipped", flip(place), place, "SHA-256")
    refuse("glb", flip(glb), glb, "SHA-256")
    refuse("gone", lambda folder: (folder / place).unlink(), place, "missing")
    refuse("cut", lambda folder: (folder / place).write_bytes(b"\xabKTX"), place, "bytes, found 4")
    refuse("newer", change("manifest.json", version=2), "expected version 1, found 2")
    refuse("other", change("manifest.json", format="x"), "no StereoCell bundle")
    refuse("json", lambda f: (f / "manifest.json").write_text("{"), "manifest.json")
    refuse("bare", change("manifest.json", tiles=None, specimen={}), "specimen.name")
    refuse("outside", lead_out, "../files.json", "leads out")
    refuse("tile", rename("tiles"), "../../x", "identifier")
    refuse("channel", rename("channels"), "../../x", "identifier")
    refuse("empty", lambda f: (f / "manifest.json").unlink(), "manifest.json", "missing")
    refuse("no glTFast", lambda f: None, "was not imported", "glTFast", gltf=False)


def test_volumes_are_blended_from_the_farthest_along_every_ray(run: Run) -> None:
    """A grid of boxes of different sizes, seen from outside and from inside."""
    edges = ([0, 4, 10, 13], [-7, -2, 0], [0, 3, 5])
    x, y, z = ([*pairwise(along)] for along in edges)
    grid = [[[a[0], b[0], c[0]], [a[1], b[1], c[1]]] for a in x for b in y for c in z]
    rng = np.random.default_rng(2)
    eyes = rng.uniform([-12, -18, -10], [28, 12, 20], (150, 3))
    orders = json.loads(run("sort", json.dumps(grid), json.dumps(eyes.tolist())).stdout)
    low, high = np.array(grid).transpose(1, 0, 2)
    crossed = 0
    for eye, order in zip(eyes, orders, strict=True):
        assert sorted(order) == list(range(1 - len(grid), 1))
        for target in rng.uniform([0, -7, 0], [13, 0, 5], (10, 3)):
            a, b = (low - eye) / (target - eye), (high - eye) / (target - eye)
            near, far = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
            hit = np.flatnonzero(far > np.maximum(near, 0) + 1e-6)
            along = hit[np.argsort(near[hit])]
            crossed += len(along)
            assert (np.diff(np.array(order)[along]) < 0).all()  # the nearer, the later
    assert crossed > 3000


@pytest.mark.parametrize("x", [-1.0, 1.0])
def test_the_farther_tile_is_blended_first(bundle: Path, imported: Import, x: float) -> None:
    found = imported(bundle, calls=[{"name": "SortFrom", "args": [x, 0, 0.1]}])
    order = {tile: box["order"] for tile, box in boxes(found["root"])}
    # the first tile is at greater x: the world is mirrored
    near, far = ("r0_c0", "r0_c1") if x > 0 else ("r0_c1", "r0_c0")
    assert (order[near], order[far]) == (0, -1)


def test_the_inspector_names_channels_and_functions(run: Run) -> None:
    found = json.loads(run("drawer").stdout)
    assert found["drawn"] == ["0+40 CD31", "40+20", "60+40 default, sharp 0"]
    assert (found["visible"], found["function"]) == (False, 1)  # as it was clicked


def gaze(run: Run, *frames: tuple[str | None, float, int]) -> list[tuple[float, list[str]]]:
    each = [[target, dt] for target, dt, count in frames for _ in range(count)]
    done = run("gaze", json.dumps(each))
    assert done.returncode == 0, done.stderr.decode()
    return [(progress, shown) for progress, shown in json.loads(done.stdout)]


def test_a_gaze_of_one_and_a_half_seconds_switches_a_tile_and_once(run: Run) -> None:
    dt = 1 / 64  # exact in binary: 1.5 s are 96 frames, after the one that starts the clock
    found = gaze(run, ("a", dt, 200), ("b", dt, 96), ("a", dt, 97), (None, dt, 5), ("b", 60.0, 3))
    shown = [names for _, names in found]
    assert shown[95] == []
    assert shown[96] == ["a"]
    assert shown[199] == ["a"]  # once, however long it lasts
    assert found[0][0] == 0
    assert found[48][0] == 0.5
    assert found[96][0] == 0
    assert shown[295] == ["a"]  # b was left a frame too early
    assert shown[391] == ["a"]
    assert shown[392] == []  # back to surfaces
    assert shown[-1] == []  # a stall of the program is no gaze
