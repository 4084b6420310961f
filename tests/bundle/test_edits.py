"""Edits in a layer over the stage reach the bundle, or are named."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
import zstandard
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from stereocell.formats.vdb import write_vdb
from stereocell.model.errors import StereoCellError
from stereocell.storage.file_list import measure
from support import spheres
from support.bundles import CD31, chain, channel, factor, files, load, volumes, write, write_tiles
from support.glbs import decoded_positions_m, read
from support.stages import edit_over


def put(path, value):
    """Return a function that sets one attribute of a stage."""
    return lambda stage: stage.GetAttributeAtPath(path).Set(value)


def choose(stage, tile, **variants):
    for name, variant in variants.items():
        prim = stage.GetPrimAtPath(f"/Specimen/Tiles/{tile}")
        assert prim.GetVariantSet(name).SetVariantSelection(variant)


@pytest.mark.slow
def test_color_edited_over_the_stage_reaches_manifest_and_meshes(bundle, edit):
    edited = edit(put(f"{CD31}.inputs:color", Gf.Vec3f(0.25, 0.5, 0.75)))
    assert channel(edited)["color"] == [0.25, 0.5, 0.75]
    assert factor(edited) == factor(edited, "r0_c1") == [0.25, 0.5, 0.75, 1]
    blue = "Hoechst 33342"
    assert channel(edited, blue) == channel(bundle, blue)


def texels(data):
    """Return the finest resolution level of a KTX2 texture as one row of bytes."""
    offset, length, _ = np.frombuffer(data, "<u8", 3, 80)
    return np.frombuffer(zstandard.decompress(data[offset : offset + length]), np.uint8)


@pytest.mark.slow
def test_window_edited_over_the_stage_reaches_manifest_voxels_and_bricks(bundle, edit):
    low, high = 490.0, 2050.0  # source values at an eighth and a half of the old window
    edited = edit(put(f"{CD31}.stereocell:window", Gf.Vec2f(low, high)))
    entry = channel(edited)
    assert entry["window"] == [low, high]
    assert entry["iso_value"] == 1200  # the surface stays where it was
    assert entry["iso_normalized"] == pytest.approx((1200 - low) / (high - low))
    for key in ("file", "bricks"):
        old, new = (
            texels((folder / volumes(folder)[0][key]["path"]).read_bytes()).astype(float)
            for folder in (bundle, edited)
        )
        values = 100 + old / 255 * 3900  # values of the voxels in the source
        assert np.abs(new - np.clip((values - low) / (high - low), 0, 1) * 255).max() <= 0.5001
        assert new.max() == 255
    blue = "Hoechst 33342"
    assert channel(edited, blue) == channel(bundle, blue)


@pytest.fixture(scope="module")
def measured_stage(tmp_path_factory):
    """The stage of two tiles with CD31 as measured; tests must not change it."""
    tiles = tuple(spheres.tile(column, measured=True) for column in (0, 1))
    return write_tiles(tmp_path_factory.mktemp("measured"), tiles)


def edited_over(stage, folder, window):
    """Return the bundle of a layer that sets the window of CD31 over a stage."""
    change = put(f"{CD31}.stereocell:window", Gf.Vec2f(*window))
    write(edit_over(folder / "window.usda", stage, change), folder / "bundle")
    return folder / "bundle"


@pytest.mark.parametrize("window", [(490, 2050), (1200, 1230), (-5000, 100000)])
def test_a_window_edited_over_measured_voxels_loses_nothing(measured_stage, tmp_path, window):
    low, high = window
    edited = edited_over(measured_stage, tmp_path, window)
    for column, entry in enumerate(volumes(edited)):
        width, height, depth = entry["size"]
        kept = spheres.counts((-1, -1, 20 * column - 1), (depth, height, width)).astype(float)
        wanted = np.rint(np.clip((kept - low) / (high - low), 0, 1) * 255)
        data = (edited / entry["file"]["path"]).read_bytes()
        np.testing.assert_array_equal(texels(data).reshape(wanted.shape), wanted)
    if window == (1200, 1230):  # 8 bits over 3900 counts have only three values there
        assert len(np.unique(texels(data))) > 20


@pytest.mark.slow
def test_a_bundle_whose_window_was_not_edited_only_names_the_measured_voxels(
    measured_stage, tmp_path
):
    tiles = [spheres.tile(column, measured=True) for column in (0, 1)]
    bare = [
        replace(tile, channels=tuple(replace(c, measured=None) for c in tile.channels))
        for tile in tiles
    ]
    write(measured_stage, tmp_path / "with")
    write(write_tiles(tmp_path / "s", bare), tmp_path / "bare")
    kept, alone = files(tmp_path / "with"), files(tmp_path / "bare")
    changed = {path.name for path in kept if kept[path] != alone[path]}
    assert changed == {"volumes.json", "files.json", "manifest.json"}
    for entry in volumes(tmp_path / "with"):
        file = measured_stage.parent / f"tiles/{entry['tile']}/CD31.vdb"
        assert entry.pop("measured") == measure(file)
        assert entry in volumes(tmp_path / "bare")


def test_measured_voxels_that_are_damaged_or_gone_are_named(measured_stage, tmp_path):
    shutil.copytree(measured_stage.parent, tmp_path / "own")
    file = tmp_path / "own/tiles/r0_c0/CD31.vdb"
    file.write_bytes(file.read_bytes()[:-1])
    with pytest.raises(StereoCellError, match=r"CD31\.vdb: can't be read as OpenVDB"):
        edited_over(tmp_path / "own/stage.usda", tmp_path, (490, 2050))
    write_vdb(file, np.zeros((9, 20, 20), np.uint8), first_um=(0, 0, 0), spacing_um=(1, 1, 1))
    with pytest.raises(StereoCellError, match=r"CD31\.vdb: found no grid 'measured' of floats"):
        edited_over(tmp_path / "own/stage.usda", tmp_path, (490, 2050))


def test_window_edit_survives_flattening(edit, tmp_path):
    def change(stage):
        stage.GetAttributeAtPath(f"{CD31}.stereocell:window").Set(Gf.Vec2f(490, 2050))
        for tile in stage.GetPrimAtPath("/Specimen/Tiles").GetChildren():
            tile.GetVariantSet("representation").SetVariantSelection("both")

    edited = edit(change)
    flat = tmp_path / "flat.usda"
    Usd.Stage.Open(str(tmp_path / "edited.usda")).Export(str(flat))
    write(flat, tmp_path / "flat")
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

    words = r"CD31_r0_c0: .* \(lod0\): edit inside the variant lod=lod0, or override points, "
    with pytest.raises(StereoCellError, match=words):
        edit(change)


def test_values_over_time_are_refused_and_named(edit):
    """A program that plays animations would show such values as one frame."""

    def points(stage):
        mesh = stage.GetAttributeAtPath("/Specimen/Tiles/r0_c0/CD31/CD31_r0_c0.points")
        mesh.Set([point + Gf.Vec3f(0, 0, 1) for point in mesh.Get()], 0.0)

    def tile(stage):
        prim = stage.GetPrimAtPath("/Specimen/Tiles/r0_c0")
        UsdGeom.Xformable(prim).AddTranslateOp(opSuffix="mine").Set(Gf.Vec3d(0, 5, 0), 0.0)

    for change, name in ((points, "CD31_r0_c0.points"), (tile, r"r0_c0.xformOp:translate:mine")):
        with pytest.raises(StereoCellError, match=f"{name}: found values over time, expected one"):
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


def drawn(bundle, tile="r0_c0"):
    """Return the glTF material of a tile's finest surface."""
    return read((bundle / f"channels/CD31/{tile}/lod0.glb").read_bytes())[0]["materials"][0]


