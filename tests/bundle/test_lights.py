"""Lights of a layer over the stage reach the bundle as lamps, and as the light of domes."""

import imagecodecs
import numpy as np
import OpenEXR
import pytest
from PIL import Image
from pxr import Gf, Sdf, UsdLux

from stereocell.model.errors import StageError
from support.bundles import load

LIGHTS = "/Specimen/Lights"
MIDDLE = np.array([10.0, -5, 4])  # um, middle of the two tiles


def lights_of(bundle):
    return load(bundle / "manifest.json").get("lights")


def room_of(bundle):
    return OpenEXR.File(str(bundle / "room.exr")).channels()["RGB"].pixels


def remove_built(stage):
    for name in ("key", "fill", "dome"):
        stage.GetPrimAtPath(f"{LIGHTS}/{name}").SetActive(False)


def latlong(towards, color, rows=32):
    """Return an image (rows, 2 rows, 3) that is black except for a disc of radius 0.2 radians.

    The disc's middle lies in the direction `towards`.

    By OpenEXR's documentation, longitude is +pi at the left; 0 is +z, and pi / 2 is +x.
    """
    latitude = np.pi / 2 - (np.arange(rows) + 0.5)[:, None] / rows * np.pi
    longitude = np.pi - (np.arange(2 * rows) + 0.5)[None, :] / rows * np.pi
    x, z = np.cos(latitude) * np.sin(longitude), np.cos(latitude) * np.cos(longitude)
    along = x * towards[0] + np.sin(latitude) * towards[1] + z * towards[2]
    return np.where((along > np.cos(0.2))[..., None], color, 0).astype(np.float32)


def brightest(image):
    """Return the direction (x, y, z) of a latlong image's brightest texel, after OpenEXR."""
    rows, columns = image.shape[:2]
    row, column = np.unravel_index(image.sum(axis=2).argmax(), (rows, columns))
    return direction(row, column, rows, columns)


def direction(row, column, rows, columns):
    latitude = np.pi / 2 - (row + 0.5) / rows * np.pi
    longitude = np.pi - (column + 0.5) / columns * 2 * np.pi
    flat = np.cos(latitude)
    return np.array([flat * np.sin(longitude), np.sin(latitude), flat * np.cos(longitude)])


def middle_of_light(image):
    """Return the mean direction (x, y, z) from which a latlong image's light comes."""
    rows, columns = image.shape[:2]
    total = np.zeros(3)
    for row in range(rows):
        for column in range(columns):
            towards = direction(row, column, rows, columns)
            total += image[row, column].sum() * np.cos(np.arcsin(towards[1])) * towards
    return total / np.linalg.norm(total)


def test_stage_with_unedited_lights_keeps_the_viewers_own_lamps(bundle):
    assert lights_of(bundle) is None
    assert not (bundle / "room.exr").exists()


def test_stage_without_lights_keeps_the_viewers_lamps_and_a_line_states_it(edit):
    bundle = edit(lambda stage: stage.GetPrimAtPath(LIGHTS).SetActive(False))
    assert lights_of(bundle) is None
    assert ["the stage has no visible light" in line for line in edit.lines] == [True]


def test_distant_light_is_as_bright_as_usdlux_defines(edit):
    def change(stage):
        remove_built(stage)
        sun = UsdLux.DistantLight.Define(stage, f"{LIGHTS}/Sun")
        sun.CreateAngleAttr(2.0)
        sun.CreateIntensityAttr(1000.0)
        sun.CreateExposureAttr(1.0)
        sun.CreateColorAttr(Gf.Vec3f(1, 0.5, 0.25))
        sun.AddRotateYOp().Set(90.0)

    found = lights_of(edit(change))
    assert edit.lines == []
    (lamp,) = found["lamps"]
    # Radiance over the cone of one degree, weighted by the cosine; white reflects 1 / pi of it.
    angle = np.linspace(0, np.radians(1), 20001)
    cone = np.trapezoid(np.cos(angle) * np.sin(angle), angle) * 2 * np.pi
    assert lamp["strength"] == pytest.approx(2000 * cone / np.pi, rel=1e-4)
    assert lamp["color"] == pytest.approx([1, 0.5, 0.25])
    assert lamp["towards"] == pytest.approx([1, 0, 0], abs=1e-6)
    assert "room" not in found


@pytest.mark.parametrize("is_normalized", [False, True])
def test_sphere_light_is_as_bright_as_its_visible_surface(edit, is_normalized):
    at, radius = MIDDLE + np.array([0, 100.0, 0]), 3.0

    def change(stage):
        remove_built(stage)
        lamp = UsdLux.SphereLight.Define(stage, f"{LIGHTS}/Lamp")
        lamp.CreateRadiusAttr(radius)
        lamp.CreateIntensityAttr(500.0)
        lamp.CreateNormalizeAttr(is_normalized)
        lamp.AddTranslateOp().Set(Gf.Vec3d(*at))

    (lamp,) = lights_of(edit(change))["lamps"]
    assert lamp["position_um"] == pytest.approx(at)
    # Sum over the visible points of the sphere, each with equal radiance in all directions.
    towards = np.random.default_rng(0).normal(size=(200_000, 3))
    points = at + radius * towards / np.linalg.norm(towards, axis=1)[:, None]
    ray = MIDDLE - points
    far = np.linalg.norm(ray, axis=1)
    leaves = np.einsum("ij,ij->i", ray, points - at) / (far * radius)
    meets = -ray[:, 1] / far
    area = 4 * np.pi * radius**2
    radiance = 500 / area if is_normalized else 500
    irradiance = radiance * area * np.mean(leaves.clip(0) * meets / far**2)
    assert lamp["strength"] == pytest.approx(irradiance / np.pi, rel=0.01)


