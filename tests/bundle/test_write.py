"""The bundle of a stage: its files, their formats, and stages that can't be bundled."""

import hashlib
import json
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
import zstandard
from jsonschema import Draft202012Validator
from pxr import Sdf
from scipy.spatial import cKDTree

from stereocell.engine.run import Engine
from stereocell.formats.gltf import AMBIENT_SHARE
from stereocell.formats.tiles3d import content_hash
from stereocell.model.errors import OutputError, StageError, StereoCellError
from stereocell.model.mesh import Baked
from stereocell.storage.assets import schema_path
from stereocell.usd.written_files import write_list
from support import spheres
from support.bundles import TILES, channel, files, load, volumes, write, write_bundle, write_tiles
from support.glbs import decoded_colors, decoded_positions_m, read


def schema(name):
    return Draft202012Validator(json.loads(schema_path(name).read_text("utf-8")))


def test_manifest_and_volume_lists_fit_their_schemas(bundle):
    manifest = load(bundle / "manifest.json")
    schema("bundle.schema.json").validate(manifest)
    for entry in manifest["channels"]:
        schema("volumes.schema.json").validate(load(bundle / entry["volumes"]["path"]))


def test_manifest_describes_the_content_of_the_stage(bundle):
    manifest = load(bundle / "manifest.json")
    assert manifest["specimen"]["name"] == "two tiles"
    assert manifest["specimen"]["bounds_um"] == {"min": [0, -9.5, 0], "max": [19.5, 0, 8]}
    assert [tile["id"] for tile in manifest["tiles"]] == ["r0_c0", "r0_c1"]
    assert manifest["tiles"][1]["bounds_um"] == {"min": [10, -9.5, 0], "max": [19.5, 0, 8]}
    red, blue = manifest["channels"]
    assert (red["id"], red["color"], red["window"]) == ("CD31", [1.0, 0.2, 0.1], [100, 4000])
    assert red["iso_value"] == 1200
    assert red["iso_normalized"] == pytest.approx(1100 / 3900)
    assert red["transfer_functions"] == ["default", "sharp"]
    assert red["triangles"] == [
        sum(len(t.channels[0].lods[k].mesh.triangles) for t in TILES) for k in range(3)
    ]
    assert (blue["id"], blue["name"]) == ("Hoechst_x20_33342", "Hoechst 33342")
    assert (blue["tileset"], blue["triangles"], blue["iso_value"]) == (None, [], None)


def test_every_file_is_listed_with_its_hash(bundle):
    listed = load(bundle / "files.json")
    found = {path.as_posix(): content for path, content in files(bundle).items()}
    assert listed.keys() == found.keys() - {"manifest.json", "files.json"}
    for path, entry in listed.items():
        assert entry["bytes"] == len(found[path])
        assert entry["sha256"] == hashlib.sha256(found[path]).hexdigest()


