import hashlib
import json

import numpy as np
import pytest
import zstandard
from jsonschema import Draft202012Validator
from pxr import Gf, Sdf, Usd, UsdGeom

import spheres
from glbs import decoded_positions_m, read
from stereocell.assets import schema_path
from stereocell.engine import Engine
from stereocell.errors import OutputError, StageError, StereoCellError
from stereocell.write.bundle import write_bundle
from stereocell.write.usd import TileExtent, write_stage, write_tile

TILES = (spheres.tile(0), spheres.tile(1))
CD31 = "/Specimen/Channels/CD31"


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    """The two tiles' stage, to be read only."""
    return write_tiles(tmp_path_factory.mktemp("stage"))


@pytest.fixture(scope="module")
def bundle(stage, tmp_path_factory):
    """Its bundle, to be read only."""
    out = tmp_path_factory.mktemp("bundle") / "bundle"
    write_bundle(stage, out, None, Engine(0))
    return out


def write_tiles(folder):
    for tile in TILES:
        write_tile(folder, tile)
    write_stage(
        folder, "two tiles", (spheres.RED, spheres.BLUE), [TileExtent.of(t) for t in TILES], {}
    )
    return folder / "stage.usda"


@pytest.fixture
def edit(stage, tmp_path):
    """Write a layer over the stage and return its bundle: `edit(lambda stage: ...)`."""

    def export(change):
        path = tmp_path / "edited.usda"
        layer = Sdf.Layer.CreateNew(str(path))
        layer.subLayerPaths = [str(stage)]
        over = Usd.Stage.Open(layer)
        change(over)
        layer.Save()
        del over
        write_bundle(path, tmp_path / "bundle", None, Engine(0))
        return tmp_path / "bundle"

    return export


def load(path):
    return json.loads(path.read_text())


def channel(bundle, name="CD31"):
    (found,) = (c for c in load(bundle / "manifest.json")["channels"] if c["name"] == name)
    return found


def volumes(bundle):
    return load(bundle / channel(bundle)["volumes"]["path"])["volumes"]


def factor(bundle, tile="r0_c0"):
    document, _ = read((bundle / f"channels/CD31/{tile}/lod0.glb").read_bytes())
    return document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"]


