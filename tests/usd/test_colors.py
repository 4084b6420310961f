"""Shaders repeat a channel's colour for programs that ignore connections; one edit changes it.

Blender's importer and the renderer Storm draw it in tests/blender.
"""

from collections.abc import Callable
from pathlib import Path

import pytest
from pxr import Gf, Sdf, Usd, UsdShade

from stereocell.export.options import ExportOptions
from stereocell.export.write import export_stage
from stereocell.usd.read_appearances import material_of, read_appearances, surface_of
from stereocell.usd.read_stage import loaded, open_stage
from support.stages import BALL_ID, COLORS, F_ID, TILES, leaf, write_whole

GREEN, BLUE = Gf.Vec3f(0.25, 0.75, 0.5), Gf.Vec3f(0.125, 0.25, 1)
CHANNEL = f"/Specimen/Channels/{F_ID}"
LOOK = leaf("r0_c1", F_ID, "_look")
INTERFACE, SHADER = "inputs:color", "surface.inputs:diffuseColor"


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


@pytest.fixture
def edited(stage_path: Path, tmp_path: Path) -> Callable[[dict[str, Gf.Vec3f]], Path]:
    """Return a function that writes a layer over the stage: colours by their attribute's path."""

    def write(colors: dict[str, Gf.Vec3f]) -> Path:
        layer = Sdf.Layer.CreateNew(str(tmp_path / "edited.usda"))
        layer.subLayerPaths = [str(stage_path)]
        for path, color in colors.items():
            prim = Sdf.CreatePrimInLayer(layer, Sdf.Path(path).GetPrimPath())
            name = Sdf.Path(path).name
            spec = Sdf.AttributeSpec(prim, name, Sdf.ValueTypeNames.Color3f)
            spec.default = color
        layer.Save()
        return tmp_path / "edited.usda"

    return write


def colors_read(path: Path) -> dict[str, tuple[float, ...]]:
    """Return the colours that a bundle would get: of the channel, and of its mesh in each tile."""
    stage = open_stage(path)
    found = {"channel": read_appearances(stage)[0].color}
    for tile in TILES:
        with loaded(stage, tile):
            mesh = stage.GetPrimAtPath(leaf(tile, F_ID))
            found[tile] = material_of(surface_of(mesh)).color
    return found


def plain_color(path: Path, tile: str, channel: str) -> Gf.Vec3f:
    """Return the colour of a mesh for a program that reads only the values in its shader."""
    stage = Usd.Stage.Open(str(path))
    mesh = stage.GetPrimAtPath(leaf(tile, channel))
    material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
    color = material.ComputeSurfaceSource()[0].GetInput("diffuseColor")
    assert not color.HasConnectedSource()
    return color.Get()


def test_shaders_state_the_colour_themselves(stage_path: Path) -> None:
    for tile in TILES:
        for channel, color in zip((F_ID, BALL_ID), COLORS[:2], strict=True):
            assert plain_color(stage_path, tile, channel) == Gf.Vec3f(*color)


@pytest.mark.parametrize(
    ("colors", "expected"),
    [
        ({}, (COLORS[0],) * 3),
        ({f"{CHANNEL}.{INTERFACE}": GREEN}, (GREEN,) * 3),
        ({f"{CHANNEL}/{SHADER}": GREEN}, (GREEN,) * 3),
        ({f"{CHANNEL}.{INTERFACE}": GREEN, f"{CHANNEL}/{SHADER}": BLUE}, (GREEN,) * 3),
        ({f"{LOOK}.{INTERFACE}": BLUE}, (COLORS[0], COLORS[0], BLUE)),
        ({f"{LOOK}/{SHADER}": BLUE}, (COLORS[0], COLORS[0], BLUE)),
        ({f"{CHANNEL}.{INTERFACE}": GREEN, f"{LOOK}.{INTERFACE}": BLUE}, (GREEN, GREEN, BLUE)),
    ],
)
def test_an_edited_colour_is_read_and_that_of_the_interface_has_precedence(
    edited: Callable[[dict[str, Gf.Vec3f]], Path],
    colors: dict[str, Gf.Vec3f],
    expected: tuple[tuple[float, ...], ...],
) -> None:
    found = colors_read(edited(colors))
    for name, color in zip(("channel", *TILES), expected, strict=True):
        assert found[name] == pytest.approx(tuple(color))


@pytest.mark.parametrize("place", [f"{CHANNEL}.{INTERFACE}", f"{CHANNEL}/{SHADER}"])
def test_a_flattened_stage_states_the_edited_colour_in_its_shaders(
    edited: Callable[[dict[str, Gf.Vec3f]], Path], tmp_path: Path, place: str
) -> None:
    flat = tmp_path / "flat.usdc"
    export_stage(edited({place: GREEN}), flat, options=ExportOptions(lod=1))
    for tile in TILES:
        assert plain_color(flat, tile, F_ID) == GREEN
        assert plain_color(flat, tile, BALL_ID) == Gf.Vec3f(*COLORS[1])
    assert set(colors_read(flat).values()) == {tuple(GREEN)}
