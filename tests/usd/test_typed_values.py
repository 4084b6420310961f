"""A layer over the stage may have values of a wrong type, or values that are not finite."""

from collections.abc import Callable
from pathlib import Path

import pytest
from pxr import Sdf, Tf, Usd

from stereocell.cli.__main__ import main
from stereocell.engine.run import Engine
from stereocell.export.options import ExportOptions
from stereocell.export.write import export_stage
from stereocell.model.errors import StereoCellError
from stereocell.usd import read_stage, typed_values
from stereocell.usd.read_attributes import color_of
from stereocell.usd.typed_values import read_as
from stereocell.usd.validate import validate_stage
from support.bundles import write_bundle
from support.stages import F_ID, HEAD, leaf, write_whole

CHANNEL = f"/Specimen/Channels/{F_ID}"
TILE = "/Specimen/Tiles/r0_c0"
MESH = leaf("r0_c0", F_ID)
SURFACE = leaf("r0_c0", F_ID, "_look/surface")
VOLUME = leaf("r0_c0", F_ID, "_volume")
LIGHT = "/Specimen/Lights/key"


@pytest.fixture(scope="module")
def stage_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_whole(tmp_path_factory.mktemp("stage"))


@pytest.fixture
def edited(stage_path: Path, tmp_path: Path) -> Callable[[str, str], Path]:
    """Return a function that writes a layer over the stage with one line at a prim."""

    def write(prim: str, line: str) -> Path:
        body = line
        for name in reversed(prim.strip("/").split("/")):
            body = f'over "{name}" {{\n{body}\n}}'
        layer = tmp_path / "edit.usda"
        layer.write_text(f"{HEAD}subLayers = [@{stage_path}@])\n{body}\n")
        return layer

    return write


def refusal_of_bundle(layer: Path, folder: Path) -> str:
    with pytest.raises(StereoCellError) as raised:
        write_bundle(layer, folder / "bundle", None, engine=Engine(0))
    return str(raised.value)


@pytest.mark.parametrize(
    ("prim", "line", "expected"),
    [
        (CHANNEL, 'string inputs:color = "red"', "inputs:color: found a value of type string"),
        (CHANNEL, "float inputs:color = 1", "inputs:color: found a value of type double"),
        (CHANNEL, 'string stereocell:isoValue = "x"', "isoValue: found a value of type string"),
        (
            CHANNEL,
            "float stereocell:isoValue = nan",
            "isoValue: found nan, expected finite numbers",
        ),
        (
            CHANNEL,
            "float stereocell:threshold = inf",
            "threshold: found inf, expected finite numbers",
        ),
        (
            CHANNEL,
            "float stereocell:levelIso = nan",
            "levelIso: found nan, expected finite numbers",
        ),
        (CHANNEL, 'string stereocell:gradientMax = "x"', "gradientMax: found a value of type str"),
        (CHANNEL, "int stereocell:surfaceReason = 3", "surfaceReason: found a value of type int"),
        (
            CHANNEL,
            "float2 stereocell:window = (-3e38, 3e38)",
            "expected voxel values from -1e+30 to 1e+30",
        ),
        (CHANNEL, 'string stereocell:opacityPoints = "ab"', "type string, expected float2[]"),
        (
            CHANNEL,
            f"float2[] stereocell:opacityPoints = [{', '.join(['(0.5, 0.5)'] * 10_001)}]",
            "opacityPoints: found 10001 pairs, expected at most 10000",
        ),
        (CHANNEL, 'string stereocell:shapes = "ab"', "type string, expected float4[]"),
        (CHANNEL, 'string stereocell:columns = "a"', "type string, expected token[]"),
        (SURFACE, 'string inputs:roughness = "a"', "roughness: found a value of type"),
        (SURFACE, "float inputs:metallic = nan", "metallic: found nan"),
        ("/Specimen", "int stereocell:modality = 3", "modality: found a value of type int"),
        (TILE, 'string extentsHint = "ab"', "extentsHint: found a value of type string"),
        (MESH, 'string points = "ab"', "points: found a value of type string, expected point3f[]"),
        (MESH, "float[] points = [1, 2]", "points: found a value of type float[], expected"),
        (MESH, "float[] faceVertexCounts = [3.5]", "type float[], expected int[]"),
        (MESH, "int faceVertexCounts = 3", "faceVertexCounts: found a value of type int"),
        (MESH, 'string[] normals = ["a"]', "normals: found a value of type string[]"),
        (MESH, 'string[] primvars:normals = ["a"]', "normals: found a value of type string[]"),
        (MESH, "int stereocell:shapeHash = 3", "shapeHash: found a value of type int"),
        (VOLUME, 'string stereocell:atlas = "a"', "atlas: found a value of type string"),
        (VOLUME, 'string stereocell:apron = "a"', "apron: found a"),
        (LIGHT, 'string inputs:color = "red"', "inputs:color: found a value of type string"),
        (
            LIGHT,
            "float inputs:intensity = nan",
            "inputs:intensity: found nan, expected finite numbers",
        ),
        (LIGHT, 'string inputs:intensity = "a"', "inputs:intensity: found a value of type string"),
    ],
)
def test_a_bundle_refuses_a_value_of_another_type_in_one_line(
    edited: Callable[[str, str], Path], tmp_path: Path, prim: str, line: str, expected: str
) -> None:
    refusal = refusal_of_bundle(edited(prim, line), tmp_path)
    assert prim in refusal
    assert expected in refusal
    assert "\n" not in refusal