def files(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def schema(name):
    return Draft202012Validator(json.loads(schema_path(name).read_text()))


def test_manifest_and_volume_lists_fit_their_schemas(bundle):
    manifest = load(bundle / "manifest.json")
    schema("bundle.schema.json").validate(manifest)
    for entry in manifest["channels"]:
        schema("volumes.schema.json").validate(load(bundle / entry["volumes"]["path"]))


def test_manifest_says_what_the_stage_holds(bundle):
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
    for tile in ("r0_c0", "r0_c1"):
        for level in range(3):
            data = (bundle / f"channels/CD31/{tile}/lod{level}.glb").read_bytes()
            points = decoded_positions_m(data)
            away = np.linalg.norm(points * 1e6 - spheres.CENTER, axis=1)
            assert np.abs(away - spheres.RADIUS).max() < 0.003
            edge = points[np.abs(points[:, 0] - 10e-6) < 1e-9]
            edges.append(np.unique(edge, axis=0).tobytes())
    assert edges[:3] == edges[3:]
    assert all(edges)


def test_coarsest_lod_has_the_baked_normal_map(bundle):
    document, _ = read((bundle / "channels/CD31/r0_c0/lod2.glb").read_bytes())
    primitive = document["meshes"][0]["primitives"][0]
    assert {"TEXCOORD_0", "TANGENT"} <= primitive["attributes"].keys()
    assert document["materials"][0]["normalTexture"] == {"index": 0}
    finest, _ = read((bundle / "channels/CD31/r0_c0/lod0.glb").read_bytes())
    assert "images" not in finest


def test_two_exports_are_equal_whatever_the_workers(stage, bundle, tmp_path):
    write_bundle(stage, tmp_path / "again", None, Engine(2))
    assert files(tmp_path / "again") == files(bundle)


def test_color_edited_over_the_stage_reaches_manifest_and_meshes(bundle, edit):
    edited = edit(
        lambda s: s.GetAttributeAtPath(f"{CD31}.inputs:color").Set(Gf.Vec3f(0.25, 0.5, 0.75))
    )
    assert channel(edited)["color"] == [0.25, 0.5, 0.75]
    assert factor(edited) == factor(edited, "r0_c1") == [0.25, 0.5, 0.75, 1]
    blue = "Hoechst 33342"
    assert channel(edited, blue) == channel(bundle, blue)


def texels(data):
    """Return level 0 of a texture as one row of bytes."""
    offset, length, _ = np.frombuffer(data, "<u8", 3, 80)
    return np.frombuffer(zstandard.decompress(data[offset : offset + length]), np.uint8)


def test_window_edited_over_the_stage_reaches_manifest_voxels_and_bricks(bundle, edit):
    low, high = 490.0, 2050.0  # as source values: an eighth and a half of the old window
    edited = edit(
        lambda s: s.GetAttributeAtPath(f"{CD31}.stereocell:window").Set(Gf.Vec2f(low, high))
    )
    entry = channel(edited)
    assert entry["window"] == [low, high]
    assert entry["iso_value"] == 1200  # the surface stays where it was
    assert entry["iso_normalized"] == pytest.approx((1200 - low) / (high - low))
    for key in ("file", "bricks"):
        old, new = (
            texels((folder / volumes(folder)[0][key]["path"]).read_bytes()).astype(float)
            for folder in (bundle, edited)
        )
        values = 100 + old / 255 * 3900  # what the voxels were in the source
        assert np.abs(new - np.clip((values - low) / (high - low), 0, 1) * 255).max() <= 0.5001
        assert new.max() == 255
    blue = "Hoechst 33342"
    assert channel(edited, blue) == channel(bundle, blue)


def test_window_edit_survives_flattening(edit, tmp_path):
    def change(stage):
        stage.GetAttributeAtPath(f"{CD31}.stereocell:window").Set(Gf.Vec2f(490, 2050))
        for tile in stage.GetPrimAtPath("/Specimen/Tiles").GetChildren():
            tile.GetVariantSet("representation").SetVariantSelection("both")

    edited = edit(change)
    flat = tmp_path / "flat.usda"
    Usd.Stage.Open(str(tmp_path / "edited.usda")).Export(str(flat))
    write_bundle(flat, tmp_path / "flat", None, Engine(0))
    for folder in (edited, tmp_path / "flat"):
        assert channel(folder)["window"] == [490, 2050]
    paths = [folder / volumes(folder)[0]["file"]["path"] for folder in (edited, tmp_path / "flat")]
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_name_edited_over_the_stage_reaches_the_manifest(edit):
    edited = edit(lambda s: s.OverridePrim(CD31).SetDisplayName("vessels"))
    assert channel(edited, "vessels")["id"] == "CD31"


def test_points_edited_outside_the_variants_are_named_with_the_remedy(edit):
    def change(stage):
        points = stage.GetAttributeAtPath("/Specimen/Tiles/r0_c0/CD31/CD31_r0_c0.points")
        points.Set([point + Gf.Vec3f(0, 0, 1) for point in points.Get()])

    words = r"CD31_r0_c0: .* at lod0: edit inside the variant lod=lod0, or override points, "
    with pytest.raises(StereoCellError, match=words):
        edit(change)


def test_cut_volume_is_one_line(tmp_path, capfd):
    stage = write_tiles(tmp_path / "stage")
    atlas = tmp_path / "stage/tiles/r0_c1/CD31.exr"
    atlas.write_bytes(atlas.read_bytes()[:-50])
    with pytest.raises(
        StereoCellError, match=r"CD31\.exr: can't be read as OpenEXR: it ends at byte"
    ):
        write_bundle(stage, tmp_path / "bundle", None, Engine(0))
    for line in capfd.readouterr().err.splitlines():  # OpenEXR's own words would come on top
        assert line.startswith("bundle ")


def test_color_of_one_tile_stays_in_that_tile(edit):
    look = "/Specimen/Tiles/r0_c1/CD31/CD31_r0_c1_look"
    edited = edit(
        lambda s: (
            s.OverridePrim(look)
            .CreateAttribute("inputs:color", Sdf.ValueTypeNames.Color3f)
            .Set(Gf.Vec3f(0, 1, 0))
        )
    )
    assert channel(edited)["color"] == [1.0, 0.2, 0.1]
    assert factor(edited) == [1.0, 0.2, 0.1, 1]
    assert factor(edited, "r0_c1") == [0, 1, 0, 1]


def test_moved_tile_moves_its_boxes_meshes_and_volumes(bundle, edit):
    edited = edit(
        lambda s: UsdGeom.XformCommonAPI(s.GetPrimAtPath("/Specimen/Tiles/r0_c1")).SetTranslate(
            (100, 20, 3)
        )
    )
    manifest = load(edited / "manifest.json")
    assert manifest["tiles"][1]["bounds_um"] == {"min": [110, 10.5, 3], "max": [119.5, 20, 11]}
    assert manifest["specimen"]["bounds_um"] == {"min": [0, -9.5, 0], "max": [119.5, 20, 11]}
    still, moved = volumes(edited)
    assert still["matrix"] == np.eye(4).ravel().tolist()
    assert moved["matrix"][12:] == [100, 20, 3, 1]  # column-major: the last column
    assert moved["bounds_um"] == volumes(bundle)[1]["bounds_um"]

    box, old = (
        load(folder / "channels/CD31/tileset.json")["root"]["children"][1]["boundingVolume"]["box"]
        for folder in (edited, bundle)
    )
    shift = [(a - b) * 1e6 for a, b in zip(box[:3], old[:3], strict=True)]
    assert shift == pytest.approx([100, -3, 20], abs=0.02)  # z up: (x, -z, y)
    assert box[3:] == pytest.approx(old[3:], abs=2e-8)
    points = decoded_positions_m((edited / "channels/CD31/r0_c1/lod0.glb").read_bytes()) * 1e6
    away = np.linalg.norm(points - (100, 20, 3) - spheres.CENTER, axis=1)
    assert np.abs(away - spheres.RADIUS).max() < 0.01


def test_transfer_function_chosen_and_edited_over_the_stage_is_taken(edit):
    def change(stage):
        variants = stage.GetPrimAtPath(CD31).GetVariantSet("transferFunction")
        variants.SetVariantSelection("sharp")
        points = stage.GetAttributeAtPath(f"{CD31}.stereocell:opacityPoints")
        with variants.GetVariantEditContext():
            points.Set([(0, 1), (1, 1)])

    edited = edit(change)
    assert channel(edited)["transfer_function"] == "sharp"
    data = (edited / channel(edited)["lut"]["path"]).read_bytes()
    offset, length, _ = np.frombuffer(data, "<u8", 3, 80)
    table = np.frombuffer(zstandard.decompress(data[offset : offset + length]), np.uint8)
    assert (table.reshape(2, 256, 4)[1, :, 3] == 255).all()
    assert table.reshape(2, 256, 4)[0, 0, 3] == 0


def test_hidden_tiles_and_meshes_are_left_out(edit):
    def change(stage):
        stage.GetPrimAtPath("/Specimen/Tiles/r0_c1").SetActive(False)
        UsdGeom.Imageable(stage.GetPrimAtPath("/Specimen/Tiles/r0_c0/CD31")).MakeInvisible()

    edited = edit(change)
    assert [tile["id"] for tile in load(edited / "manifest.json")["tiles"]] == ["r0_c0"]
    assert channel(edited)["tileset"] is None
    assert volumes(edited) == []


def test_edited_points_are_taken(edit):
    def change(stage):
        tile = stage.GetPrimAtPath("/Specimen/Tiles/r0_c0")
        for level in range(3):
            variants = tile.GetVariantSet("lod")
            variants.SetVariantSelection(f"lod{level}")
            with variants.GetVariantEditContext():
                points = stage.GetAttributeAtPath(f"{tile.GetPath()}/CD31/CD31_r0_c0.points")
                points.Set([point + Gf.Vec3f(0, 0, 1) for point in points.Get()])

    points = decoded_positions_m((edit(change) / "channels/CD31/r0_c0/lod1.glb").read_bytes())
    away = np.linalg.norm(points * 1e6 - (0, 0, 1) - spheres.CENTER, axis=1)
    assert np.abs(away - spheres.RADIUS).max() < 0.003


@pytest.mark.parametrize(
    ("lost", "words"),
    [
        ("tiles/r0_c1/CD31_lod2_normal.png", r"CD31_r0_c1_look/normal_map\.inputs:file: no file"),
        ("tiles/r0_c1/CD31.exr", r"CD31_r0_c1_volume\.stereocell:atlas: no file at './CD31.exr'"),
        ("tiles/r0_c1/tile.usdc", r"tile\.usdc@ for payload .*/Specimen/Tiles/r0_c1"),
        ("looks/channels.usda", r"looks/channels\.usda"),
        ("stage.usda", r"stage\.usda: can't be opened"),
    ],
)
def test_missing_file_is_named_with_its_prim(tmp_path, capfd, lost, words):
    stage = write_tiles(tmp_path / "stage")
    (tmp_path / "stage" / lost).unlink()
    with pytest.raises(StereoCellError, match=words) as caught:
        write_bundle(stage, tmp_path / "bundle", None, Engine(0))
    assert "\n" not in str(caught.value)
    for line in capfd.readouterr().err.splitlines():  # USD's own warnings would come on top
        assert line.startswith("bundle ")
    assert [p.name for p in tmp_path.iterdir()] == ["stage"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s: s.SetMetadata("metersPerUnit", 0.01), "metersPerUnit is 0.01, expected 1e-06"),
        (
            lambda s: s.GetAttributeAtPath(f"{CD31}.inputs:color").Set(Gf.Vec3f(1, 2, 0)),
            r"CD31.inputs:color: \(1, 2, 0\), expected three numbers in 0..1",
        ),
        (
            lambda s: s.GetAttributeAtPath(f"{CD31}.stereocell:opacityPoints").Set(
                [(1, 0), (0, 1)]
            ),
            "CD31.stereocell:opacityPoints: intensities fall",
        ),
        (
            lambda s: s.GetAttributeAtPath(f"{CD31}.stereocell:window").Set(Gf.Vec2f(9, 9)),
            r"CD31.stereocell:window: \(9, 9\), expected them to rise",
        ),
        (
            lambda s: UsdGeom.Imageable(s.GetPrimAtPath("/Specimen/Tiles")).MakeInvisible(),
            "no tile is visible",
        ),
    ],
)
def test_faulty_edits_are_named(edit, change, words):
    with pytest.raises(StereoCellError, match=words):
        edit(change)


