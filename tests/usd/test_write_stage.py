import json
import multiprocessing
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdShade, UsdVol

from stereocell.formats.exr import read_atlas
from stereocell.model.channel import TransferFunctions2d
from stereocell.model.errors import OutputError
from stereocell.storage import assets
from stereocell.usd.numbers2d import ATTRIBUTES
from stereocell.usd.write_stage import TileExtent, write_stage, write_tile
from support.digests import digests_of
from support.phantoms import f_phantom
from support.stages import (
    BALL_ID,
    COLORS,
    EMPTY_ID,
    F_ID,
    FUNCTIONS,
    HEAD,
    SHAPE,
    SPACING_UM,
    TILES,
    has_schema,
    leaf,
    make_appearances,
    make_tiles,
    write_whole,
)
from support.vdb_reader import read_vdb, value_at

# Voxels (z, y, x): in each tile a corner of the F, and its three neighbours outside the F
BORDER = [
    (4, 6, 6),
    (3, 6, 6),
    (4, 5, 6),
    (4, 6, 5),
    (7, 6, 29),
    (8, 6, 29),
    (7, 5, 29),
    (7, 6, 30),
]


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


@pytest.fixture
def over(stage_path: Path, tmp_path: Path) -> Usd.Stage:
    """An artist's layer over the stage, in another folder."""
    path = tmp_path / "edit.usda"
    path.write_text(f"{HEAD}subLayers = [@{stage_path}@])\n")
    return Usd.Stage.Open(str(path))


def select(stage: Usd.Stage, **variants: str) -> None:
    for tile in TILES:
        for name, variant in variants.items():
            sets = stage.GetPrimAtPath(f"/Specimen/Tiles/{tile}").GetVariantSets()
            assert sets.GetVariantSet(name).SetVariantSelection(variant)


def points_of(stage: Usd.Stage, channel: str) -> np.ndarray:
    """Return the world positions of a channel's vertices in all tiles."""
    parts = []
    for tile in TILES:
        mesh = UsdGeom.Mesh.Get(stage, leaf(tile, channel))
        to_world = np.array(mesh.ComputeLocalToWorldTransform(Usd.TimeCode.Default()))
        local = np.array(mesh.GetPointsAttr().Get(), dtype=np.float64)
        parts.append(local @ to_world[:3, :3] + to_world[3, :3])
    return np.concatenate(parts)


def surface_color(stage: Usd.Stage, tile: str, channel: str) -> Gf.Vec3f:
    """Return the colour that the renderer Storm draws.

    Storm finds it by the mesh's material binding, and then by the shader input's connection.
    """
    mesh = stage.GetPrimAtPath(leaf(tile, channel))
    material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
    shader = material.ComputeSurfaceSource("glslfx")[0]
    (source,) = shader.GetInput("diffuseColor").GetValueProducingAttributes()
    return source.Get()


def test_the_stage_has_its_prims_kinds_and_units(stage_path: Path) -> None:
    stage = Usd.Stage.Open(str(stage_path))
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1e-6
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    root = stage.GetDefaultPrim()
    assert (str(root.GetPath()), root.GetDisplayName()) == ("/Specimen", "F")
    assert root.IsModel()
    assert Usd.ModelAPI(root).GetKind() == Kind.Tokens.assembly
    tiles = stage.GetPrimAtPath("/Specimen/Tiles").GetChildren()
    assert [tile.GetName() for tile in tiles] == list(TILES)
    for tile in tiles:
        assert tile.IsModel()  # true only if all prims above it are groups
        assert Usd.ModelAPI(tile).GetKind() == Kind.Tokens.component
        assert tile.HasAuthoredPayloads()
    data = stage.GetRootLayer().customLayerData["stereocell"]
    assert data["generator"] == "tests"
    assert data["settings"]["lod.errors"] == "[0.1, 0.4]"