def test_opacity_of_a_channel_reaches_all_its_surfaces_and_the_usdz(bundle, edit):
    assert "alphaMode" not in drawn(bundle)
    edited = edit(lambda s: put_new(s, f"{CD31}/surface", "inputs:opacity", "Float", 0.4))
    for tile in ("r0_c0", "r0_c1"):
        material = drawn(edited, tile)
        assert material["alphaMode"] == "BLEND"
        assert material["pbrMetallicRoughness"]["baseColorFactor"][3] == 0.4
    small = Usd.Stage.Open(str(edited / "specimen.usdz"))
    looks = small.GetPrimAtPath("/Specimen/Looks").GetChildren()
    shaders = [UsdShade.Shader(look.GetChild("surface")) for look in looks]
    assert {round(shader.GetInput("opacity").Get(), 3) for shader in shaders} == {0.4}


def test_opacities_of_shader_channel_and_mesh_are_multiplied(edit):
    mesh = "/Specimen/Tiles/r0_c0/CD31/CD31_r0_c0"

    def change(stage):
        put_new(stage, f"{CD31}/surface", "inputs:opacity", "Float", 0.5)
        put_new(stage, CD31, "primvars:displayOpacity", "FloatArray", [0.5])
        put_new(stage, mesh, "primvars:displayOpacity", "FloatArray", [0.8])

    edited = edit(change)
    alphas = [factor(edited, tile)[3] for tile in ("r0_c0", "r0_c1")]
    assert alphas == pytest.approx([0.2, 0.25])


