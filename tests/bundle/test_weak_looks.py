"""A build's appearances are weaker than any edit over its stage: a class, a variant, a scene.

USD composes each kind of edit, and the mesh's bound material must have the colour. Then surface
and volume of the stage's bundle must have it, too.
"""

from pathlib import Path

import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from stereocell.bundle.manifest import read_manifest
from stereocell.model.errors import StageError, StereoCellError
from stereocell.usd.read_provenance import note_on_source
from stereocell.usd.read_stage import open_stage
from support import edit_cases
from support.bundles import channel, write, write_tiles
from support.stages import edit_over

GREEN = (0.0, 1.0, 0.0)
_TILES = ("r0_c0", "r0_c1")
LAYERED = {
    "class": edit_cases.inherit_color,
    "class of all specimens": edit_cases.broadcast_color,
    "variant on the specimen": edit_cases.color_in_variant("/Specimen"),
    "variant on the channels": edit_cases.color_in_variant("/Specimen/Channels"),
    "variant on the channel": edit_cases.color_in_variant(edit_cases.CHANNEL),
}


def colors_of(stage: Usd.Stage, root: str = "/Specimen") -> set[tuple[float, ...]]:
    """Return the colours of a channel's surfaces and of its volumes' materials in all tiles."""
    found = set()
    for tile in _TILES:
        mesh = stage.GetPrimAtPath(f"{root}/Tiles/{tile}/CD31/CD31_{tile}")
        material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
        live = material.ComputeSurfaceSource("glslfx")[0].GetInput("diffuseColor")
        found.add(tuple(live.GetValueProducingAttributes()[0].Get()))
        found.add(tuple(material.GetInput("color").Get()))
    return found


@pytest.mark.parametrize("way", LAYERED)
def test_edit_over_the_stage_recolours_a_channel_and_its_bundle(edit, tmp_path, way):
    bundle = edit(LAYERED[way])
    assert [line for line in edit.lines if "is not taken over" in line] == []
    assert colors_of(Usd.Stage.Open(str(tmp_path / "edited.usda"))) == {GREEN}
    assert channel(bundle)["color"] == list(GREEN)


def scene_over(stages: dict[str, Path], path: Path) -> Usd.Stage:
    """Return a new scene, to be saved at a path, that references each stage as /World/NAME."""
    layer = Sdf.Layer.CreateNew(str(path))
    layer.defaultPrim = "World"
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1e-6)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.Xform.Define(stage, "/World")
    for name, file in stages.items():
        UsdGeom.Xform.Define(stage, f"/World/{name}").GetPrim().GetReferences().AddReference(
            str(file)
        )
    return stage


@pytest.fixture
def scene(tmp_path):
    stages = {name: write_tiles(tmp_path / name) for name in ("A", "B")}
    return scene_over(stages, tmp_path / "scene.usda")


def bundle_of(scene: Usd.Stage, folder: Path) -> tuple[list[str], Path]:
    """Save a scene and write its bundle; return the reported lines and the bundle."""
    scene.GetRootLayer().Save()
    return write(Path(scene.GetRootLayer().realPath), folder / "bundle"), folder / "bundle"


def test_a_variant_set_above_a_specimen_recolours_it_alone(scene, tmp_path):
    palette = scene.GetPrimAtPath("/World").GetVariantSets().AddVariantSet("palette")
    palette.AddVariant("green")
    palette.SetVariantSelection("green")
    with palette.GetVariantEditContext():
        color = scene.GetPrimAtPath("/World/A/Channels/CD31").GetAttribute("inputs:color")
        color.Set(Gf.Vec3f(*GREEN))
    assert colors_of(scene, "/World/A") == {GREEN}
    assert colors_of(scene, "/World/B") != {GREEN}
    for name, other in (("A", "B"), ("B", "A")):
        scene.GetPrimAtPath(f"/World/{name}").SetActive(True)
        scene.GetPrimAtPath(f"/World/{other}").SetActive(False)
        lines, bundle = bundle_of(scene, tmp_path / f"of_{name}")
        assert (channel(bundle)["color"] == list(GREEN)) == (name == "A")
        assert [line for line in lines if "is not taken over" in line] == []


