"""One channel's intensity is painted on another's surface, from voxels to stage and bundle."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from pxr import Usd, UsdGeom, UsdShade

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.model.channel import PaintColors
from stereocell.model.color import to_srgb8
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume, zyx_to_xyz
from stereocell.steps.unit_files import load_lods, load_record
from stereocell.textures.sample_channel import sample_channel
from stereocell.usd.validate import validate_stage
from support import phantoms
from support.glbs import read

SHAPE = (40, 40, 40)
RED, GREEN = (0.8, 0.1, 0.0), (0.0, 0.6, 0.2)


def test_paint_is_the_largest_value_down_to_the_stated_depth() -> None:
    """A layer 3 um below a floor shows from a depth of 3 um, by the painted channel's window."""
    voxels = np.full((20, 8, 8), 100, np.uint16)
    voxels[6] = 300  # the floor lies at z = 9
    at = zyx_to_xyz([[9.0, 4.0, 4.0]]).astype(np.float32)
    up = np.float32([[0, 0, 1]])
    floor = Mesh(at, np.zeros((0, 3), np.uint32), up)
    lattice = Lattice.of_whole(Box((0, 0, 0), voxels.shape), (1.0, 1.0, 1.0))

    def painted(depth: float, intensity_window: tuple[float, float]) -> float:
        volume = Volume(voxels, (1.0, 1.0, 1.0))
        found = sample_channel(
            volume, lattice, floor, intensity_window=intensity_window, depth_um=depth
        )
        return float(found[0])

    assert painted(1.5, (100, 500)) == 0
    assert painted(3.0, (100, 500)) == pytest.approx(0.5)
    assert painted(2.5, (100, 500)) == pytest.approx(0.25)  # between the planes
    assert painted(3.0, (100, 200)) == 1


def test_paint_colours_mix_in_linear_light() -> None:
    colors = PaintColors(RED, GREEN).mix(np.array([0, 255, 51], np.uint8))
    np.testing.assert_allclose(colors[:2], [RED, GREEN], atol=1e-6)
    np.testing.assert_allclose(colors[2], np.add(RED, 0.2 * np.subtract(GREEN, RED)), atol=1e-6)
    # IEC 61966-2-1
    assert to_srgb8(np.float32([0, 0.0031308, 0.2140411, 1])).tolist() == [0, 10, 127, 255]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build a ball, `body`, whose right half has `marker`; `other` is the same ball."""
    folder = tmp_path_factory.mktemp("paint")
    ball = phantoms.blurred_ball(SHAPE, (1.0, 1.0, 1.0), (20.0, 20.0, 20.0), 12.0, 1.0)
    half = ball * (np.arange(SHAPE[2]) > 20)
    voxels = np.stack([phantoms.as_counts(f, 100, 1100) for f in (ball, half, ball)])
    source, out = folder / "ball.ome.tif", folder / "out"
    names = ["body", "marker", "other"]
    phantoms.write_ome_tiff(source, voxels, "CZYX", (1.0, 1.0, 1.0), names=names)
    flags = ["--maps", "--paint", "0=marker", "--iso-value", "body=600", "--iso-value", "other=600"]
    assert main(["plan", str(source), "-o", str(out), *flags]) == 0
    for phase in ("units", "stage", "bundle"):
        assert main([phase, str(out), "--workers", "0"]) == 0
    return out


def _sides(positions: NDArray[np.float32]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which vertices lie well within the bare half, and which within the painted half."""
    return positions[:, 0] < 17, positions[:, 0] > 24


@pytest.mark.slow
def test_a_unit_holds_the_paint_at_vertices_and_texels(built: Path) -> None:
    out_folder = OutFolder(built)
    assert out_folder.plan().settings.paint == {"body": "marker"}
    directory = out_folder.unit_dir("r0_c0/body", out_folder.index()["r0_c0/body"])
    lods = load_lods(directory)
    assert [lod["maps"]["painted"] for lod in load_record(directory)["lods"]] == [True] * 4
    first = lods[0].baked
    assert first is not None
    assert first.paint is not None
    bare, painted = _sides(lods[0].mesh.positions)
    assert first.paint[bare].max() < 10
    assert first.paint[painted].min() > 200
    for lod in lods[1:]:
        assert lod.baked is not None
        assert lod.baked.paint is not None
        assert lod.normal_map is not None
        assert lod.baked.paint.shape == lod.normal_map.shape[:2]
        assert lod.baked.paint.min() < 10
        assert lod.baked.paint.max() > 200