@pytest.mark.parametrize(("opacity", "alpha"), [(0.4, 0), (0.6, 1)])
def test_a_threshold_makes_an_opacity_all_or_nothing(edit, opacity, alpha):
    def change(stage):
        put_new(stage, f"{CD31}/surface", "inputs:opacity", "Float", opacity)
        put_new(stage, f"{CD31}/surface", "inputs:opacityThreshold", "Float", 0.5)

    assert factor(edit(change))[3] == alpha


def test_emission_reaches_the_surfaces_and_one_outside_its_range_is_refused(edit):
    name = "inputs:emissiveColor"
    glow = Gf.Vec3f(0, 0.5, 0.25)
    edited = edit(lambda s: put_new(s, f"{CD31}/surface", name, "Color3f", glow))
    assert drawn(edited)["emissiveFactor"] == [0, 0.5, 0.25]
    with pytest.raises(StereoCellError, match=r"inputs:emissiveColor is .*expected three numbers"):
        edit(lambda s: put_new(s, f"{CD31}/surface", name, "Color3f", Gf.Vec3f(0, 5, 0)))


def test_display_color_of_a_mesh_or_a_tile_colours_its_surface(edit):
    green, blue = Gf.Vec3f(0, 1, 0), Gf.Vec3f(0, 0, 1)
    mesh = "/Specimen/Tiles/r0_c0/CD31/CD31_r0_c0"

    def change(stage):
        put_new(stage, mesh, "primvars:displayColor", "Color3fArray", [green])
        put_new(stage, "/Specimen/Tiles/r0_c1", "primvars:displayColor", "Color3fArray", [blue])

    edited = edit(change)
    assert factor(edited) == [0, 1, 0, 1]
    assert factor(edited, "r0_c1") == [0, 0, 1, 1]


def test_display_colors_at_points_are_those_of_the_vertices(edit):
    def change(stage):
        mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Specimen/Tiles/r0_c0/CD31/CD31_r0_c0"))
        choose(stage, "r0_c0", lod="lod0")
        levels = stage.GetPrimAtPath("/Specimen/Tiles/r0_c0").GetVariantSet("lod")
        with levels.GetVariantEditContext():
            count = len(mesh.GetPointsAttr().Get())
            kind = Sdf.ValueTypeNames.Color3fArray
            colors = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("displayColor", kind, "vertex")
            colors.Set([Gf.Vec3f(0, k % 2, 1) for k in range(count)])

    edited = edit(change)
    assert edit.lines == []
    document, _ = read((edited / "channels/CD31/r0_c0/lod0.glb").read_bytes())
    assert "COLOR_0" in document["meshes"][0]["primitives"][0]["attributes"]
    assert factor(edited) == [1, 1, 1, 1]


def put_new(stage, path, name, kind, value):
    """Set an attribute of a prim on a stage; create the attribute if the prim lacks it."""
    stage.OverridePrim(path).CreateAttribute(name, getattr(Sdf.ValueTypeNames, kind)).Set(value)