def test_the_root_states_what_the_asset_is(stage_path: Path, tmp_path: Path) -> None:
    stage = Usd.Stage.Open(str(stage_path), Usd.Stage.LoadNone)
    root = stage.GetDefaultPrim()
    model = Usd.ModelAPI(root)
    assert model.GetAssetName() == "F"
    assert model.GetAssetIdentifier().path == "./stage.usda"
    assert "9 x 12 x 8 um" in root.GetDocumentation()
    # The box of all tiles, although they are not loaded.
    low, high = np.array(UsdGeom.ModelAPI(root).GetExtentsHint())
    depth, height, width = SPACING_UM
    slices, rows, columns = SHAPE
    half = np.array([width, height, depth]) / 2
    assert low == pytest.approx(np.array([0, -(rows - 1) * height, 0]) - half)
    assert high == pytest.approx(np.array([(columns - 1) * width, 0, (slices - 1) * depth]) + half)
    # A build with other settings is another version.
    other = tmp_path / "other/stage.usda"
    tiles = [TileExtent.of(tile) for tile in make_tiles()]
    changed = {"generator": "tests", "seed": 2}
    appearances = make_appearances()
    write_stage(other.parent, "F", appearances=appearances, tiles=tiles, provenance=changed)
    again = Usd.Stage.Open(str(other))
    version = Usd.ModelAPI(again.GetDefaultPrim()).GetAssetVersion()
    assert model.GetAssetVersion() not in ("", version)


def test_every_name_in_the_files_is_relative(stage_path: Path) -> None:
    for path in [p for p in stage_path.parent.rglob("*") if p.suffix in (".usda", ".usdc")]:
        text = Sdf.Layer.FindOrOpen(str(path)).ExportToString()
        named = text.split("@")[1::2]
        assert all(name.startswith("./") for name in named), path
        assert str(stage_path.parent) not in text


@pytest.mark.parametrize("lod", ["lod0", "lod1", "lod2"])
def test_letter_is_upright_and_not_mirrored(over: Usd.Stage, lod: str) -> None:
    select(over, lod=lod)
    points = points_of(over, F_ID)
    depth, height, width = SPACING_UM
    z, y, x = np.nonzero(f_phantom() > 500)
    half = 0.5 if lod != "lod2" else 1.0  # the coarse level was sampled every second voxel
    low = [x.min() * width, -y.max() * height, z.min() * depth]
    high = [x.max() * width, -y.min() * height, z.max() * depth]
    slack = np.array([width, height, depth]) * half + 1e-5
    assert (np.abs(points.min(axis=0) - low) <= slack).all()
    assert (np.abs(points.max(axis=0) - high) <= slack).all()
    right = points[points[:, 0] > 24 * width]  # only the long arm reaches so far to the right
    assert right[:, 1].min() > -15 * height  # and it is at the top
    foot = points[points[:, 2] > 9 * depth]  # only the foot reaches towards the viewer
    assert foot[:, 0].max() < 15 * width
    assert foot[:, 1].max() < -32 * height


def test_volume_and_mesh_show_the_same_body(over: Usd.Stage) -> None:
    select(over, representation="both")
    body = f_phantom() > 500
    depth, height, width = SPACING_UM
    found = 0
    for tile in TILES:
        volume = UsdVol.Volume.Get(over, leaf(tile, F_ID, "_volume"))
        (field,) = volume.GetFieldPaths().values()
        asset = UsdVol.OpenVDBAsset.Get(over, field)
        vdb = read_vdb(Path(asset.GetFilePathAttr().Get().resolvedPath))
        found += len(vdb.voxels)
        for z, y, x in [*BORDER, (6, 22, 20), (10, 36, 10), (6, 35, 25)]:
            inside = x < 18 if tile == TILES[0] else x >= 18
            position = (x * width, -y * height, z * depth)
            if inside:
                assert value_at(vdb, position) == float(body[z, y, x])
                low, high = np.array(volume.GetExtentAttr().Get())
                assert (low < position).all()
                assert (position < high).all()
    assert found == body.sum()  # only own voxels count, so none is missing or counted twice


def test_the_atlas_is_the_volume_with_its_apron(over: Usd.Stage) -> None:
    select(over, representation="volume")
    for tile in make_tiles():
        for channel in tile.channels:
            prim = over.GetPrimAtPath(leaf(tile.id, channel.channel_id, "_volume"))
            atlas = prim.GetAttribute("stereocell:atlas").Get()
            volume = read_atlas(Path(atlas.resolvedPath))
            assert np.array_equal(volume, channel.volume)
            assert tuple(prim.GetAttribute("stereocell:atlasSize").Get()) == volume.shape[::-1]
            assert prim.GetAttribute("stereocell:apron").Get() == 1
            (z0, y0, x0), (z1, y1, x1) = tile.first_um, tile.last_um
            assert tuple(prim.GetAttribute("stereocell:boundsMin").Get()) == (x0, -y1, z0)
            assert tuple(prim.GetAttribute("stereocell:boundsMax").Get()) == (x1, -y0, z1)