@pytest.mark.parametrize("place", ["/_look", "/__class__/Specimen"])
def test_one_class_recolours_all_specimens_of_a_scene(scene, tmp_path, place):
    look = scene.CreateClassPrim("/_look") if place == "/_look" else scene.OverridePrim(place)
    path = look.GetPath().AppendPath("Channels/CD31")
    color = scene.OverridePrim(path).CreateAttribute("inputs:color", Sdf.ValueTypeNames.Color3f)
    color.Set(Gf.Vec3f(*GREEN))
    if place == "/_look":
        for name in ("A", "B"):
            scene.GetPrimAtPath(f"/World/{name}").GetInherits().AddInherit(place)
    assert colors_of(scene, "/World/A") == colors_of(scene, "/World/B") == {GREEN}
    scene.GetPrimAtPath("/World/A").SetActive(False)
    lines, bundle = bundle_of(scene, tmp_path)
    assert channel(bundle)["color"] == list(GREEN)
    assert [line for line in lines if "is not taken over" in line] == []


def test_a_scene_of_several_specimens_is_refused_by_their_names(scene, tmp_path):
    with pytest.raises(StageError, match=r"found 2 specimens, /World/A, /World/B, expected one"):
        bundle_of(scene, tmp_path)


@pytest.mark.parametrize("arc", ["reference", "payload"])
def test_scene_may_rename_and_move_a_specimen(tmp_path, arc):
    file = write_tiles(tmp_path / "A")
    scene = scene_over({}, tmp_path / "scene.usda")
    UsdGeom.Xformable(scene.GetPrimAtPath("/World")).AddTranslateOp().Set(Gf.Vec3d(100, 0, 0))
    specimen = UsdGeom.Xform.Define(scene, "/World/Shelf/Liver").GetPrim()
    if arc == "reference":
        specimen.GetReferences().AddReference(str(file))
    else:
        specimen.GetPayloads().AddPayload(str(file))
    scene.OverridePrim("/World/Shelf/Liver/Channels/CD31").CreateAttribute(
        "inputs:colour", Sdf.ValueTypeNames.Color3f
    ).Set(Gf.Vec3f(*GREEN))
    edit_cases.define_arrow(scene, "/World/Shelf/Liver/Arrow")
    edit_cases.define_arrow(scene, "/World/Shelf/Arrow")
    lines, bundle = bundle_of(scene, tmp_path)
    manifest = read_manifest(bundle)
    assert manifest["specimen"]["name"] == "two tiles"
    assert manifest["specimen"]["bounds_um"]["min"][0] == 100
    assert [layer["name"] for layer in manifest["additions"]["layers"]] == ["Arrow"]
    lost = [line for line in lines if "is not taken over" in line]
    assert ["inputs:colour" in lost[0], "outside /World/Shelf/Liver" in lost[1]] == [True, True]
    assert len(lost) == 2


@pytest.mark.parametrize("path", ["/Specimen", "/__class__/Specimen"])
def test_a_channel_that_is_hidden_at_first_stays_in_the_bundle(edit, path):
    """With any composition arc, the channel opens hidden, but stays in the panel."""

    def hide(stage: Usd.Stage) -> None:
        shown = stage.OverridePrim(f"{path}/Shown/CD31")
        shown.CreateAttribute("visibility", Sdf.ValueTypeNames.Token, False).Set("invisible")

    found = channel(edit(hide))
    assert found["opens"] is False
    assert found["tileset"]


