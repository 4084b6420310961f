"""What is edited in a layer over the stage reaches the bundle, or is named."""

import numpy as np
import pytest
import zstandard
from pxr import Gf, Sdf, Usd, UsdGeom

import spheres
from bundles import CD31, channel, factor, load, volumes, write_tiles
from glbs import decoded_positions_m, read
from stereocell.engine import Engine
from stereocell.errors import StereoCellError
from stereocell.write.bundle import write_bundle


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
        variants.ClearVariantSelection()  # to edit a level isn't to choose it

    points = decoded_positions_m((edit(change) / "channels/CD31/r0_c0/lod1.glb").read_bytes())
    away = np.linalg.norm(points * 1e6 - (0, 0, 1) - spheres.CENTER, axis=1)
    assert np.abs(away - spheres.RADIUS).max() < 0.003


def choose(stage, tile, **variants):
    for name, variant in variants.items():
        prim = stage.GetPrimAtPath(f"/Specimen/Tiles/{tile}")
        assert prim.GetVariantSet(name).SetVariantSelection(variant)


def chain(bundle, tile):
    """Return the levels of detail of a tile in the tileset of CD31, coarsest first."""
    root = load(bundle / channel(bundle)["tileset"]["path"])["root"]
    found = []
    for entry in root["children"]:
        levels = []
        while True:
            folder, level = entry["content"]["uri"].split("/")
            levels.append(level)
            if "children" not in entry:
                break
            (entry,) = entry["children"]
        assert entry["geometricError"] == 0  # nothing finer: a reader stops there
        found += [levels] * (folder == tile)
    (levels,) = found
    return levels


@pytest.mark.parametrize("chosen", ["mesh", "volume", "both"])
def test_representation_chosen_for_a_tile_reaches_the_manifest_and_takes_nothing_away(
    bundle, edit, chosen
):
    edited = edit(lambda s: choose(s, "r0_c1", representation=chosen))
    found = [tile["representation"] for tile in load(edited / "manifest.json")["tiles"]]
    assert found == ["mesh", chosen]
    for name in ("CD31", "Hoechst 33342"):  # its other form stays for the viewer's user
        assert channel(edited, name) == channel(bundle, name)


def test_representation_survives_flattening(edit, tmp_path):
    def change(stage):
        choose(stage, "r0_c0", representation="volume")
        choose(stage, "r0_c1", representation="both")

    edit(change)
    for kept in ({"r0_c0", "r0_c1"}, {"r0_c1"}):
        flat = tmp_path / "flat.usda"
        stage = Usd.Stage.Open(str(tmp_path / "edited.usda"))
        if "r0_c0" not in kept:
            choose(stage, "r0_c0", representation="mesh")
        stage.Export(str(flat))
        write_bundle(flat, tmp_path / "flat", None, Engine(0))
        found = [tile["representation"] for tile in load(tmp_path / "flat/manifest.json")["tiles"]]
        assert found == ["volume" if "r0_c0" in kept else "mesh", "both"]


def test_coarse_lod_chosen_for_a_tile_is_the_finest_that_the_bundle_has(bundle, edit):
    edited = edit(lambda s: choose(s, "r0_c1", lod="lod2"))
    whole = ["lod2.glb", "lod1.glb", "lod0.glb"]
    assert chain(bundle, "r0_c1") == chain(edited, "r0_c0") == whole
    assert chain(edited, "r0_c1") == ["lod2.glb"]
    assert [p.name for p in (edited / "channels/CD31/r0_c1").iterdir()] == ["lod2.glb"]
    kept = "channels/CD31/r0_c1/lod2.glb"
    # the only level wears its maps, which the coarsest of several leaves out
    assert "images" in read((edited / kept).read_bytes())[0]
    assert "images" not in read((bundle / kept).read_bytes())[0]
    assert not [path for path in load(edited / "files.json") if "r0_c1/lod0" in path]
    # two tiles alike: half of each level is the other one's
    two = channel(bundle)["triangles"]
    assert channel(edited)["triangles"] == [n // 2 + two[2] // 2 for n in two]
    assert volumes(edited) == volumes(bundle)


def test_triangles_are_told_by_the_stage_s_levels_whatever_is_left_out(tmp_path, monkeypatch):
    monkeypatch.setattr(spheres, "LEVELS", (*spheres.LEVELS, (6, 0.6)))
    tiles = [spheres.tile(0), spheres.tile(1)]
    stage = Usd.Stage.Open(str(write_tiles(tmp_path, tiles)))
    choose(stage, "r0_c1", lod="lod2")
    stage.GetRootLayer().Save()
    write_bundle(tmp_path / "stage.usda", tmp_path / "bundle", None, Engine(0))
    assert chain(tmp_path / "bundle", "r0_c1") == ["lod3.glb", "lod2.glb"]
    full, cut = ([len(lod.mesh.triangles) for lod in tile.channels[0].lods] for tile in tiles)
    cut[:2] = [cut[2]] * 2
    assert channel(tmp_path / "bundle")["triangles"] == [
        sum(n) for n in zip(full, cut, strict=True)
    ]


@pytest.mark.parametrize("level", ["lod0", "lod1"])
def test_lod_that_is_fine_enough_to_work_with_leaves_all_levels(bundle, edit, level):
    edited = edit(lambda s: choose(s, "r0_c1", lod=level))
    assert channel(edited) == channel(bundle)


@pytest.mark.parametrize("chosen", ["mesh", "volume", "both"])
def test_channel_hidden_in_a_tile_stays_hidden_whatever_is_chosen(bundle, edit, chosen):
    def change(stage):
        choose(stage, "r0_c0", representation=chosen, lod="lod2")
        for suffix in ("", "_volume"):
            path = f"/Specimen/Tiles/r0_c0/CD31/CD31_r0_c0{suffix}"
            stage.OverridePrim(path).SetActive(False)

    edited = edit(change)
    assert load(edited / "manifest.json")["tiles"][0]["representation"] == chosen
    assert [volume["tile"] for volume in volumes(edited)] == ["r0_c1"]
    assert not (edited / "channels/CD31/r0_c0").exists()
    assert chain(edited, "r0_c1") == chain(bundle, "r0_c1")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda s: choose(s, "r0_c1", lod="lod7"),
            "/Specimen/Tiles/r0_c1: lod 'lod7', expected one of lod0, lod1, lod2",
        ),
        (
            lambda s: choose(s, "r0_c1", representation="wire"),
            "r0_c1: representation 'wire', expected one of mesh, volume, both",
        ),
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
