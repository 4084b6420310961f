"""What is edited in a layer over the stage reaches the bundle, or is named."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
import zstandard
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, Vt

from stereocell.bundle.edited_meshes import shown_lods
from stereocell.bundle.write import write_bundle
from stereocell.engine.run import Engine
from stereocell.formats.vdb import write_vdb
from stereocell.model.channel import PaintColors
from stereocell.model.errors import StereoCellError
from stereocell.model.mesh import Baked, Lod
from stereocell.storage.file_list import measure
from stereocell.usd.read_stage import loaded, open_stage
from stereocell.usd.write_stage import TileExtent, write_stage, write_tile
from support import spheres
from support.bundles import CD31, channel, factor, files, load, volumes, write_tiles
from support.glbs import decoded_positions_m, read
from support.stages import HEAD, layer_over


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    """The two tiles' stage, to be read only."""
    return write_tiles(tmp_path_factory.mktemp("stage"))


@pytest.fixture(scope="module")
def bundle(stage, tmp_path_factory):
    """Its bundle, to be read only."""
    out = tmp_path_factory.mktemp("bundle") / "bundle"
    write_bundle(stage, out, None, run=Engine(0).run)
    return out


@pytest.fixture
def edit(stage, tmp_path):
    """Write a layer over the stage and return its bundle: `edit(lambda stage: ...)`."""

    def export(change):
        path = tmp_path / "edited.usda"
        layer = layer_over(path, str(stage))
        over = Usd.Stage.Open(layer)
        change(over)
        layer.Save()
        del over
        export.told = []
        write_bundle(
            path, tmp_path / "bundle", None, run=Engine(0).run, report_line=export.told.append
        )
        return tmp_path / "bundle"

    return export


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.fixture(scope="module")
def measured_stage(tmp_path_factory):
    """The two tiles' stage with CD31 as measured, to be read only."""
    tiles = tuple(spheres.tile(column, measured=True) for column in (0, 1))
    return write_tiles(tmp_path_factory.mktemp("measured"), tiles)


def edited_over(stage, folder, window):
    """Return the bundle of a layer over a stage that sets the window of CD31."""
    path = folder / "window.usda"
    layer = layer_over(path, str(stage))
    over = Usd.Stage.Open(layer)
    over.GetAttributeAtPath(f"{CD31}.stereocell:window").Set(Gf.Vec2f(*window))
    layer.Save()
    write_bundle(path, folder / "bundle", None, run=Engine(0).run)
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
    if window == (1200, 1230):  # of which 8 bits of 3900 counts have three
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
    write_bundle(measured_stage, tmp_path / "with", None, run=Engine(0).run)
    write_bundle(write_tiles(tmp_path / "s", bare), tmp_path / "bare", None, run=Engine(0).run)
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
    with pytest.raises(StereoCellError, match=r"CD31\.vdb: no grid 'measured' of floats"):
        edited_over(tmp_path / "own/stage.usda", tmp_path, (490, 2050))


def test_window_edit_survives_flattening(edit, tmp_path):
    def change(stage):
        stage.GetAttributeAtPath(f"{CD31}.stereocell:window").Set(Gf.Vec2f(490, 2050))
        for tile in stage.GetPrimAtPath("/Specimen/Tiles").GetChildren():
            tile.GetVariantSet("representation").SetVariantSelection("both")

    edited = edit(change)
    flat = tmp_path / "flat.usda"
    Usd.Stage.Open(str(tmp_path / "edited.usda")).Export(str(flat))
    write_bundle(flat, tmp_path / "flat", None, run=Engine(0).run)
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


def test_what_moves_over_time_is_refused_and_named(edit):
    """As a frame of an animation has it, which other programs show."""

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


def bind(stage, where, *, strength="strongerThanDescendants", purpose=""):
    """Bind a green material on a prim; an empty `where` leaves it unbound."""
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
def test_a_material_bound_above_the_channels_is_taken_for_surfaces_and_named(edit, where):
    edited = edit(lambda s: bind(s, where))
    (told,) = edit.told
    assert told.startswith(f"material /Specimen/Mine, bound on {where}, is taken over for surfaces")
    assert "volumes keep the channels' colours: inputs:color of /Specimen/Channels/NAME" in told
    assert factor(edited, "r0_c1") == [0, 1, 0, 1]
    assert (factor(edited) == [0, 1, 0, 1]) == (where != "/Specimen/Tiles/r0_c1")
    assert channel(edited)["color"] == [1.0, 0.2, 0.1]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"strength": "weakerThanDescendants"}, "the channels' own materials are stronger"),
        ({"purpose": "preview"}, "it is bound for the purpose 'preview' alone"),
        ({"purpose": "full"}, "it is bound for the purpose 'full' alone"),
    ],
)
def test_a_material_that_reaches_no_surface_is_named(edit, options, told):
    edited = edit(lambda s: bind(s, "/Specimen", **options))
    assert [told in line and "is not taken over" in line for line in edit.told] == [True]
    assert factor(edited) == [1.0, 0.2, 0.1, 1]