def test_volumes_hold_the_voxels_of_the_unit(bundle):
    for tile, entry in zip(TILES, volumes(bundle), strict=True):
        voxels = tile.channels[0].volume
        assert entry["tile"] == tile.id
        assert entry["size"] == list(voxels.shape[::-1])
        assert entry["matrix"] == np.eye(4).ravel().tolist()
        data = (bundle / entry["file"]["path"]).read_bytes()
        level = entry["levels"][0]
        frame = data[level["offset"] : level["offset"] + level["length"]]
        assert zstandard.decompress(frame) == voxels.tobytes()
        assert [x["size"] for x in entry["levels"][:2]] == [
            entry["size"],
            [n // 2 for n in entry["size"]],
        ]


def test_every_level_has_the_hash_of_its_own_bytes(bundle):
    for entry in volumes(bundle):
        data = (bundle / entry["file"]["path"]).read_bytes()
        assert len(entry["levels"]) > 1
        for level in entry["levels"]:
            part = data[level["offset"] : level["offset"] + level["length"]]
            assert level["sha256"] == hashlib.sha256(part).hexdigest()


def test_tileset_has_the_hash_of_every_surface(bundle):
    listed = load(bundle / "files.json")
    tileset = load(bundle / "channels/CD31/tileset.json")
    found = {}
    waiting = [tileset["root"]]
    while waiting:
        tile = waiting.pop()
        waiting += tile.get("children", [])
        if "content" in tile:
            path = f"channels/CD31/{tile['content']['uri']}"
            found[path] = tile["content"]["extras"]["sha-256-128"]
    glbs = {path: entry for path, entry in listed.items() if path.endswith(".glb")}
    assert found == {path: content_hash(entry["sha256"]) for path, entry in glbs.items()}
    assert len(found) == 6


def test_errors_are_the_largest_distances_and_all_levels_share_a_lattice(bundle):
    tile = load(bundle / "channels/CD31/tileset.json")["root"]["children"][0]
    steps = {
        read(glb.read_bytes())[0]["nodes"][0]["scale"][0]
        for glb in (bundle / "channels/CD31/r0_c0").glob("*.glb")
    }
    assert len(steps) == 1
    (_, middle), (_, coarsest) = spheres.LEVELS[1:]
    assert tile["geometricError"] == pytest.approx(coarsest * 1e-6, rel=1e-3)
    assert tile["children"][0]["geometricError"] == pytest.approx(middle * 1e-6, rel=1e-3)


def test_manifest_states_how_far_levels_are_from_the_surface(bundle):
    stated = channel(bundle)["distances"]
    assert [level["p99_um"] for level in stated] == pytest.approx([um for _, um in spheres.LEVELS])
    assert all(level["largest_um"] >= level["p99_um"] for level in stated)
    assert len(stated) == len(channel(bundle)["triangles"])


def test_lut_rows_are_the_transfer_functions(bundle):
    data = (bundle / channel(bundle)["lut"]["path"]).read_bytes()
    offset, length, _ = np.frombuffer(data, "<u8", 3, 80)
    table = np.frombuffer(zstandard.decompress(data[offset : offset + length]), np.uint8)
    table = table.reshape(2, 256, 4)
    assert (table[..., :3] == 255).all()
    assert table[0, :, 3].tolist() == np.rint(np.linspace(0, 0.8, 256) * 255).tolist()
    assert table[1, [0, 76, 80, 255], 3].tolist() == [0, 0, 255, 255]


def test_meshes_lie_where_the_stage_has_them_and_meet_without_a_crack(bundle):
    edges = []
    for tile, last in (("r0_c0", np.max), ("r0_c1", np.min)):
        for level in range(3):
            data = (bundle / f"channels/CD31/{tile}/lod{level}.glb").read_bytes()
            points = decoded_positions_m(data)
            away = np.linalg.norm(points * 1e6 - spheres.CENTER, axis=1)
            assert np.abs(away - spheres.RADIUS).max() < 0.003
            edge = points[points[:, 0] == last(points[:, 0])]
            assert len(edge) > 10
            edges.append(np.unique(edge, axis=0).tobytes())
    assert edges[:3] == edges[3:]


def test_coarse_lod_has_the_baked_normal_map_and_the_coarsest_has_no_maps(bundle):
    document, _ = read((bundle / "channels/CD31/r0_c0/lod1.glb").read_bytes())
    primitive = document["meshes"][0]["primitives"][0]
    assert {"TEXCOORD_0", "TANGENT"} <= primitive["attributes"].keys()
    assert document["materials"][0]["normalTexture"] == {"index": 0}
    for level in (0, 2):
        bare, _ = read((bundle / f"channels/CD31/r0_c0/lod{level}.glb").read_bytes())
        assert "images" not in bare
        assert "TEXCOORD_0" not in bare["meshes"][0]["primitives"][0]["attributes"]


def test_coarsest_keeps_the_occlusion_of_its_map_at_its_vertices(tmp_path):
    """Otherwise distant tiles would become brighter, because finer levels are dark there."""
    tile = spheres.tile(0)
    (red, *others) = tile.channels
    left_is_hidden = np.full((32, 32), 255, np.uint8)
    left_is_hidden[:, :16] = 51
    baked = Baked(left_is_hidden, texel_um=0.5, charts=1)
    lods = (*red.lods[:-1], replace(red.lods[-1], baked=baked))
    tile = replace(tile, channels=(replace(red, lods=lods), *others))
    write(write_tiles(tmp_path / "s", [tile]), tmp_path / "b")

    data = (tmp_path / "b/channels/CD31/r0_c0/lod2.glb").read_bytes()
    document, _ = read(data)
    assert "images" not in document
    mesh = lods[-1].mesh
    places, where = np.unique(mesh.positions, axis=0, return_inverse=True)
    # At the map's ends and at the poles, vertices at one place have different texels.
    openness = np.bincount(where.ravel(), np.where(mesh.uvs[:, 0] < 0.5, 0.2, 1.0))
    openness /= np.bincount(where.ravel())
    _, nearest = cKDTree(places).query(decoded_positions_m(data) * 1e6)
    expected = 255 * (1 - AMBIENT_SHARE * (1 - openness[nearest]))
    assert np.abs(decoded_colors(data)[:, 0] - expected).max() <= 1
    assert np.ptp(expected) > 50


@pytest.mark.exhaustive  # whole builds are compared by every run: tests/system/test_build.py
def test_bundles_are_equal_for_any_number_of_workers(stage, bundle, tmp_path):
    with closing(Engine(2)) as engine:
        write_bundle(stage, tmp_path / "again", None, engine=engine)
    assert files(tmp_path / "again") == files(bundle)


def test_truncated_volume_is_an_error_of_one_line(tmp_path, capfd):
    stage = write_tiles(tmp_path / "stage")
    atlas = tmp_path / "stage/tiles/r0_c1/CD31.exr"
    atlas.write_bytes(atlas.read_bytes()[:-50])
    with pytest.raises(
        StereoCellError, match=r"CD31\.exr: can't be read as OpenEXR: the file ends at byte"
    ):
        write(stage, tmp_path / "bundle")
    for line in capfd.readouterr().err.splitlines():  # OpenEXR may print lines of its own
        assert line.startswith("bundle: ")


@pytest.mark.parametrize(
    ("lost", "words"),
    [
        (
            "tiles/r0_c1/CD31_lod2_normal.png",
            r"CD31_r0_c1_look/normal_map\.inputs:file: found no file",
        ),
        (
            "tiles/r0_c1/CD31.exr",
            r"CD31_r0_c1_volume\.stereocell:atlas: found no file at './CD31.exr'",
        ),
        ("tiles/r0_c1/tile.usdc", r"tile\.usdc@ for payload .*/Specimen/Tiles/r0_c1"),
        ("looks/channels.usda", r"looks/channels\.usda"),
        ("stage.usda", r"stage\.usda: can't be opened, expected a USD layer \(\.usda, "),
    ],
)
def test_missing_file_is_named_with_its_prim(tmp_path, capfd, lost, words):
    stage = write_tiles(tmp_path / "stage")
    (tmp_path / "stage" / lost).unlink()
    with pytest.raises(StereoCellError, match=words) as caught:
        write(stage, tmp_path / "bundle")
    assert "\n" not in str(caught.value)
    for line in capfd.readouterr().err.splitlines():  # USD may print warnings of its own
        assert line.startswith("bundle: ")
    assert [p.name for p in tmp_path.iterdir()] == ["stage"]


def test_old_bundle_is_replaced_as_a_whole_and_kept_if_the_new_one_fails(stage, bundle, tmp_path):
    place = tmp_path / "bundle"
    write(stage, place)
    (place / "left over").write_text("from an older build")
    with pytest.raises(StageError):
        write(tmp_path / "none.usda", place)
    assert (place / "left over").exists()
    write(stage, place)
    assert files(place) == files(bundle)
    assert [p.name for p in tmp_path.iterdir()] == ["bundle"]


def test_folder_that_is_not_a_bundle_is_not_changed(stage, tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(OutputError, match=r": found something else \(thesis\.tex\), but no m"):
        write(stage, tmp_path)
    assert (tmp_path / "thesis.tex").exists()


def test_viewer_is_copied_and_listed(stage, tmp_path):
    (tmp_path / "dist" / "assets").mkdir(parents=True)
    (tmp_path / "dist" / "index.html").write_text("<!doctype html>")
    (tmp_path / "dist" / "assets" / "main.js").write_text("start()")
    write_bundle(stage, tmp_path / "bundle", tmp_path / "dist", engine=Engine(0))
    assert (tmp_path / "bundle" / "assets" / "main.js").read_text("utf-8") == "start()"
    assert {"index.html", "assets/main.js"} <= load(tmp_path / "bundle" / "files.json").keys()


def test_bundle_has_no_page_of_the_inbox(stage, tmp_path):
    for folder in ("assets", "inbox_assets"):
        (tmp_path / "dist" / folder).mkdir(parents=True)
        (tmp_path / "dist" / folder / "main.js").write_text("start()")
    for name in ("index.html", "inbox.html", "inbox.html.gz"):
        (tmp_path / "dist" / name).write_text("<!doctype html>")
    write_bundle(stage, tmp_path / "bundle", tmp_path / "dist", engine=Engine(0))
    listed = load(tmp_path / "bundle" / "files.json").keys()
    copied = [p.relative_to(tmp_path / "bundle").as_posix() for p in tmp_path.rglob("bundle/**/*")]
    assert "assets/main.js" in listed
    assert not [name for name in (*listed, *copied) if name.startswith("inbox")]


def test_missing_build_of_the_viewer_is_named(stage, tmp_path):
    with pytest.raises(OutputError, match=r"dist: found no index\.html, expected the built viewer"):
        write_bundle(stage, tmp_path / "bundle", tmp_path / "dist", engine=Engine(0))


def test_viewer_may_not_replace_files_of_the_bundle(stage, tmp_path):
    (tmp_path / "dist").mkdir()
    for name in ("index.html", "manifest.json"):
        (tmp_path / "dist" / name).write_text("")
    with pytest.raises(
        OutputError, match=r"found the name of a file of the bundle, manifest\.json"
    ):
        write_bundle(stage, tmp_path / "bundle", tmp_path / "dist", engine=Engine(0))
    assert not (tmp_path / "bundle").exists()


@pytest.mark.parametrize("escape", ["id", "path"])
def test_finished_part_that_names_files_elsewhere_is_made_again(stage, bundle, tmp_path, escape):
    parts = tmp_path / "parts"
    write_bundle(stage, tmp_path / "first", None, engine=Engine(0), parts=parts)
    (tmp_path / "secret.txt").write_text("private")
    for record in sorted(parts.glob("*/*/tile.json")):
        content = load(record)
        if escape == "id":
            content["id"] = f"../parts/{content['id']}"
        else:
            for channel in content["channels"]:
                for file in channel["files"]:
                    file |= {"path": "../../../secret.txt", "bytes": 7}
        record.write_text(json.dumps(content))
    write_bundle(stage, tmp_path / "again", None, engine=Engine(0), parts=parts)
    assert files(tmp_path / "again") == files(bundle)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"first", "again", "parts", "secret.txt"}
    assert (tmp_path / "secret.txt").read_text("utf-8") == "private"


def test_resumed_bundle_names_edited_layers_of_finished_tiles(tmp_path):
    stage, parts = write_tiles(tmp_path / "stage"), tmp_path / "parts"
    write_list(stage.parent, {}, stage.parent)
    edited = stage.parent / "tiles" / "r0_c0" / "tile.usdc"
    layer = Sdf.Layer.FindOrOpen(str(edited))
    layer.documentation = "a long note " * 200
    layer.Save()
    lines = []
    for name in ("first", "again"):  # the second bundle uses the finished parts of the first
        lines.append([])
        write_bundle(
            stage,
            tmp_path / name,
            None,
            engine=Engine(0),
            parts=parts,
            report_line=lines[-1].append,
        )
    assert [line for line in lines[0] if line.startswith(f"{edited}: changed since")]
    assert lines[1] == lines[0]
    assert files(tmp_path / "again") == files(tmp_path / "first")