def test_representations_switch_meshes_and_volumes(over: Usd.Stage) -> None:
    shown = {"mesh": (True, False), "volume": (False, True), "both": (True, True)}
    sets = over.GetPrimAtPath("/Specimen/Tiles/r0_c0").GetVariantSets()
    assert sets.GetVariantSelection("representation") == "mesh"
    assert sets.GetVariantSelection("lod") == "lod1"
    for name, expected in shown.items():
        select(over, representation=name)
        kinds = [prim.GetTypeName() for prim in over.Traverse()]
        assert ("Mesh" in kinds, "Volume" in kinds) == expected
    assert not over.GetPrimAtPath(leaf("r0_c0", EMPTY_ID))  # no surface: a volume only
    assert over.GetPrimAtPath(leaf("r0_c0", EMPTY_ID, "_volume"))


def test_variant_selections_are_in_the_layer_of_the_contents(stage_path: Path) -> None:
    root = Sdf.Layer.FindOrOpen(str(stage_path.parent / "contents.usda"))
    for tile in TILES:
        selections = root.GetPrimAtPath(f"/Specimen/Tiles/{tile}").variantSelections
        assert dict(selections) == {"lod": "lod1", "representation": "mesh"}
    looks = Sdf.Layer.FindOrOpen(str(stage_path.parent / "looks" / "channels.usda"))
    assert "./looks/channels.usda" in root.subLayerPaths
    for channel in (F_ID, BALL_ID, EMPTY_ID):
        selections = looks.GetPrimAtPath(f"/Specimen/Channels/{channel}").variantSelections
        assert dict(selections) == {"transferFunction": "default"}


def test_lods_differ_and_state_their_distance(over: Usd.Stage) -> None:
    distances, counts = [], []
    for lod in ("lod0", "lod1", "lod2"):
        select(over, lod=lod)
        mesh = UsdGeom.Mesh.Get(over, leaf("r0_c0", F_ID))
        distances.append(mesh.GetPrim().GetAttribute("stereocell:distance").Get())
        counts.append(len(mesh.GetFaceVertexCountsAttr().Get()))
        has_uvs = UsdGeom.PrimvarsAPI(mesh).HasPrimvar("st")
        material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
        normal = material.ComputeSurfaceSource()[0].GetInput("normal")
        live = material.ComputeSurfaceSource("glslfx")[0].GetInput("normal")  # input for Storm
        assert has_uvs == bool(normal) == bool(live) == (lod == "lod2")
    assert distances == pytest.approx([0.0, 0.1, 0.3])
    assert counts[2] < counts[0]
    (source,) = normal.GetValueProducingAttributes()
    file = UsdShade.Shader(source.GetPrim()).GetInput("file").Get()
    assert Path(file.resolvedPath).name == f"{F_ID}_lod2_normal.png"


def test_one_edit_over_the_stage_recolours_every_tile(over: Usd.Stage) -> None:
    for tile in TILES:
        assert surface_color(over, tile, F_ID) == Gf.Vec3f(*COLORS[0])
    channel = over.OverridePrim(f"/Specimen/Channels/{F_ID}")
    UsdShade.Material(channel).GetInput("color").Set(Gf.Vec3f(0, 1, 0.5))
    for tile in TILES:
        assert surface_color(over, tile, F_ID) == Gf.Vec3f(0, 1, 0.5)
        assert surface_color(over, tile, BALL_ID) == Gf.Vec3f(*COLORS[1])
        look = UsdShade.Material.Get(over, leaf(tile, F_ID, "_look"))
        assert look.GetInput("color").Get() == Gf.Vec3f(0, 1, 0.5)  # volumes read this input


def test_a_transfer_function_is_chosen_in_one_place(over: Usd.Stage) -> None:
    channel = over.GetPrimAtPath(f"/Specimen/Channels/{F_ID}")
    functions = channel.GetVariantSets().GetVariantSet("transferFunction")
    assert functions.GetVariantSelection() == "default"
    assert set(functions.GetVariantNames()) == set(FUNCTIONS)
    for name, points in FUNCTIONS.items():
        functions.SetVariantSelection(name)
        for prim in (channel, over.GetPrimAtPath(leaf("r0_c1", F_ID, "_look"))):
            found = np.array(prim.GetAttribute("stereocell:opacityPoints").Get())
            assert np.allclose(found, points)
            lut = prim.GetAttribute("stereocell:lut").Get()
            assert Path(lut.resolvedPath).name == f"{F_ID}_{name}.exr"