def test_a_material_that_is_bound_nowhere_needs_no_word(edit):
    edit(lambda s: bind(s, ""))
    assert edit.told == []


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
        write_bundle(flat, tmp_path / "flat", None, run=Engine(0).run)
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


@pytest.mark.slow
def test_triangles_are_told_by_the_stage_s_levels_whatever_is_left_out(tmp_path, monkeypatch):
    monkeypatch.setattr(spheres, "LEVELS", (*spheres.LEVELS, (6, 0.6)))
    tiles = [spheres.tile(0), spheres.tile(1)]
    stage = Usd.Stage.Open(str(write_tiles(tmp_path, tiles)))
    choose(stage, "r0_c1", lod="lod2")
    stage.GetRootLayer().Save()
    write_bundle(tmp_path / "stage.usda", tmp_path / "bundle", None, run=Engine(0).run)
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
        (lambda s: s.SetMetadata("upAxis", "Z"), "upAxis is Z, expected Y"),
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


MESH = "/Specimen/Tiles/r0_c0/CD31/CD31_r0_c0"


def in_level(stage, level, change):
    """Change the mesh of r0_c0 inside one variant, which stays unselected."""
    variants = stage.GetPrimAtPath("/Specimen/Tiles/r0_c0").GetVariantSet("lod")
    variants.SetVariantSelection(level)
    with variants.GetVariantEditContext():
        change(UsdGeom.Mesh(stage.GetPrimAtPath(MESH)))
    variants.ClearVariantSelection()


def set_points(mesh, move):
    points = np.array(mesh.GetPointsAttr().Get(), np.float64)
    mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(move(points).astype(np.float32)))


def swell(factor):
    """Return a change that makes the sphere larger; the cut stays in its plane."""
    return lambda mesh: set_points(mesh, lambda p: spheres.CENTER + factor * (p - spheres.CENTER))


RISE = 1.1 * 0.5  # um, lod2's error: so far outside its vertices may lie, to keep the volume


def radii(bundle, level):
    points = decoded_positions_m((bundle / f"channels/CD31/r0_c0/{level}.glb").read_bytes())
    return np.linalg.norm(points * 1e6 - spheres.CENTER, axis=1)


def errors_um(bundle):
    """Return what the tileset states of r0_c0 by level."""
    found, waiting = {}, [load(bundle / channel(bundle)["tileset"]["path"])["root"]]
    while waiting:
        entry = waiting.pop()
        waiting += entry.get("children", [])
        folder, _, level = entry.get("content", {}).get("uri", "").partition("/")
        if folder == "r0_c0":
            found[level.removesuffix(".glb")] = entry["geometricError"] * 1e6
    return found


@pytest.mark.slow
def test_a_stage_without_hashes_or_edits_gives_the_same_bundle(bundle, stage, edit, tmp_path):
    assert files(edit(lambda s: None)) == files(bundle)
    assert edit.told == []
    shutil.copytree(stage.parent, tmp_path / "old")
    for tile in (tmp_path / "old").rglob("tile.usdc"):
        layer = Sdf.Layer.FindOrOpen(str(tile))
        found = []
        layer.Traverse("/", lambda path, found=found: found.append(path))
        hashes = [path for path in found if path.name == "stereocell:shapeHash"]
        assert len(hashes) == len(spheres.LEVELS)
        for path in hashes:
            owner = layer.GetPrimAtPath(path.GetPrimOrPrimVariantSelectionPath())
            owner.RemoveProperty(layer.GetAttributeAtPath(path))
        layer.Save()
    told: list[str] = []
    write_bundle(
        tmp_path / "old/stage.usda",
        tmp_path / "from_old",
        None,
        run=Engine(0).run,
        report_line=told.append,
    )
    assert told == []
    assert files(tmp_path / "from_old") == files(bundle)


