"""The bundle has specimen.usdz of the composed stage, or states why it has none."""

import hashlib

from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from stereocell.bundle import write_ar
from support.bundles import load, write
from support.stages import edit_over


def export(stage, folder, change=None):
    """Write the bundle of a stage or of a layer with a change; return it and the reported lines."""
    path = edit_over(folder / "edited.usda", stage, change) if change else stage
    return folder / "bundle", write(path, folder / "bundle")


def colors_of(bundle):
    small = Usd.Stage.Open(str(bundle / "specimen.usdz"))
    shaders = (UsdShade.Shader(prim) for prim in small.Traverse() if prim.IsA(UsdShade.Shader))
    found = [shader.GetInput("diffuseColor") for shader in shaders]
    return [tuple(round(v, 3) for v in each.Get()) for each in found if each and each.Get()]


def test_usdz_is_in_the_manifest_and_in_the_list(stage, tmp_path):
    bundle, lines = export(stage, tmp_path)
    content = (bundle / "specimen.usdz").read_bytes()
    entry = {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
    manifest = load(bundle / "manifest.json")
    assert manifest["usdz"] == {"path": "specimen.usdz", **entry}
    assert manifest["usdz_reason"] == ""
    assert load(bundle / "files.json")["specimen.usdz"] == entry
    assert not [line for line in lines if "usdz" in line]


def test_usdz_shows_an_edit_of_the_stage(stage, tmp_path):
    plain, _ = export(stage, tmp_path / "plain")
    assert (0.1, 0.9, 0.2) not in colors_of(plain)
    (tmp_path / "edited").mkdir()

    def paint(over):
        over.OverridePrim("/Specimen/Channels/CD31").CreateAttribute(
            "inputs:color", Sdf.ValueTypeNames.Color3f
        ).Set(Gf.Vec3f(0.1, 0.9, 0.2))

    edited, _ = export(stage, tmp_path / "edited", paint)
    assert (0.1, 0.9, 0.2) in colors_of(edited)


def test_large_usdz_is_left_out_and_reported(stage, tmp_path, monkeypatch):
    monkeypatch.setattr(write_ar, "MAX_USDZ_BYTES", 1000)
    bundle, lines = export(stage, tmp_path)
    assert not (bundle / "specimen.usdz").exists()
    manifest = load(bundle / "manifest.json")
    assert manifest["usdz"] is None
    assert "above the limit of" in manifest["usdz_reason"]
    assert "specimen.usdz" not in load(bundle / "files.json")
    assert lines == [f"no specimen.usdz: {manifest['usdz_reason']}"]


def test_stage_without_a_visible_surface_has_no_usdz(stage, tmp_path):
    def hide(over):
        for tile in list(over.GetPrimAtPath("/Specimen/Tiles").GetChildren()):
            tile.Load()
            for prim in Usd.PrimRange(tile):
                if prim.IsA(UsdGeom.Mesh):
                    UsdGeom.Imageable(prim).MakeInvisible()

    bundle, lines = export(stage, tmp_path, hide)
    assert load(bundle / "manifest.json")["usdz_reason"] == "no surface is drawn"
    assert lines == ["no specimen.usdz: no surface is drawn"]
