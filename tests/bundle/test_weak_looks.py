"""The looks of a build are weaker than any opinion over its stage: a class, a variant, a scene.

Each way is composed by USD, where the material that a mesh is bound to must have the colour, and
goes through a bundle, where surface and volume must have it.
"""

from pathlib import Path

import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

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
    """Return the colours of a channel's surfaces, live and by volumes' materials, in all tiles."""
    found = set()
    for tile in _TILES:
        mesh = stage.GetPrimAtPath(f"{root}/Tiles/{tile}/CD31/CD31_{tile}")
        material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
        live = material.ComputeSurfaceSource("glslfx")[0].GetInput("diffuseColor")
        found.add(tuple(live.GetValueProducingAttributes()[0].Get()))
        found.add(tuple(material.GetInput("color").Get()))
    return found


@pytest.mark.parametrize("way", LAYERED)
def test_an_opinion_over_the_stage_recolours_a_channel_and_its_bundle(edit, tmp_path, way):
    bundle = edit(LAYERED[way])
    assert [line for line in edit.told if "is not taken over" in line] == []
    assert colors_of(Usd.Stage.Open(str(tmp_path / "edited.usda"))) == {GREEN}
    assert channel(bundle)["color"] == list(GREEN)


def scene_over(stages: dict[str, Path], path: Path) -> Usd.Stage:
    """Return a new scene at a path that references stages, each below /World by its name."""
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


def test_a_variant_set_above_a_specimen_recolours_it_alone(scene):
    palette = scene.GetPrimAtPath("/World").GetVariantSets().AddVariantSet("palette")
    palette.AddVariant("green")
    palette.SetVariantSelection("green")
    with palette.GetVariantEditContext():
        color = scene.GetPrimAtPath("/World/A/Channels/CD31").GetAttribute("inputs:color")
        color.Set(Gf.Vec3f(*GREEN))
    assert colors_of(scene, "/World/A") == {GREEN}
    assert colors_of(scene, "/World/B") != {GREEN}


@pytest.mark.parametrize("place", ["/_look", "/__class__/Specimen"])
def test_one_class_recolours_all_specimens_of_a_scene(scene, place):
    look = scene.OverridePrim(f"{place}/Channels/CD31")
    look.CreateAttribute("inputs:color", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*GREEN))
    if place == "/_look":
        for name in ("A", "B"):
            scene.GetPrimAtPath(f"/World/{name}").GetInherits().AddInherit(place)
    assert colors_of(scene, "/World/A") == colors_of(scene, "/World/B") == {GREEN}


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
    told = write(written, tmp_path / "bundle")
    assert [line for line in told if "is not taken over" in line] == []
    assert channel(tmp_path / "bundle")["color"] == list(GREEN)