def bind(stage, where, *, strength="strongerThanDescendants", purpose=""):
    """Define a green material on a stage, and bind it to the prim `where`; "": to no prim."""
    material = UsdShade.Material.Define(stage, "/Specimen/Mine")
    shader = UsdShade.Shader.Define(stage, "/Specimen/Mine/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(0, 1, 0))
    output = shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput().ConnectToSource(output)
    if where:
        binding = UsdShade.MaterialBindingAPI.Apply(stage.OverridePrim(where))
        binding.Bind(material, strength, purpose)


@pytest.mark.parametrize("where", ["/Specimen", "/Specimen/Tiles", "/Specimen/Tiles/r0_c1"])
def test_material_bound_above_the_channels_colours_surfaces_and_is_named(edit, where):
    edited = edit(lambda s: bind(s, where))
    (line,) = edit.lines
    assert line.startswith(f"material /Specimen/Mine, bound on {where}, is taken over for surfaces")
    assert (
        "volumes keep the channels' colours: edit inputs:color of /Specimen/Channels/NAME" in line
    )
    assert factor(edited, "r0_c1") == [0, 1, 0, 1]
    assert (factor(edited) == [0, 1, 0, 1]) == (where != "/Specimen/Tiles/r0_c1")
    assert channel(edited)["color"] == [1.0, 0.2, 0.1]


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"strength": "weakerThanDescendants"}, "the channels' own materials are stronger"),
        ({"purpose": "preview"}, "it is bound only for the purpose 'preview'"),
        ({"purpose": "full"}, "it is bound only for the purpose 'full'"),
    ],
)
def test_a_material_that_reaches_no_surface_is_named(edit, options, expected):
    edited = edit(lambda s: bind(s, "/Specimen", **options))
    assert [expected in line and "is not taken over" in line for line in edit.lines] == [True]
    assert factor(edited) == [1.0, 0.2, 0.1, 1]


def test_a_material_that_is_bound_nowhere_is_named(edit):
    edit(lambda s: bind(s, ""))
    assert edit.lines == ["Material /Specimen/Mine is not taken over: no mesh is bound to it"]


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
    assert moved["matrix"][12:] == [100, 20, 3, 1]  # the last column of a column-major matrix
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


def test_transfer_function_chosen_and_edited_over_the_stage_is_taken_over(edit):
    def change(stage):
        variants = stage.GetPrimAtPath(CD31).GetVariantSet("transferFunction")
        variants.SetVariantSelection("sharp")
        points = stage.GetAttributeAtPath(f"{CD31}.stereocell:opacityPoints")
        with variants.GetVariantEditContext():
            points.Set([(0, 1), (1, 1)])

    edited = edit(change)
    assert channel(edited)["transfer_function"] == "sharp"
    data = (edited / channel(edited)["lut"]["path"]).read_bytes()
    table = texels(data).reshape(2, 256, 4)
    assert (table[1, :, 3] == 255).all()
    assert table[0, 0, 3] == 0


def test_hidden_tiles_and_meshes_are_left_out(edit):
    def change(stage):
        stage.GetPrimAtPath("/Specimen/Tiles/r0_c1").SetActive(False)
        UsdGeom.Imageable(stage.GetPrimAtPath("/Specimen/Tiles/r0_c0/CD31")).MakeInvisible()

    edited = edit(change)
    assert [tile["id"] for tile in load(edited / "manifest.json")["tiles"]] == ["r0_c0"]
    assert channel(edited)["tileset"] is None
    assert volumes(edited) == []


def test_edited_points_are_taken_over(edit):
    def change(stage):
        tile = stage.GetPrimAtPath("/Specimen/Tiles/r0_c0")
        for level in range(3):
            variants = tile.GetVariantSet("lod")
            variants.SetVariantSelection(f"lod{level}")
            with variants.GetVariantEditContext():
                points = stage.GetAttributeAtPath(f"{tile.GetPath()}/CD31/CD31_r0_c0.points")
                points.Set([point + Gf.Vec3f(0, 0, 1) for point in points.Get()])
        variants.ClearVariantSelection()  # editing a level does not select it

    points = decoded_positions_m((edit(change) / "channels/CD31/r0_c0/lod1.glb").read_bytes())
    away = np.linalg.norm(points * 1e6 - (0, 0, 1) - spheres.CENTER, axis=1)
    assert np.abs(away - spheres.RADIUS).max() < 0.003


@pytest.mark.parametrize("chosen", ["mesh", "volume", "both"])
def test_representation_chosen_for_a_tile_reaches_the_manifest_and_removes_nothing(
    bundle, edit, chosen
):
    edited = edit(lambda s: choose(s, "r0_c1", representation=chosen))
    found = [tile["representation"] for tile in load(edited / "manifest.json")["tiles"]]
    assert found == ["mesh", chosen]
    for name in ("CD31", "Hoechst 33342"):  # the other form remains available in the viewer
        assert channel(edited, name) == channel(bundle, name)