def test_a_look_keeps_the_channels_own_name_and_levels(stage_path: Path) -> None:
    stage = Usd.Stage.Open(str(stage_path))
    prim = stage.GetPrimAtPath(f"/Specimen/Channels/{F_ID}")
    assert prim.GetDisplayName() == "CD3\N{GREEK SMALL LETTER EPSILON}"
    assert "StereoCellChannelAPI" in prim.GetAppliedSchemas()
    assert tuple(prim.GetAttribute("stereocell:window").Get()) == (100, 1100)
    assert prim.GetAttribute("stereocell:isoValue").Get() == 600
    assert prim.GetAttribute("stereocell:volumeWindow").Get() == (100, 1100)
    assert prim.GetAttribute("stereocell:surfaceVerdict").Get() == "clear"
    empty = stage.GetPrimAtPath(f"/Specimen/Channels/{EMPTY_ID}")
    assert empty.GetDisplayName() == "1st"
    assert not empty.GetAttribute("stereocell:isoValue").HasAuthoredValue()
    assert empty.GetAttribute("stereocell:surfaceVerdict").Get() == "none"


def test_cameras_see_the_whole_specimen(stage_path: Path) -> None:
    stage = Usd.Stage.Open(str(stage_path))
    depth, height, width = np.array(SPACING_UM) * (np.array(SHAPE) - 1)
    middle = Gf.Vec3d(width / 2, -height / 2, depth / 2)
    corners = [Gf.Vec3d(x, -y, z) for x in (0, width) for y in (0, height) for z in (0, depth)]
    eyes, centres = [], []
    for name in ("left", "mono", "right"):
        camera = UsdGeom.Camera.Get(stage, f"/Specimen/Cameras/{name}")
        assert camera.GetStereoRoleAttr().Get() == name
        frustum = camera.GetCamera(Usd.TimeCode.Default()).frustum
        assert all(frustum.Intersects(corner) for corner in corners)
        eyes.append(frustum.GetPosition())
        assert frustum.ComputeViewDirection() == Gf.Vec3d(0, 0, -1)
        to_screen = frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix()
        centres.append(to_screen.Transform(middle)[:2])
        # The specimen fills the picture.
        across = [to_screen.Transform(corner)[:2] for corner in corners]
        assert np.abs(across).max() > 0.8
    assert np.allclose(centres, 0, atol=1e-6)  # both eyes see it at the same place
    scale = (max(depth, height, width) + max(SPACING_UM)) / 1.2
    assert eyes[2][0] - eyes[0][0] == pytest.approx(0.063 * scale, rel=0.05)
    lens = UsdGeom.Camera.Get(stage, "/Specimen/Cameras/mono")
    tenths_of_mm = lens.GetFocalLengthAttr().Get() * 0.1 * 1e-6 * 1000
    assert tenths_of_mm == pytest.approx(35)


def test_unloaded_tiles_still_have_their_bounds(stage_path: Path) -> None:
    stage = Usd.Stage.Open(str(stage_path), Usd.Stage.LoadNone)
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"], useExtentsHint=True)
    box = cache.ComputeWorldBound(
        stage.GetPrimAtPath("/Specimen/Tiles/r0_c1")
    ).ComputeAlignedRange()
    assert tuple(box.GetMin()) == pytest.approx((17.5 * 0.25, -47.5 * 0.25, -0.25))
    assert tuple(box.GetMax()) == pytest.approx((35.5 * 0.25, 0.125, 15.5 * 0.5))


@pytest.mark.slow
def test_another_process_writes_the_same_bytes(stage_path: Path, tmp_path: Path) -> None:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        pool.apply(write_whole, (tmp_path / "again",))
        assert pool.apply(has_schema)  # the schema is registered before any stage is opened
    written = digests_of(stage_path.parent)
    assert written == digests_of(tmp_path / "again")
    assert not [name for name in written if "/." in name or name.startswith(".")]