@pytest.mark.slow
def test_coarser_levels_are_made_anew_of_an_edited_finest_one(bundle, edit):
    edited = edit(lambda s: in_level(s, "lod0", swell(1.25)))
    large = 1.25 * spheres.RADIUS
    assert np.abs(radii(edited, "lod0") - large).max() < 0.01
    for level in ("lod1", "lod2"):
        assert np.abs(radii(edited, level) - large).max() < RISE
    stated = errors_um(edited)
    # chords of the finest level are within .3 um of the sphere, which all of these now approach
    assert 0 == stated["lod0"] < stated["lod1"] <= stated["lod2"] < 1
    assert stated["lod1"] != errors_um(bundle)["lod1"]
    other = "channels/CD31/r0_c1/lod1.glb"
    (line,) = edit.told
    assert line.startswith("r0_c0/CD31: edited by hand: lod0 (sound); made anew from lod0: lod1 ")
    assert "lod2 within" in line
    assert read((edited / other).read_bytes())[0]["meshes"]  # the neighbour is not touched
    assert chain(edited, "r0_c1") == chain(bundle, "r0_c1")
    # by the settings of a stage that states none
    document, _ = read((edited / "channels/CD31/r0_c0/lod1.glb").read_bytes())
    (primitive,) = document["meshes"][0]["primitives"]
    assert "TEXCOORD_0" not in primitive["attributes"]
    assert "images" not in document


@pytest.mark.slow
def test_the_cut_of_levels_made_anew_is_the_edited_one(edit):
    edited = edit(lambda s: in_level(s, "lod0", swell(1.25)))
    cut = {}
    for level in ("lod0", "lod1"):
        data = (edited / f"channels/CD31/r0_c0/{level}.glb").read_bytes()
        points = decoded_positions_m(data) * 1e6
        cut[level] = {tuple(p) for p in points[np.abs(points[:, 0] - 10) < 1e-3].round(4)}
    assert len(cut["lod0"]) > 8
    assert cut["lod0"] == cut["lod1"]


def test_an_edited_coarser_level_stays_and_states_its_distance(bundle, edit):
    edited = edit(lambda s: in_level(s, "lod1", swell(1.25)))
    assert np.abs(radii(edited, "lod1") - 1.25 * spheres.RADIUS).max() < 0.01
    for level in ("lod0", "lod2"):
        name = f"channels/CD31/r0_c0/{level}.glb"
        assert (edited / name).read_bytes() == (bundle / name).read_bytes()
    stated = errors_um(edited)
    assert stated["lod1"] == pytest.approx(0.25 * spheres.RADIUS + 0.02, rel=0.1)
    assert stated["lod2"] >= stated["lod1"]
    (line,) = edit.told
    assert "lod1 (sound) " in line
    assert line.endswith(" um from lod0, which is as it was built")


def test_levels_that_the_artist_edited_too_stay(edit):
    def change(stage):
        in_level(stage, "lod0", swell(1.25))
        in_level(stage, "lod2", swell(1.5))

    edited = edit(change)
    assert np.abs(radii(edited, "lod1") - 1.25 * spheres.RADIUS).max() < RISE
    assert np.abs(radii(edited, "lod2") - 1.5 * spheres.RADIUS).max() < 0.05
    assert errors_um(edited)["lod2"] == pytest.approx(0.25 * spheres.RADIUS, rel=0.2)
    (line,) = edit.told
    assert "lod2 (sound) stays, " in line