@pytest.mark.slow
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
        write(flat, tmp_path / "flat")
        found = [tile["representation"] for tile in load(tmp_path / "flat/manifest.json")["tiles"]]
        assert found == ["volume" if "r0_c0" in kept else "mesh", "both"]


def test_coarse_lod_chosen_for_a_tile_is_the_finest_that_the_bundle_has(bundle, edit):
    edited = edit(lambda s: choose(s, "r0_c1", lod="lod2"))
    whole = ["lod2.glb", "lod1.glb", "lod0.glb"]
    assert chain(bundle, "r0_c1") == chain(edited, "r0_c0") == whole
    assert chain(edited, "r0_c1") == ["lod2.glb"]
    assert [p.name for p in (edited / "channels/CD31/r0_c1").iterdir()] == ["lod2.glb"]
    kept = "channels/CD31/r0_c1/lod2.glb"
    # A single level keeps its maps. The coarsest of several levels has none.
    assert "images" in read((edited / kept).read_bytes())[0]
    assert "images" not in read((bundle / kept).read_bytes())[0]
    assert not [path for path in load(edited / "files.json") if "r0_c1/lod0" in path]
    # The tiles are alike, so each has half of a level's triangles.
    two = channel(bundle)["triangles"]
    assert channel(edited)["triangles"] == [n // 2 + two[2] // 2 for n in two]
    assert volumes(edited) == volumes(bundle)


@pytest.mark.slow
def test_triangles_are_counted_by_the_levels_of_the_stage(tmp_path, monkeypatch):
    monkeypatch.setattr(spheres, "LEVELS", (*spheres.LEVELS, (6, 0.6)))
    tiles = [spheres.tile(0), spheres.tile(1)]
    stage = Usd.Stage.Open(str(write_tiles(tmp_path, tiles)))
    choose(stage, "r0_c1", lod="lod2")
    stage.GetRootLayer().Save()
    write(tmp_path / "stage.usda", tmp_path / "bundle")
    assert chain(tmp_path / "bundle", "r0_c1") == ["lod3.glb", "lod2.glb"]
    full, cut = ([len(lod.mesh.triangles) for lod in tile.channels[0].lods] for tile in tiles)
    cut[:2] = [cut[2]] * 2
    assert channel(tmp_path / "bundle")["triangles"] == [
        sum(n) for n in zip(full, cut, strict=True)
    ]


@pytest.mark.parametrize("level", ["lod0", "lod1"])
def test_choosing_lod0_or_lod1_keeps_all_levels(bundle, edit, level):
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
            "/Specimen/Tiles/r0_c1: lod is 'lod7', expected one of lod0, lod1, lod2",
        ),
        (
            lambda s: choose(s, "r0_c1", representation="wire"),
            "r0_c1: representation is 'wire', expected one of mesh, volume, both",
        ),
        (lambda s: s.SetMetadata("upAxis", "Z"), "upAxis is Z, expected Y"),
        (lambda s: s.SetMetadata("metersPerUnit", 0.01), "metersPerUnit is 0.01, expected 1e-06"),
        (
            lambda s: s.GetAttributeAtPath(f"{CD31}.inputs:color").Set(Gf.Vec3f(1, 2, 0)),
            r"CD31.inputs:color is \(1, 2, 0\), expected three numbers from 0 to 1",
        ),
        (
            lambda s: s.GetAttributeAtPath(f"{CD31}.stereocell:opacityPoints").Set(
                [(1, 0), (0, 1)]
            ),
            "CD31.stereocell:opacityPoints: found falling intensities",
        ),
        (
            lambda s: s.GetAttributeAtPath(f"{CD31}.stereocell:window").Set(Gf.Vec2f(9, 9)),
            r"CD31.stereocell:window is \(9, 9\), expected the first",
        ),
        (
            lambda s: UsdGeom.Imageable(s.GetPrimAtPath("/Specimen/Tiles")).MakeInvisible(),
            "found no visible tile, expected one or more",
        ),
    ],
)
def test_faulty_edits_are_named(edit, change, words):
    with pytest.raises(StereoCellError, match=words):
        edit(change)
