"""USD in one file: valid, with edits, of the tiles and channels asked for, the same each time."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from pxr import Gf, Usd, UsdGeom, UsdShade, UsdUtils

from stereocell.export.options import ExportOptions
from stereocell.export.write import export_stage
from stereocell.usd.validate import validate_stage, validate_usdz
from support import spheres
from support.bundles import CD31


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


def test_a_flattened_stage_names_its_files_from_where_it_lies(
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
    """Of Windows: from one drive to another no relative path leads."""

    def refuse(*_: object) -> str:
        raise ValueError("path is on mount 'C:', start on mount 'D:'")

    monkeypatch.setattr(os.path, "relpath", refuse)
    export_stage(sphere_stage, tmp_path / "s.usda", options=ExportOptions())
    layers, assets, lost = UsdUtils.ComputeAllDependencies(str(tmp_path / "s.usda"))
    assert (len(layers), lost) == (1, [])
    assert all(Path(asset).is_relative_to(sphere_stage.parent) for asset in assets)
