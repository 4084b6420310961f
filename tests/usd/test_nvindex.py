"""nvindex.usda has the channels' transfer functions in the schema of NVIDIA IndeX."""

from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdShade

from support.bundles import files, write, write_tiles
from support.stages import BALL_ID, COLORS, F_ID, FUNCTIONS, TILES, leaf, write_whole


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Usd.Stage:
    path = write_whole(tmp_path_factory.mktemp("stage"))
    return Usd.Stage.Open(str(path.with_name("nvindex.usda")))


def test_nvindex_usda_is_the_stage_and_enables_the_renderer(stage: Usd.Stage) -> None:
    assert stage.GetCompositionErrors() == []
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1e-6
    assert stage.GetDefaultPrim().GetPath() == "/Specimen"
    settings = stage.GetRootLayer().customLayerData["renderSettings"]
    assert settings["rtx:index:compositeEnabled"] is True


@pytest.mark.parametrize("function", FUNCTIONS)
@pytest.mark.parametrize(("channel", "color"), [(F_ID, COLORS[0]), (BALL_ID, COLORS[1])])
def test_volume_has_the_colour_map_of_its_transfer_function(
    stage: Usd.Stage, channel: str, color: tuple[float, ...], function: str
) -> None:
    place = f"/Specimen/Channels/{channel}"
    variants = stage.GetPrimAtPath(place).GetVariantSet("transferFunction")
    variants.SetVariantSelection(function)
    for tile in TILES:
        selected = stage.GetPrimAtPath(f"/Specimen/Tiles/{tile}").GetVariantSet("representation")
        selected.SetVariantSelection("volume")
        volume = stage.GetPrimAtPath(leaf(tile, channel, "_volume"))
        assert volume.GetAttribute("nvindex:composite").Get() is True
        assert volume.GetAttribute("omni:rtx:skip").Get() is True
        material, _ = UsdShade.MaterialBindingAPI(volume).ComputeBoundMaterial()
        shader, output, _ = material.ComputeVolumeSource("nvindex")
        assert (shader.GetPrim().GetName(), output) == ("VolumeShader", "volume")
        (given,) = shader.GetInput("colormap").GetAttr().GetConnections()
        colormap = stage.GetPrimAtPath(given.GetPrimPath())
        assert colormap.GetTypeName() == "Colormap"
        assert colormap.GetAttribute("colormapSource").Get() == "rgbaPoints"
        rgba = np.array(colormap.GetAttribute("rgbaPoints").Get())
        places = np.array(colormap.GetAttribute("xPoints").Get())
        assert np.allclose(np.column_stack([places, rgba[:, 3]]), FUNCTIONS[function])
        assert np.allclose(rgba[:, :3], color)


def test_bundle_of_nvindex_usda_is_that_of_the_stage(tmp_path: Path) -> None:
    built = write_tiles(tmp_path / "stage")
    assert write(built, tmp_path / "a") == []
    assert write(built.with_name("nvindex.usda"), tmp_path / "b") == []
    assert files(tmp_path / "a") == files(tmp_path / "b")
