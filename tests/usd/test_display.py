"""display.usda shows the stage at the size of everyday things."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdValidation

from stereocell.model.errors import StageError
from stereocell.usd.layer import DISPLAY_SCALE
from stereocell.usd.read_stage import open_stage
from support.stages import COLORS, F_ID, leaf, write_whole

SCALE = 10_000  # the F is 12 um high


@pytest.fixture
def stage_path(tmp_path: Path) -> Path:
    return write_whole(tmp_path)


def display_of(stage_path: Path) -> Usd.Stage:
    return Usd.Stage.Open(str(stage_path.with_name("display.usda")))


def bounds(prim: Usd.Prim) -> NDArray[np.float64]:
    """Return the lowest and the highest corner in the world, (2, 3)."""
    boxes = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_])
    found = boxes.ComputeWorldBound(prim).ComputeAlignedRange()
    return np.array([found.GetMin(), found.GetMax()])


def at_display(path: str) -> str:
    return f"/F{path}"


def test_surfaces_are_enlarged_by_a_transform(stage_path: Path) -> None:
    true, display = Usd.Stage.Open(str(stage_path)), display_of(stage_path)
    assert true.GetPrimAtPath("/Specimen").GetAttribute(DISPLAY_SCALE).Get() == SCALE
    assert UsdGeom.GetStageMetersPerUnit(display) == 1
    path = leaf("r0_c0", F_ID)
    um = bounds(true.GetPrimAtPath(path))
    metres = bounds(display.GetPrimAtPath(at_display(path)))
    np.testing.assert_allclose(metres, um * 1e-6 * SCALE, rtol=1e-6)


def test_edit_of_a_channel_reaches_its_surfaces_in_display_usda(stage_path: Path) -> None:
    display = display_of(stage_path)
    mesh = display.GetPrimAtPath(at_display(leaf("r0_c0", F_ID)))
    material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
    color = material.GetInput("color")
    assert color.Get() == Gf.Vec3f(*COLORS[0])
    with Usd.EditContext(display, display.GetSessionLayer()):
        channel = display.GetPrimAtPath(at_display(f"/Specimen/Channels/{F_ID}"))
        channel.GetAttribute("inputs:color").Set(Gf.Vec3f(0, 1, 0))
    assert color.Get() == Gf.Vec3f(0, 1, 0)


def test_cameras_see_the_specimen_like_those_of_the_stage(stage_path: Path) -> None:
    true, display = Usd.Stage.Open(str(stage_path)), display_of(stage_path)
    cameras = [prim for prim in display.Traverse() if prim.IsA(UsdGeom.Camera)]
    assert [str(prim.GetPath()) for prim in cameras] == [
        f"/F/Cameras/{name}" for name in ("mono", "left", "right")
    ]
    for prim in cameras:
        there = UsdGeom.Camera(prim).GetCamera()
        here = UsdGeom.Camera(true.GetPrimAtPath(f"/Specimen/Cameras/{prim.GetName()}")).GetCamera()
        eye, other = (np.array(one.transform.ExtractTranslation()) for one in (there, here))
        np.testing.assert_allclose(eye, other * 1e-6 * SCALE, rtol=1e-6)
        near, far = (one.clippingRange for one in (there, here))
        assert near.min == pytest.approx(far.min * 1e-6 * SCALE)
        assert there.frustum.window.GetSize() == pytest.approx(here.frustum.window.GetSize())


def test_display_stage_is_valid_and_follows_a_moved_folder(
    stage_path: Path, tmp_path: Path
) -> None:
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    found = UsdValidation.ValidationContext(validators).Validate(display_of(stage_path))
    assert [error.GetMessage() for error in found] == []
    layer = Sdf.Layer.FindOrOpen(str(stage_path.with_name("display.usda")))
    assert list(layer.GetExternalReferences()) == ["./stage.usda"]
    assert "enlarged 10000 times. The size of the specimen is 9 x 12 x 8 um" in layer.documentation


def test_root_states_the_same_asset_as_the_stage(stage_path: Path) -> None:
    true, display = Usd.Stage.Open(str(stage_path)), display_of(stage_path)
    ours, theirs = (Usd.ModelAPI(one.GetDefaultPrim()) for one in (true, display))
    assert theirs.GetAssetVersion() == ours.GetAssetVersion() != ""
    assert theirs.GetAssetName() == ours.GetAssetName()
    assert theirs.GetAssetIdentifier().path == "./display.usda"
    assert "9 x 12 x 8 um in true size" in display.GetDefaultPrim().GetDocumentation()


@pytest.mark.parametrize("arc", ["sublayer", "reference"])
def test_layer_over_display_usda_is_refused_with_the_name_of_the_stage(
    stage_path: Path, tmp_path: Path, arc: str
) -> None:
    layer = Sdf.Layer.CreateNew(str(tmp_path / "mine.usda"))
    file = str(stage_path.with_name("display.usda"))
    if arc == "sublayer":
        layer.subLayerPaths = [file]
    else:
        shot = Sdf.CreatePrimInLayer(layer, "/Shot")
        shot.specifier = Sdf.SpecifierDef
        shot.referenceList.prependedItems.append(Sdf.Reference(file))
    layer.Save()
    with pytest.raises(StageError, match=r"lies over display\.usda, .*, expected stage\.usda: put"):
        open_stage(tmp_path / "mine.usda")
