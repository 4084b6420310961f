"""The files of the Unity package agree with each other, as Unity's package manager needs them."""

import json
import re
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import yaml

from support.unity_assemblies import ASSEMBLIES, compile_assembly
from support.unity_meta import PACKAGE, SAMPLES, assets, guid_of, meta_of

ROOT = PACKAGE.parents[1]
VIEWER = ROOT / "viewer_gltf" / "src"
SHADERS = PACKAGE / "Runtime" / "Shaders"
MARCH = SHADERS / "march.hlsl"
SHADER = SHADERS / "StereoCellVolume.shader"


def test_the_package_has_the_version_of_the_product() -> None:
    package = json.loads((PACKAGE / "package.json").read_text("utf-8"))
    assert package["version"] == version("stereocell")
    assert f"## {package['version']}\n" in (PACKAGE / "CHANGELOG.md").read_text("utf-8")
    assert (PACKAGE / "LICENSE.md").read_bytes() == (ROOT / "LICENSE").read_bytes()


def test_the_docs_name_each_dependency_and_its_version() -> None:
    package = json.loads((PACKAGE / "package.json").read_text("utf-8"))
    page = (ROOT / "docs" / "unity-unreal.md").read_text("utf-8")
    for name, least in package["dependencies"].items():
        assert re.fullmatch(r"\d+\.\d+\.\d+(-preview\.\d+)?", least)
        if not name.startswith("com.unity.modules."):
            assert f"`{name}` {least}" in page
    assert package["name"] in page
    assert f"Unity {package['unity']}" in page


def test_each_asset_has_its_own_lasting_guid() -> None:
    found = {}
    for asset in assets():
        lines = meta_of(asset).read_text("utf-8").splitlines()
        assert lines[0] == "fileFormatVersion: 2"
        assert lines[1] == f"guid: {guid_of(asset)}"
        assert ("folderAsset: yes" in lines) == asset.is_dir()
        found[lines[1]] = asset
    assert len(found) == len(list(assets())) > 15
    assert set(PACKAGE.rglob("*.meta")) == {meta_of(asset) for asset in assets()}


def test_assemblies_refer_to_assemblies_that_exist() -> None:
    names = {}
    for path in PACKAGE.rglob("*.asmdef"):
        assembly = json.loads(path.read_text("utf-8"))
        assert path.name == f"{assembly['name']}.asmdef"
        names[assembly["name"]] = assembly
    assert names["StereoCell"]["references"] == []
    editor = names["StereoCell.Editor"]
    assert editor["references"] == ["StereoCell", "glTFast"]
    tests = names["StereoCell.Tests"]
    assert {"StereoCell", "StereoCell.Editor"} < set(tests["references"])
    assert tests["defineConstraints"] == ["UNITY_INCLUDE_TESTS"]
    for path in PACKAGE.rglob("*.asmdef"):
        is_editors = "Editor" in path.relative_to(PACKAGE).parts
        platforms = json.loads(path.read_text("utf-8")).get("includePlatforms", [])
        assert platforms == (["Editor"] if is_editors else [])  # players do not contain editor code
    for script in PACKAGE.rglob("*.cs"):
        if "Editor" not in script.relative_to(PACKAGE).parts:
            assert "UnityEditor" not in script.read_text("utf-8")


def test_assemblies_in_tests_have_the_references_of_the_package() -> None:
    """The compiler gets the same references in the tests as in the .asmdef files."""
    for path in PACKAGE.rglob("*.asmdef"):
        assembly = json.loads(path.read_text("utf-8"))
        named = {*assembly["references"], *assembly.get("precompiledReferences", [])}
        _, seen = ASSEMBLIES[assembly["name"]]
        own = {name.removesuffix(".dll") for name in named if "TestRunner" not in name}
        assert set(seen) - {"UnityEngine", "UnityEditor"} <= own | {"Newtonsoft.Json"}
        assert own <= set(seen)


def test_the_sample_compiles_without_the_cardboard_plug_in(assemblies: Path) -> None:
    """A symbol is defined only with the plug-in's package; other code works without the plug-in."""
    path = SAMPLES / "Cardboard" / "StereoCell.Samples.Cardboard.asmdef"
    (symbol,) = json.loads(path.read_text("utf-8"))["versionDefines"]
    assert symbol["name"] == "com.google.xr.cardboard"
    assert symbol["define"] == "STEREOCELL_CARDBOARD"
    compile_assembly(assemblies, "StereoCell.Samples.Cardboard", blind=("Google.XR.Cardboard",))
    compile_assembly(
        assemblies,
        "StereoCell.Samples.Cardboard",
        "STEREOCELL_CARDBOARD",
        "ENABLE_LEGACY_INPUT_MANAGER",
    )


def test_samples_are_declared() -> None:
    package = json.loads((PACKAGE / "package.json").read_text("utf-8"))
    declared = {sample["path"] for sample in package["samples"]}
    assert declared == {f"Samples~/{each.name}" for each in SAMPLES.iterdir() if each.is_dir()}


def documents(asset: Path) -> list[tuple[int, int, dict[str, Any]]]:
    """Return the objects of an asset in Unity's YAML: class, number in the file, and fields."""
    text = asset.read_text("utf-8")
    assert text.startswith("%YAML 1.1\n%TAG !u! tag:unity3d.com,2011:\n")
    parts = re.split(r"^--- !u!(\d+) &(\d+)\n", text, flags=re.MULTILINE)[1:]
    return [
        (int(kind), int(number), yaml.safe_load(content))
        for kind, number, content in zip(parts[::3], parts[1::3], parts[2::3], strict=True)
    ]


