"""USD in one file is valid, reproducible, and has edits and only the chosen tiles and channels."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade, UsdUtils

from stereocell.export.options import ExportOptions
from stereocell.export.write import export_stage
from stereocell.usd.validate import validate_stage, validate_usdz
from support import spheres
from support.bundles import CD31
from support.edit_cases import define_arrow


def meshes(stage: Usd.Stage) -> dict[str, UsdGeom.Mesh]:
    found = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    return {mesh.GetPrim().GetName(): mesh for mesh in found}


def color(mesh: UsdGeom.Mesh) -> Gf.Vec3f:
    material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
    shader = material.ComputeSurfaceSource()[0]
    return shader.GetInput("diffuseColor").GetValueProducingAttributes()[0].Get()


@pytest.mark.parametrize("ending", ["usdz", "usdc", "usda"])
def test_one_file_has_the_level_the_edit_and_the_tiles(
    edited: Callable[..., Path], tmp_path: Path, ending: str
) -> None:
    layer = edited(
        lambda s: s.GetAttributeAtPath(f"{CD31}.inputs:color").Set(Gf.Vec3f(0.25, 0.5, 0.75))
    )
    path, again, part = (tmp_path / f"{name}.{ending}" for name in ("s", "again", "part"))
    export_stage(layer, path, options=ExportOptions(lod=1))
    stage = Usd.Stage.Open(str(path))
    found = meshes(stage)
    assert set(found) == {"CD31_r0_c0", "CD31_r0_c1"}
    faces = sum(len(mesh.GetFaceVertexCountsAttr().Get()) for mesh in found.values())
    assert faces == pytest.approx(4 * spheres.LEVELS[1][0] ** 2, rel=0.1)
    assert all(color(mesh) == Gf.Vec3f(0.25, 0.5, 0.75) for mesh in found.values())
    assert (validate_usdz if ending == "usdz" else validate_stage)(path) == []
    export_stage(layer, again, options=ExportOptions(lod=1))
    assert path.read_bytes() == again.read_bytes()
    export_stage(layer, part, options=ExportOptions(tiles=("r0_c1",), channels=("CD31",)))
    cut = Usd.Stage.Open(str(part))
    assert set(meshes(cut)) == {"CD31_r0_c1"}
    assert "Hoechst" not in cut.ExportToString()


def test_flattened_stage_names_its_files_relative_to_itself(
    sphere_stage: Path, tmp_path: Path
) -> None:
    export_stage(sphere_stage, tmp_path / "s.usda", options=ExportOptions())
    layers, assets, lost = UsdUtils.ComputeAllDependencies(str(tmp_path / "s.usda"))
    assert (len(layers), lost) == (1, [])
    assert assets
    assert str(sphere_stage.parent) not in (tmp_path / "s.usda").read_text("utf-8")


def test_files_on_another_drive_are_named_from_its_root(
    sphere_stage: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On Windows, no relative path leads from one drive to another."""

    def refuse(*_: object) -> str:
        raise ValueError("path is on mount 'C:', start on mount 'D:'")

    monkeypatch.setattr(os.path, "relpath", refuse)
    export_stage(sphere_stage, tmp_path / "s.usda", options=ExportOptions())
    layers, assets, lost = UsdUtils.ComputeAllDependencies(str(tmp_path / "s.usda"))
    assert (len(layers), lost) == (1, [])
    assert all(Path(asset).is_relative_to(sphere_stage.parent) for asset in assets)


@pytest.mark.parametrize("ending", ["usdz", "usdc"])
def test_a_scale_enlarges_the_file_and_the_line_has_both_sizes(
    sphere_stage: Path, tmp_path: Path, ending: str
) -> None:
    true, large = tmp_path / f"true.{ending}", tmp_path / f"large.{ending}"
    export_stage(sphere_stage, true, options=ExportOptions(lod=1, scale=1))
    line = export_stage(sphere_stage, large, options=ExportOptions(lod=1, scale=2000))
    assert "40 x 20 x 18 mm, 2000 times the specimen of 20 x 10 x 9 um" in line
    stages = [Usd.Stage.Open(str(path)) for path in (true, large)]
    found = [bounds(stage) * UsdGeom.GetStageMetersPerUnit(stage) for stage in stages]
    np.testing.assert_allclose(found[1], found[0] * 2000, rtol=1e-5)
    np.testing.assert_allclose(np.ptp(found[0], axis=0), 2 * spheres.RADIUS * 1e-6, rtol=0.02)
    assert (validate_usdz if ending == "usdz" else validate_stage)(large) == []


