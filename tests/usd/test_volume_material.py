"""The layer of docs/stage-volumes.md gives the volumes of all tiles a MaterialX shader."""

import re
from pathlib import Path

import pytest
from pxr import Usd, UsdShade

from stereocell.usd.validate import validate_stage
from support.stages import COLORS, F_ID, TILES, leaf, write_whole

DOCS = Path(__file__).parents[2] / "docs" / "stage-volumes.md"


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


@pytest.fixture
def over(stage_path: Path, tmp_path: Path) -> Path:
    layers = re.findall(r"```usda\n(.*?)```", DOCS.read_text("utf-8"), re.DOTALL)
    (layer,) = (layer for layer in layers if "ND_volume" in layer)
    path = tmp_path / "volume.usda"
    named = layer.replace("CD31", F_ID).replace("out/mine/stage/stage.usda", str(stage_path))
    path.write_text(named)
    return path


def test_the_stage_itself_has_no_volume_shader(stage_path: Path) -> None:
    stage = Usd.Stage.Open(str(stage_path))
    materials = [UsdShade.Material(p) for p in stage.Traverse() if p.IsA(UsdShade.Material)]
    assert materials
    for material in materials:
        assert not any(material.ComputeVolumeSource(c)[0] for c in ("", "mtlx"))


def test_the_layer_gives_all_tiles_a_volume_of_the_channels_colour(over: Path) -> None:
    stage = Usd.Stage.Open(str(over))
    for tile in TILES:
        tile_prim = stage.GetPrimAtPath(f"/Specimen/Tiles/{tile}")
        tile_prim.GetVariantSet("representation").SetVariantSelection("volume")
        volume = stage.GetPrimAtPath(leaf(tile, F_ID, "_volume"))
        material, _ = UsdShade.MaterialBindingAPI(volume).ComputeBoundMaterial()
        shader, _, _ = material.ComputeVolumeSource("mtlx")
        assert shader.GetShaderId() == "ND_volume"
        for name, node in (("vdf", "ND_anisotropic_vdf"), ("scattering", None)):
            (source,) = shader.GetInput(name).GetConnectedSources()[0]
            shader = UsdShade.Shader(source.source.GetPrim())
            assert shader.GetShaderId() == (node or "ND_convert_color3_vector3")
        (color,) = shader.GetInput("in").GetValueProducingAttributes()
        assert color.Get() == pytest.approx(COLORS[0])


def test_usds_validators_without_materialx_refuse_it(over: Path) -> None:
    """The stage has no such material for this reason. Once this test fails, it could have one."""
    rules = {finding.rule for finding in validate_stage(over)}
    assert rules == {"usdShadeValidators:ShaderSdrCompliance.MissingShaderIdInRegistry"}