def test_a_library_of_looks_among_the_sublayers_reaches_the_bundle(stage, tmp_path):
    library = Sdf.Layer.CreateNew(str(tmp_path / "library.usda"))
    classes = Usd.Stage.Open(library)
    UsdGeom.SetStageMetersPerUnit(classes, 1e-6)
    UsdGeom.SetStageUpAxis(classes, UsdGeom.Tokens.y)
    edit_cases.broadcast_color(classes)
    library.Save()

    def add(composed: Usd.Stage) -> None:
        composed.GetRootLayer().subLayerPaths.append("./library.usda")

    written = edit_over(tmp_path / "edited.usda", stage, add)
    lines = write(written, tmp_path / "bundle")
    assert [line for line in lines if "is not taken over" in line] == []
    assert channel(tmp_path / "bundle")["color"] == list(GREEN)


@pytest.mark.parametrize("instance", ["/World/A", "/World"])
def test_a_specimen_that_is_an_instance_is_refused_with_the_line_to_write(
    tmp_path: Path, instance: str
) -> None:
    stage = write_tiles(tmp_path / "A")
    group = scene_over({"A": stage}, tmp_path / "group.usda")
    if instance == "/World":
        group.GetRootLayer().Save()
        group = scene_over({}, tmp_path / "scene.usda")
        group.GetPrimAtPath("/World").GetReferences().AddReference(str(tmp_path / "group.usda"))
    group.GetPrimAtPath(instance).SetInstanceable(True)
    with pytest.raises(
        StageError, match=f"{instance}: found an instance, .* set its instanceable to false"
    ):
        bundle_of(group, tmp_path)


def test_a_scene_without_a_specimen_is_refused_before_its_default_prim(tmp_path: Path) -> None:
    stage = write_tiles(tmp_path / "A")
    scene = scene_over({"tile": stage.parent / "tiles/r0_c0/tile.usdc"}, tmp_path / "scene.usda")
    with pytest.raises(
        StageError, match=r"found no prim /Specimen, expected the stage\.usda of a build"
    ):
        bundle_of(scene, tmp_path)


def test_a_layer_over_the_stage_of_another_source_is_named(tmp_path: Path) -> None:
    stages = [write_tiles(tmp_path / name) for name in "AB"]
    for stage, fingerprint in zip(stages, ("a" * 64, "b" * 64), strict=True):
        layer = Sdf.Layer.FindOrOpen(str(stage))
        layer.customLayerData = {"stereocell": {"fingerprint": fingerprint}}
        layer.Save()
    assert note_on_source(open_stage(stages[0]), stages[0]) == ""
    note = note_on_source(open_stage(stages[1]), stages[0])
    assert "B/stage.usda: shows another specimen (fingerprint bbbbbbbbbbbb) than" in note


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("/Specimen/Tiles/r0_c0", "/Specimen/Tiles/left"),
        (edit_cases.CHANNEL, "/Specimen/Channels/vessels"),
        (edit_cases.MESH, f"{edit_cases.BRANCH}/mesh"),
    ],
)
def test_a_flattened_stage_whose_prims_were_renamed_is_refused(
    tmp_path: Path, old: str, new: str
) -> None:
    stage = Usd.Stage.Open(str(write_tiles(tmp_path / "A")))
    flat = Usd.Stage.Open(stage.Flatten())
    editor = Usd.NamespaceEditor(flat)
    assert editor.MovePrimAtPath(old, new)
    editor.ApplyEdits()
    file = tmp_path / "A/flat.usda"
    flat.GetRootLayer().Export(str(file))
    with pytest.raises(StereoCellError, match="found a renamed tile, channel or mesh, expected"):
        write(file, tmp_path / "bundle")


def test_a_flattened_stage_under_another_root_has_its_surfaces(tmp_path: Path) -> None:
    stage = Usd.Stage.Open(str(write_tiles(tmp_path / "A")))
    flat = Usd.Stage.Open(stage.Flatten())
    editor = Usd.NamespaceEditor(flat)
    assert editor.MovePrimAtPath("/Specimen", "/Kidney")
    editor.ApplyEdits()
    flat.GetRootLayer().defaultPrim = "Kidney"
    file = tmp_path / "A/flat.usda"
    flat.GetRootLayer().Export(str(file))
    write(file, tmp_path / "bundle")
    assert len(list((tmp_path / "bundle").rglob("lod0.glb"))) == len(_TILES)
