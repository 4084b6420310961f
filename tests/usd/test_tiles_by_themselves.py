"""A tile's layer opens by itself in the channels' colours; the stage's colours are stronger."""

from pathlib import Path

import pytest
from pxr import Gf, Usd, UsdGeom, UsdShade

from stereocell.export.options import ExportOptions
from stereocell.export.write import export_stage
from stereocell.model.identifiers import to_identifier
from support.object_stage import COLORS as CLASS_COLORS
from support.object_stage import TYPES, write_objects
from support.stages import BALL_ID, COLORS, F_ID, TILES, edit_over, leaf, write_whole


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


def colors_of(mesh: Usd.Prim) -> tuple[Gf.Vec3f, Gf.Vec3f]:
    """Return the colour of a mesh's UsdPreviewSurface, and the display colour of the mesh."""
    material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
    shader, _, _ = material.ComputeSurfaceSource()
    assert shader.GetShaderId() == "UsdPreviewSurface"
    (display,) = UsdGeom.Gprim(mesh).GetDisplayColorAttr().Get()
    return shader.GetInput("diffuseColor").Get(), display


@pytest.mark.parametrize("tile", TILES)
@pytest.mark.parametrize("lod", ["lod0", "lod1", "lod2"])
def test_a_tile_shows_its_colours_without_the_stage(stage_path: Path, tile: str, lod: str) -> None:
    stage = Usd.Stage.Open(str(stage_path.parent / "tiles" / tile / "tile.usdc"))
    stage.GetDefaultPrim().GetVariantSet("lod").SetVariantSelection(lod)
    assert stage.GetCompositionErrors() == []
    for channel, color in zip((F_ID, BALL_ID), COLORS[:2], strict=True):
        mesh = stage.GetPrimAtPath(f"/{tile}/{channel}/{channel}_{tile}")
        assert colors_of(mesh) == (Gf.Vec3f(*color), Gf.Vec3f(*color))


def test_the_colour_of_the_stage_is_stronger_than_that_of_the_tile(
    stage_path: Path, tmp_path: Path
) -> None:
    green = Gf.Vec3f(0, 1, 0)

    def recolor(stage: Usd.Stage) -> None:
        channel = UsdShade.Material.Get(stage, f"/Specimen/Channels/{F_ID}")
        UsdShade.Shader(channel.GetPrim().GetChild("surface")).GetInput("diffuseColor").Set(green)
        channel.GetInput("color").Set(green)

    path = edit_over(tmp_path / "edited.usda", stage_path, recolor)
    stage = Usd.Stage.Open(str(path))
    for tile in TILES:
        assert colors_of(stage.GetPrimAtPath(leaf(tile, F_ID)))[0] == green
    # In a flattened copy, the meshes themselves also have the edited colour.
    flat = tmp_path / "flat.usdc"
    export_stage(path, flat, options=ExportOptions(lod=1))
    flattened = Usd.Stage.Open(str(flat))
    for tile in TILES:
        assert colors_of(flattened.GetPrimAtPath(leaf(tile, F_ID))) == (green, green)
        kept = Gf.Vec3f(*COLORS[1])
        assert colors_of(flattened.GetPrimAtPath(leaf(tile, BALL_ID))) == (kept, kept)


def test_classes_of_objects_have_their_colours_without_the_stage(tmp_path: Path) -> None:
    folder = write_objects(tmp_path / "objects").parent
    stage = Usd.Stage.Open(str(folder / "tiles/r0_c0/tile.usdc"))
    mesh = UsdGeom.Mesh.Get(stage, "/r0_c0/cells/cells_r0_c0")
    found = {}
    for subset in UsdGeom.Subset.GetAllGeomSubsets(mesh):
        material, _ = UsdShade.MaterialBindingAPI(subset).ComputeBoundMaterial()
        shader, _, _ = material.ComputeSurfaceSource()
        found[subset.GetPrim().GetName()] = shader.GetInput("diffuseColor").Get()
    names = [f"class_{to_identifier(name)}" for name in TYPES]
    assert found == dict(zip(names, map(Gf.Vec3f, CLASS_COLORS), strict=True))