def test_generated_schema_is_usds_output_for_its_source(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = assets.find_asset("schemas/usd")
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "argv", ["usdGenSchema", "schema.usda", str(tmp_path)])
    # usdGenSchema sets this variable, which would hide schemas from later processes.
    monkeypatch.setenv("USD_DISABLE_PRIM_DEFINITIONS_FOR_USDGENSCHEMA", "true")
    runpy.run_module("pxr.Usd.usdGenSchema", run_name="__main__")
    capfd.readouterr()  # discards its report
    made = (tmp_path / "generatedSchema.usda").read_text("utf-8")
    assert made == (folder / "generatedSchema.usda").read_text("utf-8")


def test_the_json_twin_of_the_schema_has_the_same_attributes() -> None:
    twin = json.loads(assets.schema_path("channel.schema.json").read_text("utf-8"))
    source = Sdf.Layer.FindOrOpen(str(assets.find_asset("schemas/usd/schema.usda")))
    attributes = source.GetPrimAtPath("/StereoCellChannelAPI").attributes
    assert twin["title"] == "StereoCellChannelAPI"
    assert set(twin["properties"]) == {attribute.name for attribute in attributes}
    json_types = {"color3f": "array", "float2": "array", "float2[]": "array"}
    json_types |= {"float": "number", "asset": "string", "token": "string", "string": "string"}
    json_types |= {"bool": "boolean"}
    json_types |= dict.fromkeys(("float4[]", "token[]", "float[]", "color4f[]"), "array")
    for attribute in attributes:
        field = twin["properties"][attribute.name]
        assert field["usdType"] == str(attribute.typeName)
        assert field["type"] == json_types[field["usdType"]]
        assert field["description"] == " ".join(attribute.documentation.split())
        default = None if attribute.default is None else np.array(attribute.default).tolist()
        assert default == pytest.approx(field.get("default"))


def test_numbers_of_2d_functions_have_an_attribute_each_and_its_default() -> None:
    twin = json.loads(assets.schema_path("channel.schema.json").read_text("utf-8"))
    for field, attribute in ATTRIBUTES.items():
        assert twin["properties"][attribute]["usdType"] == "float"
        assert twin["properties"][attribute]["default"] == getattr(TransferFunctions2d(), field)


def test_a_channel_as_json_fits_the_twin_of_its_schema(stage_path: Path) -> None:
    twin = json.loads(assets.schema_path("channel.schema.json").read_text("utf-8"))
    stage = Usd.Stage.Open(str(stage_path))
    for channel in (F_ID, EMPTY_ID):
        prim = stage.GetPrimAtPath(f"/Specimen/Channels/{channel}")
        content = {}
        for name in twin["properties"]:
            value = prim.GetAttribute(name).Get()
            if isinstance(value, Sdf.AssetPath):
                content[name] = value.path
            elif value is not None:
                content[name] = np.array(value).tolist()
        Draft202012Validator(twin).validate(content)
        assert ("stereocell:isoValue" in content) == (channel == F_ID)


def test_shipped_files_are_found_in_a_checkout_and_in_a_wheel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert assets.find_asset("usd_assets/lights.usda").is_file()
    assert assets.schema_path("bundle.schema.json").is_file()
    (tmp_path / "stereocell" / "schemas").mkdir(parents=True)
    monkeypatch.setattr(assets, "_HOMES", (tmp_path / "stereocell", tmp_path))
    assert assets.find_asset("schemas") == tmp_path / "stereocell" / "schemas"
    with pytest.raises(FileNotFoundError, match=r"nothing\.usda is neither in"):
        assets.find_asset("nothing.usda")


def test_a_volume_that_does_not_fit_its_tile_is_refused(tmp_path: Path) -> None:
    tile = make_tiles()[0]
    channel = tile.channels[0]
    cut = type(channel)(channel.channel_id, (), channel.volume[1:])
    with pytest.raises(ValueError, match=r"r0_c0/CD3_x3b5_: uint8 \(17, 50, 21\), expected"):
        write_tile(tmp_path, type(tile)(tile.id, tile.spacing_um, tile.first_um, tile.last_um,
                                        tile.own_shape, (cut,)))  # fmt: skip
    assert not list(tmp_path.iterdir())


def test_an_unwritable_folder_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "tiles").write_text("in the way")
    with pytest.raises(OutputError, match="can't be written: Not a directory"):
        write_tile(tmp_path, make_tiles()[0])