def box_mesh(mesh):
    """Give a mesh another topology: an octahedron."""
    points = spheres.CENTER - (2.0, 0, 0) + 1.5 * np.array(
        [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    )  # fmt: skip
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    mesh.GetPointsAttr().Set([Gf.Vec3f(*p) for p in points])
    mesh.GetFaceVertexCountsAttr().Set([3] * 8)
    mesh.GetFaceVertexIndicesAttr().Set([i for face in faces for i in face])
    mesh.GetNormalsAttr().Set([Gf.Vec3f(*(p - points.mean(axis=0)) / 1.5) for p in points])


@pytest.mark.parametrize("place", ["in lod0", "over all levels"])
def test_another_topology_reaches_all_levels(edit, place):
    def change(stage):
        if place == "in lod0":
            in_level(stage, "lod0", box_mesh)
        else:
            box_mesh(UsdGeom.Mesh(stage.GetPrimAtPath(MESH)))

    edited = edit(change)
    away = spheres.CENTER - (2.0, 0, 0)
    for level in chain(edited, "r0_c0"):
        data = (edited / f"channels/CD31/r0_c0/{level}").read_bytes()
        places = decoded_positions_m(data) * 1e6 - away
        assert np.abs(np.abs(places).sum(axis=1) - 1.5).max() < 0.05
    assert channel(edited)["triangles"][0] > 8  # and the neighbour's
    (line,) = edit.told
    assert "lod0 (sound)" in line


@pytest.mark.slow
def test_faults_of_an_edited_mesh_are_told(edit):
    def open_it(mesh):
        mesh.GetFaceVertexCountsAttr().Set(list(mesh.GetFaceVertexCountsAttr().Get())[:-40])
        mesh.GetFaceVertexIndicesAttr().Set(list(mesh.GetFaceVertexIndicesAttr().Get())[:-120])

    edit(lambda s: in_level(s, "lod0", open_it))
    assert " open edges" in edit.told[0]

    def cross_it(mesh):
        far = spheres.CENTER - (3.3, 0, 0)
        near = spheres.CENTER - (0.5, 0, -9.0)

        def move(points):
            points[np.linalg.norm(points - far, axis=1) < 1] = near
            return points

        set_points(mesh, move)

    edit(lambda s: in_level(s, "lod0", cross_it))
    assert " crossings" in edit.told[0] or "without area" in edit.told[0]


def empty(mesh):
    mesh.GetFaceVertexCountsAttr().Set([])
    mesh.GetFaceVertexIndicesAttr().Set([])


def test_an_emptied_finest_level_leaves_no_surface(edit):
    edited = edit(lambda s: in_level(s, "lod0", empty))
    assert not (edited / "channels/CD31/r0_c0").exists()
    assert edit.told == ["r0_c0/CD31: edited by hand: lod0 is empty: no surface is left"]


def test_an_emptied_coarser_level_is_left_out(edit):
    edited = edit(lambda s: in_level(s, "lod1", empty))
    assert chain(edited, "r0_c0") == ["lod2.glb", "lod0.glb"]
    assert edit.told == ["r0_c0/CD31: edited by hand: lod1 is empty and left out"]


def test_a_level_that_is_switched_off_is_left_out(bundle, edit):
    edited = edit(lambda s: in_level(s, "lod0", lambda mesh: mesh.GetPrim().SetActive(False)))
    assert chain(edited, "r0_c0") == ["lod2.glb", "lod1.glb"]
    assert edit.told == []


def test_a_mesh_that_is_moved_as_a_whole_keeps_its_levels(bundle, edit):
    edited = edit(
        lambda s: UsdGeom.XformCommonAPI(s.GetPrimAtPath(MESH)).SetTranslate((-1, 2, 0.5))
    )
    assert edit.told == []
    assert errors_um(edited) == errors_um(bundle)
    points = decoded_positions_m((edited / "channels/CD31/r0_c0/lod1.glb").read_bytes()) * 1e6
    away = np.linalg.norm(points - (-1, 2, 0.5) - spheres.CENTER, axis=1)
    assert np.abs(away - spheres.RADIUS).max() < 0.01


def test_a_transform_of_the_finest_level_alone_is_an_edit(edit):
    edited = edit(
        lambda s: in_level(
            s, "lod0", lambda mesh: UsdGeom.XformCommonAPI(mesh).SetTranslate((-1, 2, 0.5))
        )
    )
    for level in ("lod0", "lod1", "lod2"):
        data = (edited / f"channels/CD31/r0_c0/{level}.glb").read_bytes()
        away = decoded_positions_m(data) * 1e6 - (-1, 2, 0.5) - spheres.CENTER
        assert np.abs(np.linalg.norm(away, axis=1) - spheres.RADIUS).max() < RISE
    assert "made anew from lod0: lod1" in edit.told[0]


@pytest.mark.slow
def test_an_edit_in_place_and_a_flattened_one_are_known(stage, edit, tmp_path):
    shutil.copytree(stage.parent, tmp_path / "own")
    own = Usd.Stage.Open(str(tmp_path / "own/tiles/r0_c0/tile.usdc"))
    variants = own.GetDefaultPrim().GetVariantSet("lod")
    variants.SetVariantSelection("lod0")
    with variants.GetVariantEditContext():
        swell(1.25)(UsdGeom.Mesh(own.GetPrimAtPath("/r0_c0/CD31/CD31_r0_c0")))
    variants.SetVariantSelection("lod1")
    own.GetRootLayer().Save()
    told: list[str] = []
    write_bundle(
        tmp_path / "own/stage.usda",
        tmp_path / "a",
        None,
        run=Engine(0).run,
        report_line=told.append,
    )
    (line,) = told
    assert "lod0 (sound); made anew from lod0: lod1" in line
    assert np.abs(radii(tmp_path / "a", "lod2") - 1.25 * spheres.RADIUS).max() < RISE

    edit(lambda s: in_level(s, "lod0", swell(1.25)))
    whole = Usd.Stage.Open(str(tmp_path / "edited.usda"))
    tile = whole.GetPrimAtPath("/Specimen/Tiles/r0_c0")
    tile.GetVariantSet("lod").SetVariantSelection("lod0")
    whole.Export(str(tmp_path / "flat.usda"))
    told: list[str] = []
    write_bundle(
        tmp_path / "flat.usda", tmp_path / "flat", None, run=Engine(0).run, report_line=told.append
    )
    (line,) = told
    assert line == "r0_c0/CD31: edited by hand: lod0 (sound)"


def test_points_in_other_units_are_told(stage, tmp_path):
    layer = Sdf.Layer.CreateNew(str(tmp_path / "an artist's.usda"))
    layer.subLayerPaths = [str(stage)]
    over = Usd.Stage.Open(layer)
    in_level(over, "lod0", swell(1.25))
    layer.pseudoRoot.SetInfo("metersPerUnit", 0.01)
    layer.Save()
    root = Sdf.Layer.CreateNew(str(tmp_path / "root.usda"))
    root.ImportFromString(f"{HEAD})\n")
    specimen = Sdf.CreatePrimInLayer(root, "/Specimen")
    specimen.specifier = Sdf.SpecifierDef
    specimen.referenceList.prependedItems = [Sdf.Reference("./an artist's.usda", "/Specimen")]
    root.Save()
    told: list[str] = []
    write_bundle(
        tmp_path / "root.usda",
        tmp_path / "bundle",
        None,
        run=Engine(0).run,
        report_line=told.append,
    )
    (line,) = told
    assert "points of an artist's.usda, whose metersPerUnit is 0.01, are taken as um" in line


def test_points_that_are_no_numbers_are_refused(edit):
    def spoil(mesh):
        set_points(mesh, lambda points: np.where(points > 9.9, np.nan, points))

    with pytest.raises(StereoCellError, match=r"CD31_r0_c0.points: found nan, expected point3f"):
        edit(lambda s: in_level(s, "lod0", spoil))


@pytest.mark.slow
@pytest.mark.parametrize("first_lod", [1, 2])
def test_levels_made_anew_wear_occlusion_and_paint_of_the_edited_one(tmp_path, first_lod):
    """By the stage's own settings: lod1 has maps, or values at its vertices."""
    tile = spheres.tile(0)
    (painted, *others) = tile.channels
    lods = []
    for lod in painted.lods:
        bare = replace(lod.mesh, uvs=None, tangents=None)
        high, front = (bare.positions[:, k] > spheres.CENTER[k] for k in (1, 2))
        baked = Baked(np.where(high, 128, 255).astype(np.uint8), front.astype(np.uint8) * 255)
        lods.append(Lod(bare, lod.distance_um, None, None, baked))
    colors = PaintColors((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    painted = replace(painted, lods=tuple(lods), paint=colors)
    tile = replace(tile, channels=(painted, *others))
    write_tile(tmp_path, tile)
    settings = {
        "lod": {"errors": [0.1, 0.5, 0.8]},
        "unwrap": {"maps": True, "first_lod": first_lod},
    }
    appearances = (replace(spheres.RED, painted_by="Hoechst_x20_33342"), spheres.BLUE)
    write_stage(
        tmp_path,
        "one",
        appearances=appearances,
        tiles=[TileExtent.of(tile)],
        provenance={"settings": settings},
    )
    layer = layer_over(tmp_path / "edit.usda", "./stage.usda")
    over = Usd.Stage.Open(layer)
    in_level(over, "lod0", swell(1.25))
    layer.Save()
    told: list[str] = []
    write_bundle(
        tmp_path / "edit.usda",
        tmp_path / "bundle",
        None,
        run=Engine(0).run,
        report_line=told.append,
    )
    (line,) = told
    assert "made anew from lod0: lod1" in line
    with loaded(open_stage(tmp_path / "edit.usda"), "r0_c0") as (prim, _):
        _, lod, _ = shown_lods(prim, "CD31").lods
    assert lod.material.color == (1, 1, 1)
    if first_lod == 1:
        color, openness = lod.images.color / 255, lod.images.occlusion / 255
    else:
        assert lod.images is None
        color, openness = lod.mesh.colors, lod.mesh.openness
    for share in (color[..., 0], color[..., 1]):  # half is red, half green, sharply
        assert 0.3 < (share > 0.9).mean() < 0.7
    assert 0.3 < (np.abs(openness - 128 / 255) < 0.02).mean() < 0.7
    assert 0.3 < (openness > 0.98).mean() < 0.7