@pytest.mark.slow
def test_the_stage_shows_the_paint_and_other_channels_can_be_recoloured(built: Path) -> None:
    stage = Usd.Stage.Open(str(built / "stage/stage.usda"))
    assert validate_stage(built / "stage/stage.usda") == []
    tile = stage.GetPrimAtPath("/Specimen/Tiles/r0_c0")
    base, other = (
        stage.GetPrimAtPath(f"/Specimen/Channels/{n}").GetAttribute("inputs:color").Get()
        for n in ("body", "marker")
    )

    def diffuse(channel: str, level: int) -> Usd.Attribute:
        tile.GetVariantSet("lod").SetVariantSelection(f"lod{level}")
        mesh = stage.GetPrimAtPath(f"{tile.GetPath()}/{channel}/{channel}_r0_c0")
        material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
        surface, _, _ = material.ComputeSurfaceSource("glslfx")
        (source,) = surface.GetInput("diffuseColor").GetValueProducingAttributes()
        return source

    source = diffuse("body", 0)
    assert UsdShade.Shader(source.GetPrim()).GetShaderId() == "UsdPrimvarReader_float3"
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"{tile.GetPath()}/body/body_r0_c0"))
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("displayColor")
    assert primvar.GetInterpolation() == "vertex"
    colors = np.array(primvar.ComputeFlattened())
    bare, painted = _sides(np.array(mesh.GetPointsAttr().Get()))
    np.testing.assert_allclose(colors[bare], np.tile(base, (bare.sum(), 1)), atol=0.05)
    np.testing.assert_allclose(
        colors[painted].mean(axis=0), np.array(other), atol=0.25 * np.abs(other - base).max()
    )

    texture = UsdShade.Shader(diffuse("body", 1).GetPrim())
    assert texture.GetShaderId() == "UsdUVTexture"
    assert texture.GetInput("sourceColorSpace").Get() == "sRGB"
    with Image.open(texture.GetInput("file").Get().resolvedPath) as picture:
        pixels = np.asarray(picture).reshape(-1, 3).astype(int)
    for color in (base, other):
        wanted = to_srgb8(np.array(color, np.float32)).astype(int)
        assert (np.abs(pixels - wanted).max(axis=1) < 25).mean() > 0.1

    plain = diffuse("other", 1)
    assert plain.GetPath() == "/Specimen/Tiles/r0_c0/other/other_r0_c0_look.inputs:color"


def test_the_bundle_shows_the_paint(built: Path) -> None:
    folder = built / "bundle/channels"

    def material(channel: str, level: int) -> tuple[dict, dict, list]:
        document, arrays = read((folder / f"{channel}/r0_c0/lod{level}.glb").read_bytes())
        (primitive,) = document["meshes"][0]["primitives"]
        return document["materials"][0], primitive["attributes"], arrays

    finest, attributes, arrays = material("body", 0)
    assert finest["pbrMetallicRoughness"]["baseColorFactor"] == [1, 1, 1, 1]
    assert len(np.unique(arrays[attributes["COLOR_0"]], axis=0)) > 3
    coarse, attributes, _ = material("body", 1)
    assert "baseColorTexture" in coarse["pbrMetallicRoughness"]
    assert {"normalTexture", "occlusionTexture"} <= coarse.keys()
    assert "COLOR_0" not in attributes
    plain, attributes, _ = material("other", 1)
    assert "baseColorTexture" not in plain["pbrMetallicRoughness"]
    assert plain["pbrMetallicRoughness"]["baseColorFactor"] != [1, 1, 1, 1]


@pytest.mark.parametrize(
    ("flag", "message"),
    [
        ("body", "--paint is 'body', expected CHANNEL=CHANNEL, such as CD31=MART1"),
        ("body=", "--paint is 'body=', expected CHANNEL=CHANNEL"),
        ("body=CD4", "--paint names channel 'CD4', expected one of body, marker, other, or an in"),
        ("body=0", "--paint is body=body, expected another channel than its own"),
    ],
)
def test_an_error_about_paint_is_one_line(
    built: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], flag: str, message: str
) -> None:
    source = built.parent / "ball.ome.tif"
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), "--paint", flag]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.slow
def test_the_report_shows_paint_texel_density_and_likeness_of_levels(
    built: Path,
) -> None:
    assert main(["report", str(built), "--texture-similarity", "--workers", "0"]) == 0
    page = (built / "report/index.html").read_text("utf-8")
    section = page[page.index('id="maps"') : page.index('id="volumes"')]
    rows = re.findall(r"<tr>(.*?)</tr>", section, re.DOTALL)
    cells = [[re.sub(r"<.*?>", "", cell) for cell in re.findall(r"<td.*?</td>", r)] for r in rows]
    first, second = [row for row in cells if row and row[1:2] in (["lod0"], ["lod1"])][:2]
    assert first[2] == "0"
    assert first[-1] == "1: finer than lod1"
    assert second[2:4] == ["1", "1"]  # tiles, um per texel
    assert second[-2] == "marker"
    (likeness,) = (row for row in cells if row and row[0] == "r0_c0/body")
    assert len(likeness) == 9  # unit, level, five views, their mean, and the front at a fixed size
    assert float(likeness[-2]) > 0.9
