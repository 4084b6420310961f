"""By UsdLux's definitions, the stage's lights make the specimen neither black nor white."""

import io
import zipfile
from pathlib import Path

import imagecodecs
import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray
from PIL import Image
from pxr import Sdf, Usd, UsdGeom, UsdLux

from stereocell.storage.assets import find_asset
from stereocell.usd.validate import validate_usdz
from stereocell.usd.write_usdz import write_usdz
from support.stages import HEAD, write_whole

ROOT = Path(__file__).parents[2]
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # weights of linear Rec. 709
ALBEDO = 0.5  # reflectance of a mid grey, matt surface
LIGHTS = "/Specimen/Lights"


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


def read_image(asset: Sdf.AssetPath) -> NDArray[np.float64]:
    """Return a dome's image, (height, width, 3), from a folder or a usdz."""
    package, _, inner = asset.resolvedPath.partition("[")
    if not inner:
        return np.array(OpenEXR.File(package).channels()["RGB"].pixels, np.float64)
    packed = Image.open(io.BytesIO(zipfile.ZipFile(package).read(inner.rstrip("]"))))
    encoded = np.asarray(packed, np.float64) / 255
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def light_of_dome(dome: UsdLux.DomeLight, normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the irradiance (r, g, b) of a surface by a dome's latlong image.

    The image's centre shines from +z, its left half from +x, and its top from +y.
    """
    image = read_image(dome.GetTextureFileAttr().Get())
    height, width, _ = image.shape
    down = (np.arange(height) + 0.5)[:, None] / height * np.pi
    along = np.pi - (np.arange(width) + 0.5)[None, :] / width * 2 * np.pi
    x, y, z = np.sin(down) * np.sin(along), np.cos(down), np.sin(down) * np.cos(along)
    towards = np.stack(np.broadcast_arrays(x, y, z), axis=-1)
    solid_angle = np.sin(down) * (np.pi / height) * (2 * np.pi / width)
    weight = np.clip(towards @ normal, 0, None) * solid_angle
    return (image * weight[..., None]).sum(axis=(0, 1))


def irradiance(stage: Usd.Stage, normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the irradiance (r, g, b) of a surface by all lights of a stage, without shadows."""
    total = np.zeros(3)
    for prim in stage.GetPrimAtPath(LIGHTS).GetChildren():
        light = UsdLux.LightAPI(prim)
        power = light.GetIntensityAttr().Get() * 2 ** light.GetExposureAttr().Get()
        radiance = power * np.array(light.GetColorAttr().Get())
        if prim.IsA(UsdLux.DomeLight):
            total += radiance * light_of_dome(UsdLux.DomeLight(prim), normal)
            continue
        assert prim.IsA(UsdLux.DistantLight)
        half = np.radians(UsdLux.DistantLight(prim).GetAngleAttr().Get() / 2)
        size = np.pi * np.sin(half) ** 2  # with `normalize`, UsdLux divides the radiance by this
        if light.GetNormalizeAttr().Get():
            radiance = radiance / size
        towards = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim))[2, :3]
        total += radiance * size * max(float(towards @ normal), 0)
    return total


def luminance(stage: Usd.Stage) -> float:
    """Return the luminance of a mid grey surface that faces the stage's cameras."""
    return float(ALBEDO / np.pi * irradiance(stage, np.array([0.0, 0, 1])) @ LUMINANCE)


def test_grey_surface_is_neither_too_dark_nor_too_bright(stage_path: Path) -> None:
    assert 0.15 < luminance(Usd.Stage.Open(str(stage_path))) < 0.7


def test_each_distant_light_makes_the_specimen_brighter(stage_path: Path) -> None:
    """Without `normalize`, a light of 2 degrees would be a thousand times weaker."""
    stage = Usd.Stage.Open(str(stage_path))
    whole = luminance(stage)
    for name in ("key", "fill"):
        light = stage.GetPrimAtPath(f"{LIGHTS}/{name}")
        light.SetActive(False)
        assert luminance(stage) < 0.97 * whole
        light.SetActive(True)


def test_image_of_the_dome_is_the_viewers_studio() -> None:
    studio = (ROOT / "viewer_gltf/public/environments/studio.hdr").read_bytes()
    image = OpenEXR.File(str(find_asset("usd_assets/studio.exr"))).channels()["RGB"].pixels
    np.testing.assert_array_equal(image, imagecodecs.rgbe_decode(studio))


def test_the_usdz_has_the_same_light(stage_path: Path, tmp_path: Path) -> None:
    write_usdz(stage_path, tmp_path / "s.usdz")
    assert validate_usdz(tmp_path / "s.usdz") == []
    built, small = (Usd.Stage.Open(str(path)) for path in (stage_path, tmp_path / "s.usdz"))
    normal = np.array([0.36, 0.48, 0.8])
    np.testing.assert_allclose(irradiance(small, normal), irradiance(built, normal), rtol=0.01)


def test_image_with_the_sun_is_copied_unchanged(stage_path: Path, tmp_path: Path) -> None:
    """In 8 bits, only the sun would remain visible."""
    pixels = np.full((8, 16, 3), 0.1, np.float32)
    pixels[2, 3] = 5000
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": pixels}).write(str(tmp_path / "sun.exr"))
    dome = 'over "dome"\n{\nasset inputs:texture:file = @./sun.exr@\n}'
    layer = tmp_path / "edit.usda"
    lights = f'over "Lights"\n{{\n{dome}\n}}'
    layer.write_text(f'{HEAD}subLayers = [@{stage_path}@])\nover "Specimen"\n{{\n{lights}\n}}\n')
    write_usdz(layer, tmp_path / "s.usdz")
    archive = zipfile.ZipFile(tmp_path / "s.usdz")
    assert archive.read("textures/dome.exr") == (tmp_path / "sun.exr").read_bytes()


@pytest.mark.parametrize("edit", ["active = false", 'token visibility = "invisible"'])
def test_inactive_and_hidden_lights_are_not_in_the_usdz(
    stage_path: Path, tmp_path: Path, edit: str
) -> None:
    path = tmp_path / "edit.usda"
    metadata, body = (f"({edit})", "") if "active" in edit else ("", edit)
    path.write_text(
        f'{HEAD}subLayers = [@{stage_path}@])\nover "Specimen"\n{{\n'
        f'over "Lights" {metadata}\n{{\n{body}\n}}\n}}\n'
    )
    write_usdz(path, tmp_path / "s.usdz")
    assert not Usd.Stage.Open(str(tmp_path / "s.usdz")).GetPrimAtPath(LIGHTS)
    assert not [name for name in zipfile.ZipFile(tmp_path / "s.usdz").namelist() if "dome" in name]
