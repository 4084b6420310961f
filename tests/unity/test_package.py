"""The Unity package as files: what its package manager, and its importers, go by."""

import json
import re
from importlib.metadata import version

from support.unity_meta import PACKAGE, assets, guid_of, meta_of

ROOT = PACKAGE.parents[1]
VIEWER = ROOT / "viewer_gltf" / "src"
MARCH = PACKAGE / "Runtime" / "Shaders" / "march.hlsl"
SHADER = PACKAGE / "Runtime" / "Shaders" / "StereoCellVolume.shader"


def test_its_version_is_the_product_s() -> None:
    package = json.loads((PACKAGE / "package.json").read_text("utf-8"))
    assert package["version"] == version("stereocell")
    assert f"## {package['version']}\n" in (PACKAGE / "CHANGELOG.md").read_text("utf-8")
    assert (PACKAGE / "LICENSE.md").read_bytes() == (ROOT / "LICENSE").read_bytes()


def test_what_it_needs_is_named_once_and_in_the_docs() -> None:
    package = json.loads((PACKAGE / "package.json").read_text("utf-8"))
    page = (ROOT / "docs" / "unity-unreal.md").read_text("utf-8")
    for name, least in package["dependencies"].items():
        assert re.fullmatch(r"\d+\.\d+\.\d+(-preview\.\d+)?", least)
        if not name.startswith("com.unity.modules."):
            assert f"`{name}` {least}" in page
    assert package["name"] in page
    assert f"Unity {package['unity']}" in page


def test_each_asset_has_a_guid_of_its_own_that_stays() -> None:
    found = {}
    for asset in assets():
        lines = meta_of(asset).read_text("utf-8").splitlines()
        assert lines[0] == "fileFormatVersion: 2"
        assert lines[1] == f"guid: {guid_of(asset)}"
        assert ("folderAsset: yes" in lines) == asset.is_dir()
        found[lines[1]] = asset
    assert len(found) == len(list(assets())) > 15
    assert set(PACKAGE.rglob("*.meta")) == {meta_of(asset) for asset in assets()}


def test_assemblies_refer_to_what_is_there() -> None:
    names = {}
    for path in PACKAGE.rglob("*.asmdef"):
        assembly = json.loads(path.read_text("utf-8"))
        assert path.name == f"{assembly['name']}.asmdef"
        names[assembly["name"]] = assembly
    assert names["StereoCell"]["references"] == []
    editor = names["StereoCell.Editor"]
    assert editor["references"] == ["StereoCell"]
    assert editor["includePlatforms"] == ["Editor"]  # so that no game carries it
    tests = names["StereoCell.Tests"]
    assert {"StereoCell", "StereoCell.Editor"} < set(tests["references"])
    assert tests["includePlatforms"] == ["Editor"]
    assert tests["defineConstraints"] == ["UNITY_INCLUDE_TESTS"]
    for script in (PACKAGE / "Runtime").rglob("*.cs"):
        assert "UnityEditor" not in script.read_text("utf-8")


def test_scripts_set_only_what_the_shader_has() -> None:
    shader, march = SHADER.read_text("utf-8"), MARCH.read_text("utf-8")
    properties = set(re.findall(r"^\s*(?:\[.*\] )?(_\w+) \(\"", shader, re.MULTILINE))
    uniforms = set(re.findall(r"^\s*float4? (_\w+)(?:\[\w+\])?;", march + shader, re.MULTILINE))
    importer = (PACKAGE / "Editor" / "BundleImporter.cs").read_text("utf-8")
    in_material = set(re.findall(r"material\.Set\w+\(\"(_\w+?)\"[,)]", importer))
    in_material |= {f"_ToBox{row}" for row in range(3)}
    assert '"_ToBox" + row' in importer
    # a material keeps only what is among its properties: the rest would be lost with the asset
    assert in_material < properties
    specimen = (PACKAGE / "Runtime" / "Specimen.cs").read_text("utf-8")
    in_block = set(re.findall(r"block\.Set\w+\(\"(_\w+)\"", specimen))
    assert in_block <= uniforms | properties
    textures = {"_Volume", "_Table"}
    unset = uniforms - in_block - in_material - textures - {"_Grain"}
    assert unset == set()
    name = re.search(r'ShaderName = "(.*)"', importer)
    assert name is not None
    assert shader.startswith("//")
    assert f'Shader "{name[1]}"' in shader


def constant(name: str, source: str) -> list[float]:
    found = re.search(rf"\b{name} ?(?::\s*\w+ )?=? ?(?:float3\(|\[)?([-\d., ]+)", source)
    assert found is not None, name
    return [float(n) for n in found[1].strip(" ,").split(",")]


def test_light_and_steps_are_the_viewer_s() -> None:
    march = MARCH.read_text("utf-8")
    room = (VIEWER / "gpu" / "room_light.ts").read_text("utf-8")
    for theirs, ours in (
        ("KEY", "KEY_LIGHT"), ("FILL", "FILL_LIGHT"), ("SKY", "SKY_LIGHT"),
        ("GROUND", "GROUND_LIGHT"), ("GLOSS", "GLOSS"),
    ):  # fmt: skip
        assert constant(ours, march) == constant(theirs, room)
    shade = (VIEWER / "gpu" / "chunks" / "shade.glsl").read_text("utf-8")
    for name in ("NOISE_STEP", "BOUNDARY_STEP", "FLAT_STEP", "SCATTERED"):
        assert constant(name, march) == constant(name, shade)
    for name, file in (
        ("MAX_STEPS", "voxels/march_frame.ts"),
        ("OPAQUE", "volumes/tile_raymarch.ts"),
    ):
        theirs = (VIEWER / file).read_text("utf-8")
        assert constant(name, march) == constant(name, theirs)
    shader = SHADER.read_text("utf-8")
    for lamp, name in (("key", "KEY_AT"), ("fill", "FILL_AT")):
        x, y, z = constant(name, room)
        at = re.search(rf"room\.{lamp} = lampInBox\(float3\((.*)\)\)", shader)
        assert at is not None
        assert [float(n) for n in at[1].split(",")] == [x, y, z + 1]  # it shines at (0, 0, -1)
    gaze = (PACKAGE / "Runtime" / "GazeSwitch.cs").read_text("utf-8")
    dwell = (VIEWER / "interaction" / "dwell.ts").read_text("utf-8")
    assert constant("float dwell", gaze) == constant("DWELL_S", dwell)