def references(value: Any) -> Iterator[dict[str, Any]]:
    if isinstance(value, dict):
        if "fileID" in value:
            yield value
        for each in value.values():
            yield from references(each)
    if isinstance(value, list):
        for each in value:
            yield from references(each)


def test_yaml_assets_refer_to_objects_that_exist() -> None:
    """Assets in Unity's YAML are well formed, and their GUIDs and numbers belong to objects."""
    guids = {guid_of(asset): asset for asset in assets()}
    written = [
        asset for asset in assets() if asset.suffix in (".mat", ".asset", ".unity", ".prefab")
    ]
    assert [asset.name for asset in written] == ["Reticle.mat"]
    for asset in written:
        objects = documents(asset)
        numbers = {number for _, number, _ in objects}
        for _, _, fields in objects:
            for reference in references(fields):
                if "guid" in reference:
                    assert reference["guid"] in guids
                else:
                    assert reference["fileID"] in numbers | {0}
    ((kind, _, fields),) = documents(SAMPLES / "Cardboard" / "Reticle.mat")
    assert kind == 21
    shader = guids[fields["Material"]["m_Shader"]["guid"]].read_text("utf-8")
    (colors,) = fields["Material"]["m_SavedProperties"]["m_Colors"]
    assert set(colors) == set(re.findall(r"^ *(_\w+) \(\".*Color\)", shader, re.MULTILINE))
    scene = (SAMPLES / "Cardboard" / "Editor" / "CardboardScene.cs").read_text("utf-8")
    named = re.findall(r'"([0-9a-f]{32})"', scene)
    assert [guids[guid].name for guid in named] == ["Reticle.mat"]


def names_in(file: str) -> set[str]:
    """Return the shader's properties that a script names; `_ToBox` and the like are numbered."""
    text = (PACKAGE / file).read_text("utf-8")
    found = set(re.findall(r"\"(_\w+)\"", text))
    for prefix, count in (("_ToBox", 3), ("_Color", 4)):
        if prefix in found:
            found = found - {prefix} | {f"{prefix}{i}" for i in range(count)}
    return found


def test_scripts_set_only_properties_that_the_shader_has() -> None:
    shader = SHADER.read_text("utf-8")
    block = (SHADERS / "volume_material.hlsl").read_text("utf-8")
    properties = set(re.findall(r"^\s*(?:\[.*\] )?(_\w+) \(\"", shader, re.MULTILINE))
    uniforms = set(re.findall(r"^float4? (_\w+);", block, re.MULTILINE))
    assert uniforms | {"_Volume", "_Table"} == properties
    # A material stores only values of its shader's properties. Other values would be lost.
    imported = names_in("Editor/VolumeBuilder.cs")
    chosen = names_in("Runtime/VolumeBox.cs")
    assert imported <= properties
    assert chosen <= properties
    assert properties - imported - chosen == {"_Grain"}
    builder = (PACKAGE / "Editor" / "SpecimenBuilder.cs").read_text("utf-8")
    name = re.search(r'ShaderName = "(.*)"', builder)
    path = re.search(r'ShaderPath = "Packages/org.stereocell.bundle/(.*)"', builder)
    assert name is not None
    assert path is not None
    assert PACKAGE / path[1] == SHADER
    assert f'Shader "{name[1]}"' in shader


def constant(name: str, source: str) -> list[float]:
    found = re.search(rf"\b{name} ?(?::\s*\w+ )?=? ?(?:float3\(|\[)?([-\d., ]+)", source)
    assert found is not None, name
    return [float(n) for n in found[1].strip(" ,").split(",")]


def test_light_steps_and_dwell_are_those_of_the_viewer() -> None:
    march = MARCH.read_text("utf-8")
    scene_light = (VIEWER / "gpu" / "scene_light.ts").read_text("utf-8")
    lamps = {
        lamp: [[float(n) for n in part.split(",")] for part in (light, towards)]
        for lamp, light, towards in re.findall(
            r"(\w+): \{ light: \[(.*?)\], towards: \[(.*?)\] \}", scene_light
        )
    }
    halves = {
        name: [float(n) for n in part.split(",")]
        for name, part in re.findall(r"(sky|ground): \[(.*?)\]", scene_light)
    }
    for theirs, ours in (
        (lamps["key"][0], "KEY_LIGHT"), (lamps["fill"][0], "FILL_LIGHT"),
        (halves["sky"], "SKY_LIGHT"), (halves["ground"], "GROUND_LIGHT"),
        (constant("GLOSS", scene_light), "GLOSS"),
    ):  # fmt: skip
        assert constant(ours, march) == theirs
    shade = (VIEWER / "gpu" / "chunks" / "shade.glsl").read_text("utf-8")
    for name in ("NOISE_STEP", "BOUNDARY_STEP", "FLAT_STEP", "SCATTERED"):
        assert constant(name, march) == constant(name, shade)
    for name, file in (
        ("MAX_STEPS", "voxels/march_frame.ts"),
        ("OPAQUE", "volumes/tile_raymarch.ts"),
    ):
        theirs = (VIEWER / file).read_text("utf-8")
        assert constant(name, march) == constant(name, theirs)
    shader = (SHADERS / "volume_pass.hlsl").read_text("utf-8")
    for lamp, (_, towards) in lamps.items():
        at = re.search(rf"room\.{lamp} = lampInBox\(float3\((.*)\)\)", shader)
        assert at is not None
        assert [float(n) for n in at[1].split(",")] == towards
    gaze = (PACKAGE / "Runtime" / "GazeSwitch.cs").read_text("utf-8")
    dwell = (VIEWER / "interaction" / "dwell.ts").read_text("utf-8")
    assert constant("float dwell", gaze) == constant("DWELL_S", dwell)