def test_the_cameras_of_an_enlarged_file_see_what_they_saw(
    sphere_stage: Path, tmp_path: Path
) -> None:
    """A camera's clipping range is in units of the stage; transforms above do not scale it."""
    cameras = []
    for scale in (1.0, 2000.0):
        path = tmp_path / f"{scale:g}.usda"
        export_stage(sphere_stage, path, options=ExportOptions(lod=1, scale=scale))
        stage = Usd.Stage.Open(str(path))
        cameras.append(UsdGeom.Camera(stage.GetPrimAtPath("/Specimen/Cameras/left")).GetCamera())
    true, large = cameras
    eyes = [np.array(camera.transform.ExtractTranslation()) for camera in cameras]
    np.testing.assert_allclose(eyes[1], eyes[0] * 2000)
    assert large.clippingRange.max == pytest.approx(true.clippingRange.max * 2000)
    assert large.focusDistance == pytest.approx(true.focusDistance * 2000)
    assert large.frustum.window == true.frustum.window


def test_additions_lights_and_cameras_are_enlarged_with_the_specimen(
    edited: Callable[[Callable[[Usd.Stage], object]], Path], tmp_path: Path
) -> None:
    kit = Usd.Stage.CreateNew(str(tmp_path / "kit.usda"))
    UsdGeom.SetStageUpAxis(kit, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(kit, 1e-6)
    kit.SetDefaultPrim(UsdGeom.Xform.Define(kit, "/Kit").GetPrim())
    define_arrow(kit, "/Kit/Arrow")
    kit.Save()

    def change(stage: Usd.Stage) -> None:
        group = UsdGeom.Xform.Define(stage, "/Specimen/Annotations/Kit")
        group.GetPrim().GetPayloads().AddPayload("./kit.usda")
        group.AddTranslateOp().Set(Gf.Vec3d(0, 1, 0))
        define_arrow(stage)
        camera = UsdGeom.Camera.Define(stage, "/Specimen/Cameras/close")
        camera.AddTransformOp().Set(Gf.Matrix4d(1).SetTranslate(Gf.Vec3d(10, -5, 24)))
        lamp = UsdLux.SphereLight.Define(stage, "/Specimen/Lights/Lamp")
        lamp.CreateNormalizeAttr(True)
        lamp.CreateIntensityAttr(6.0)
        lamp.AddTranslateOp().Set(Gf.Vec3d(0, 40, 0))

    path = tmp_path / "large.usda"
    export_stage(edited(change), path, options=ExportOptions(lod=1, scale=100.0))
    stage = Usd.Stage.Open(str(path))
    boxes = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_])
    for name, low, high in (
        ("Arrow", (8, 0, 4), (12, 9, 4)),
        ("Kit/Arrow", (8, 1, 4), (12, 10, 4)),
    ):
        prim = stage.GetPrimAtPath(f"/Specimen/Annotations/{name}")
        box = boxes.ComputeWorldBound(prim).ComputeAlignedRange()
        found = np.array([box.GetMin(), box.GetMax()])
        assert found == pytest.approx(100 * np.array([low, high], float))
    places = UsdGeom.XformCache()
    camera = places.GetLocalToWorldTransform(stage.GetPrimAtPath("/Specimen/Cameras/close"))
    assert camera.ExtractTranslation() == Gf.Vec3d(1000, -500, 2400)
    lamp = stage.GetPrimAtPath("/Specimen/Lights/Lamp")
    assert places.GetLocalToWorldTransform(lamp).ExtractTranslation() == Gf.Vec3d(0, 4000, 0)
    assert lamp.GetAttribute("inputs:intensity").Get() == pytest.approx(6e4)


def bounds(stage: Usd.Stage) -> NDArray[np.float64]:
    """Return the lowest and the highest corner of all meshes in the world, (2, 3)."""
    boxes = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_])
    found = [boxes.ComputeWorldBound(mesh.GetPrim()) for mesh in meshes(stage).values()]
    ranges = [one.ComputeAlignedRange() for one in found]
    low = np.min([one.GetMin() for one in ranges], axis=0)
    return np.array([low, np.max([one.GetMax() for one in ranges], axis=0)])