def test_color_temperature_changes_the_color(edit):
    def change(stage):
        key = UsdLux.LightAPI(stage.GetPrimAtPath(f"{LIGHTS}/key"))
        key.CreateEnableColorTemperatureAttr(True)
        key.CreateColorTemperatureAttr(3000.0)
        key.CreateColorAttr(Gf.Vec3f(1, 1, 1))

    lamp = next(one for one in lights_of(edit(change))["lamps"] if one["name"] == "key")
    red, green, blue = lamp["color"]
    assert red == 1
    assert red > green > blue > 0


def test_weakest_of_more_than_three_lamps_are_named(edit):
    def change(stage):
        remove_built(stage)
        for i in range(4):
            lamp = UsdLux.DistantLight.Define(stage, f"{LIGHTS}/L{i}")
            lamp.CreateNormalizeAttr(True)
            lamp.CreateIntensityAttr(float(i + 1))

    names = [lamp["name"] for lamp in lights_of(edit(change))["lamps"]]
    assert names == ["L3", "L2", "L1"]
    assert ["'L0' is not taken over" in line for line in edit.lines] == [True]


def test_a_lamp_that_is_too_bright_is_named(edit):
    def change(stage):
        UsdLux.LightAPI(stage.GetPrimAtPath(f"{LIGHTS}/key")).CreateIntensityAttr(100.0)

    assert lights_of(edit(change))["lamps"][0]["strength"] == 10
    assert ["brightness of light 'key'" in line for line in edit.lines] == [True]


@pytest.mark.parametrize("turn", [None, (0, 90, 0), (40, -70, 20)])
def test_turned_dome_shines_from_the_direction_that_usd_gives(edit, tmp_path, turn):
    """OpenEXR's documentation defines where a texel is, and USD's own transform turns it."""
    shines_at = np.array([0.6, 0.48, 0.64])
    image = tmp_path / "lamp.hdr"
    image.write_bytes(imagecodecs.rgbe_encode(latlong(shines_at, (4.0, 2.0, 1.0))))

    def change(stage):
        dome = UsdLux.DomeLight.Define(stage, f"{LIGHTS}/Sky")
        dome.CreateTextureFileAttr(Sdf.AssetPath("./lamp.hdr"))
        remove_built(stage)
        dome.CreateIntensityAttr(0.5)
        if turn:
            dome.AddRotateXYZOp().Set(Gf.Vec3f(*turn))
        change.world = np.array(dome.ComputeLocalToWorldTransform(0))[:3, :3]

    bundle = edit(change)
    assert edit.lines == []
    found = room_of(bundle)
    assert middle_of_light(found) == pytest.approx(shines_at @ change.world, abs=0.02)
    assert found.max(axis=(0, 1)) == pytest.approx([2, 1, 0.5], rel=0.01)
    if turn is None:
        room = lights_of(bundle)["room"]
        share = np.array(room["sky"])
        assert share[0] == pytest.approx(2 * (1 - np.cos(0.2)), rel=0.1)  # share of the upper half
        assert share == pytest.approx(share[0] * np.array([1, 0.5, 0.25]), rel=0.01)
        assert room["ground"] == [0, 0, 0]


def test_domes_add_up_and_a_plain_one_has_the_color_of_its_attribute(edit):
    def change(stage):
        remove_built(stage)
        for name, color in (("A", (1, 0, 0)), ("B", (0, 1, 0))):
            UsdLux.DomeLight.Define(stage, f"{LIGHTS}/{name}").CreateColorAttr(Gf.Vec3f(*color))

    room = lights_of(edit(change))["room"]
    assert room["sky"] == room["ground"] == [1, 1, 0]


def test_a_large_image_is_reduced_and_keeps_its_light(edit, tmp_path):
    noise = np.random.default_rng(1).integers(0, 256, (600, 1200, 3), np.uint8)
    Image.fromarray(noise).save(tmp_path / "noise.png")

    def change(stage):
        remove_built(stage)
        dome = UsdLux.DomeLight.Define(stage, f"{LIGHTS}/Sky")
        dome.CreateTextureFileAttr(Sdf.AssetPath("./noise.png"))

    image = room_of(edit(change))
    assert image.shape == (200, 400, 3)
    encoded = noise / 255
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    assert image.mean(axis=(0, 1)) == pytest.approx(linear.mean(axis=(0, 1)), rel=1e-3)


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("a.hdr", b"no image", "can't be read as Radiance HDR"),
        ("a.png", b"no image", "can't be read as an image, expected one in .exr"),
        ("a.exr", b"no image", "can't be read as OpenEXR"),
    ],
)
def test_a_damaged_image_is_one_line(edit, tmp_path, name, content, reason):
    (tmp_path / name).write_bytes(content)

    def change(stage):
        dome = UsdLux.DomeLight.Define(stage, f"{LIGHTS}/Sky")
        dome.CreateTextureFileAttr(Sdf.AssetPath(f"./{name}"))

    with pytest.raises(StageError, match=f"{name}: {reason}"):
        edit(change)


def test_another_kind_of_map_is_refused_by_name(edit, tmp_path):
    Image.new("RGB", (8, 4)).save(tmp_path / "ball.png")

    def change(stage):
        dome = UsdLux.DomeLight.Define(stage, f"{LIGHTS}/Sky")
        dome.CreateTextureFileAttr(Sdf.AssetPath("./ball.png"))
        dome.CreateTextureFormatAttr("mirroredBall")

    with pytest.raises(StageError, match="found 'mirroredBall', expected latlong or automatic"):
        edit(change)