@pytest.mark.parametrize(
    ("prim", "line"),
    [
        (CHANNEL, "double3 inputs:color = (0.5, 0.25, 0)"),
        (CHANNEL, "half3 inputs:color = (0.5, 0.25, 0)"),
    ],
)
def test_another_precision_is_the_same_value(
    edited: Callable[[str, str], Path], prim: str, line: str
) -> None:
    stage = read_stage.open_stage(edited(prim, line))
    assert color_of(stage.GetPrimAtPath(prim).GetAttribute("inputs:color")) == (0.5, 0.25, 0.0)


@pytest.mark.parametrize(
    ("prim", "line"),
    [
        (CHANNEL, 'string stereocell:window = "ab"'),
        (CHANNEL, 'string stereocell:opacityPoints = "ab"'),
        (MESH, 'string points = "ab"'),
        (VOLUME, 'string stereocell:boundsMin = "ab"'),
    ],
)
def test_the_validator_finds_a_value_of_another_type(
    edited: Callable[[str, str], Path], prim: str, line: str
) -> None:
    found = [str(one) for one in validate_stage(edited(prim, line))]
    assert any(prim in one and "found a value of type string" in one for one in found)


def test_a_perspective_is_refused(edited: Callable[[str, str], Path], tmp_path: Path) -> None:
    rows = "((1,0,0,1),(0,1,0,0),(0,0,1,0),(0,0,0,1))"
    order = 'uniform token[] xformOpOrder = ["xformOp:transform"]'
    layer = edited(TILE, f"matrix4d xformOp:transform = {rows}\n{order}")
    assert f"{TILE}: the last column of its transform is " in refusal_of_bundle(layer, tmp_path)


def test_a_bundle_without_channels_is_refused(
    edited: Callable[[str, str], Path], stage_path: Path, tmp_path: Path
) -> None:
    layer = edited("/Specimen", 'over "Channels" (active = false) {}')
    refusal = refusal_of_bundle(layer, tmp_path)
    assert refusal.startswith(f"{layer}: found no ")
    assert "/Specimen/Channels" in refusal
    stage = Usd.Stage.Open(str(stage_path))
    channels = stage.GetPrimAtPath("/Specimen/Channels").GetChildren()
    each = "\n".join(f'over "{prim.GetName()}" (active = false) {{}}' for prim in channels)
    none = edited("/Specimen/Channels", each)
    line = (
        f"{layer}: found no active channel below /Specimen/Channels, expected one or more: "
        "activate one"
    )
    assert refusal_of_bundle(none, tmp_path) == line
    with pytest.raises(StereoCellError) as raised:
        export_stage(none, tmp_path / "s.glb", options=ExportOptions())
    assert str(raised.value) == line


def test_usd_prints_no_warnings_of_its_own(
    edited: Callable[[str, str], Path], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    normals = 'normal3f[] primvars:normals = [(0, 0, 1)] (interpolation = "vertex")'
    layer = edited(MESH, f"{normals}\nint[] primvars:normals:indices = [7, -1]")
    assert "found 0 normals, expected" in refusal_of_bundle(layer, tmp_path)
    assert "Warning" not in capfd.readouterr().err


def raise_type_mismatch(*_: object) -> None:
    """Raise an error of USD itself."""
    stage = Usd.Stage.CreateInMemory()
    attribute = stage.DefinePrim("/P").CreateAttribute("a", Sdf.ValueTypeNames.Color3f)
    attribute.Set("red")


def test_usd_itself_raises_such_errors() -> None:
    with pytest.raises(Tf.ErrorException):
        raise_type_mismatch()


def test_an_error_of_usd_is_one_line_of_a_bundle(
    stage_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stereocell.bundle.write.read_appearances", raise_type_mismatch)
    refusal = refusal_of_bundle(stage_path, tmp_path)
    assert refusal.startswith(f"{stage_path}: found an error of USD (Type mismatch")
    assert "\n" not in refusal


def test_an_error_of_usd_is_one_line_of_a_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("stereocell.cli.__main__._run", raise_type_mismatch)
    assert main(["settings"]) == 1
    line = capsys.readouterr().err.strip()
    assert line.startswith("stereocell: USD refuses a layer of the stage: Type mismatch")
    assert "\n" not in line


def test_value_may_be_nan_where_nan_means_none() -> None:
    stage = Usd.Stage.CreateInMemory()
    attribute = stage.DefinePrim("/P").CreateAttribute("a", Sdf.ValueTypeNames.FloatArray)
    attribute.Set([1.0, float("nan")])
    assert len(read_as(attribute, Sdf.ValueTypeNames.FloatArray, may_be_nan=True)) == 2
    with pytest.raises(StereoCellError, match=r"/P\.a: found nan, expected finite numbers"):
        typed_values.read_as(attribute, Sdf.ValueTypeNames.FloatArray)