def test_old_bundle_is_replaced_as_a_whole_and_kept_if_the_new_one_fails(stage, bundle, tmp_path):
    place = tmp_path / "bundle"
    write_bundle(stage, place, None, Engine(0))
    (place / "left over").write_text("from an older build")
    with pytest.raises(StageError):
        write_bundle(tmp_path / "none.usda", place, None, Engine(0))
    assert (place / "left over").exists()
    write_bundle(stage, place, None, Engine(0))
    assert files(place) == files(bundle)
    assert [p.name for p in tmp_path.iterdir()] == ["bundle"]


def test_folder_that_is_no_bundle_is_left_alone(stage, tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(OutputError, match=r"is no bundle: no manifest\.json in it"):
        write_bundle(stage, tmp_path, None, Engine(0))
    assert (tmp_path / "thesis.tex").exists()


def test_viewer_is_copied_and_listed(stage, tmp_path):
    (tmp_path / "dist" / "assets").mkdir(parents=True)
    (tmp_path / "dist" / "index.html").write_text("<!doctype html>")
    (tmp_path / "dist" / "assets" / "main.js").write_text("start()")
    write_bundle(stage, tmp_path / "bundle", tmp_path / "dist", Engine(0))
    assert (tmp_path / "bundle" / "assets" / "main.js").read_text() == "start()"
    assert {"index.html", "assets/main.js"} <= load(tmp_path / "bundle" / "files.json").keys()


def test_viewer_that_is_not_built_is_named(stage, tmp_path):
    with pytest.raises(OutputError, match=r"dist: no index\.html, expected the built viewer"):
        write_bundle(stage, tmp_path / "bundle", tmp_path / "dist", Engine(0))


def test_viewer_may_not_hide_files_of_the_bundle(stage, tmp_path):
    (tmp_path / "dist").mkdir()
    for name in ("index.html", "manifest.json"):
        (tmp_path / "dist" / name).write_text("")
    with pytest.raises(OutputError, match=r"the bundle has a manifest\.json of its own"):
        write_bundle(stage, tmp_path / "bundle", tmp_path / "dist", Engine(0))
    assert not (tmp_path / "bundle").exists()
