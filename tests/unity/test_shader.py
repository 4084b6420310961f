"""The whole shader of the Unity package compiles as HLSL and draws an imported specimen."""

import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from support.bundle_picture import read_blocks
from support.bundles import load
from support.exhaustive import sweep
from support.reference_raymarch import Block, Camera, Values, encoded, psnr, render
from support.unity_import import UM
from support.unity_import import boxes as boxes_of
from support.unity_meta import SAMPLES
from support.unity_shader import (
    MARKS,
    SHADER,
    STAGES,
    chromium,
    compile_stage,
    cross,
    draw,
    has_compiler,
    uniform_blocks,
    view_of,
)

pytestmark = pytest.mark.skipif(
    not has_compiler(), reason="needs glslangValidator: run `make mono`"
)
GAMMA, STEREO = "UNITY_COLORSPACE_GAMMA", "UNITY_STEREO_INSTANCING_ENABLED"
RETICLE = SAMPLES / "Cardboard" / "Reticle.shader"
each_pipeline = pytest.mark.parametrize("pipeline", list(MARKS))


@each_pipeline
@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("defines", [(), (GAMMA,), (STEREO,), (STEREO, GAMMA)])
def test_each_variant_compiles(
    stage: str, defines: tuple[str, ...], pipeline: str, tmp_path: Path
) -> None:
    assert compile_stage(stage, tmp_path, *defines, pipeline=pipeline).stat().st_size > 1000


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("defines", [(), (STEREO,)])
def test_the_sample_s_reticle_compiles(
    stage: str, defines: tuple[str, ...], tmp_path: Path
) -> None:
    assert compile_stage(stage, tmp_path, *defines, shader=RETICLE).stat().st_size > 200


@each_pipeline
@pytest.mark.skipif(shutil.which("spirv-cross") is None, reason="needs SPIRV-Cross: `make mono`")
def test_each_eye_has_its_layer_its_matrix_and_its_position(pipeline: str, tmp_path: Path) -> None:
    """In single-pass instanced mode, each instance is drawn into its eye's layer of the target."""
    spirv = {s: compile_stage(s, tmp_path, STEREO, pipeline=pipeline) for s in STAGES}
    vertex = cross(spirv["vert"], "--version", "450")
    assert re.search(r"gl_Layer = .+;", vertex)
    assert "gl_InstanceID" in vertex
    assert "unity_StereoMatrixVP[" in vertex
    fragment = cross(spirv["frag"], "--version", "450")
    assert "unity_StereoWorldSpaceCameraPos[" in fragment
    assert re.search(r"sampler2DArray \w*_CameraDepthTexture", fragment)


@each_pipeline
@pytest.mark.skipif(shutil.which("spirv-cross") is None, reason="needs SPIRV-Cross: `make mono`")
def test_every_number_of_a_material_is_in_the_block_that_is_batched(
    pipeline: str, tmp_path: Path
) -> None:
    """The scriptable pipelines batch a shader whose properties all lie in UnityPerMaterial."""
    text = SHADER.read_text("utf-8")
    properties = re.findall(r"^ *(?:\[.*\] )?(_\w+) \(\".*\", (\w+)", text, re.MULTILINE)
    numbers = {name for name, kind in properties if kind not in ("2D", "3D")}
    blocks = [
        {
            block["name"]: block
            for block in uniform_blocks(compile_stage(stage, tmp_path, *defines, pipeline=pipeline))
        }
        for stage in STAGES
        for defines in ((), (STEREO,), (GAMMA,))
    ]
    material = blocks[0]["UnityPerMaterial"]
    assert {member["name"] for member in material["members"]} == numbers
    assert all(found["UnityPerMaterial"] == material for found in blocks)
    others = [m["name"] for name, b in blocks[0].items() if b is not material for m in b["members"]]
    assert not numbers & set(others)
    assert "shader_feature" not in text  # a keyword would make another variant and break batches
    assert "multi_compile_local" not in text


@each_pipeline
def test_a_shader_with_an_unknown_name_does_not_compile(pipeline: str, tmp_path: Path) -> None:
    """The compiler checks the whole program, so the tests of variants can fail."""
    with pytest.raises(subprocess.CalledProcessError):
        compile_stage("frag", tmp_path, "march=gone+", pipeline=pipeline)


@dataclass(frozen=True)
class Scene:
    """An imported specimen with the shader's inputs, and the same volumes for the reference."""

    boxes: list[dict[str, Any]]  # farthest first
    blocks: list[Block]  # farthest first
    camera: Camera
    um: float  # length of 1 um in world units

    def draw(self, folder: Path, *defines: str, pipeline: str = "builtin", **values: Any) -> Values:
        boxes = [{**box, "values": {**box["values"], **values}} for box in self.boxes]
        return draw(boxes, self.camera, folder, *defines, pipeline=pipeline)

    def expected(self, blocks: list[Block], *, shading: bool) -> Values:
        width, height = self.camera.size_px
        picture = np.zeros((height, width, 4))
        for block in blocks:
            over = render(block, self.camera, shading=shading)
            picture = over + (1 - over[..., 3:]) * picture
        return picture


@pytest.fixture
def scene(bundle: Path, imported: Callable[..., Any]) -> Callable[[tuple[float, ...]], Scene]:
    """Return a function that views the two tiles from a position, in um from their centre."""

    def look(away_um: tuple[float, ...]) -> Scene:
        found = imported(bundle)
        root = found["root"]
        um = root["scale"][0] * UM
        bounds = load(bundle / "manifest.json")["specimen"]["bounds_um"]
        middle = np.mean([bounds["min"], bounds["max"]], axis=0)
        eye = middle + np.array(away_um)
        camera = Camera(tuple(eye), tuple(middle), (120, 90), fov_deg=35.0)
        view = view_of(camera, middle, um)
        boxes = []
        for _, box in boxes_of(root):
            to_world = np.eye(4)
            to_world[:3, :3] *= root["scale"][0] * box["scale"][0]
            to_world[:3, 3] = box["position"]
            material = box["material"]
            values = {
                **{k: v for k, v in material.items() if not isinstance(v, dict)},
                **view,
                "unity_ObjectToWorld": to_world,
                "unity_WorldToObject": np.linalg.inv(to_world),
            }
            textures = {"volume": material["_Volume"], "table": material["_Table"]}
            mesh = {"vertices": box["vertices"], "triangles": box["triangles"]}
            away = np.linalg.norm(np.subtract(box["position"], view["_WorldSpaceCameraPos"]))
            boxes.append((away, {"values": values, **textures, **mesh}))
        boxes.sort(key=lambda each: -each[0])
        blocks = read_blocks(bundle, [c["id"] for c in found["channels"]])
        blocks.sort(key=lambda b: -np.linalg.norm(np.mean([b.low_um, b.high_um], axis=0) - eye))
        return Scene([box for _, box in boxes], blocks, camera, um)

    return look


def decibels(a: Values, b: Values) -> float:
    return psnr(np.rint(255 * a[..., :3]), np.rint(255 * b[..., :3]))


needs_browser = pytest.mark.skipif(
    chromium() is None, reason="needs SPIRV-Cross, Node and Chromium: run `make mono`"
)


@pytest.mark.slow
@needs_browser
@each_pipeline
@pytest.mark.parametrize("shading", sweep([0.0, 1.0], kept=[1.0]))
def test_an_imported_specimen_is_drawn_as_the_reference_draws_it(
    tmp_path: Path, scene: Callable[..., Scene], shading: float, pipeline: str
) -> None:
    """Importer, positions, textures, shader, culling and blending agree with the reference."""
    seen = scene((9, 7, 30))
    picture = seen.draw(tmp_path, pipeline=pipeline, _Shading=shading)
    expected = seen.expected(seen.blocks, shading=shading > 0)
    assert expected[..., 3].max() > 0.5
    assert np.abs(picture - expected).mean() < 0.002
    assert decibels(picture, expected) > 40
    flipped = np.abs(picture[:, ::-1] - expected).mean()
    assert flipped > 5 * np.abs(picture - expected).mean()  # a mirrored image would be detected


@pytest.mark.slow
@needs_browser
@each_pipeline
def test_rays_end_at_the_depth_of_the_scene(
    tmp_path: Path, scene: Callable[..., Scene], pipeline: str
) -> None:
    """Voxels behind a wall are not drawn. The wall crosses the volume at the centres of a slice."""
    seen = scene((0, 0, 30))
    slices = 6  # number of hidden slices, of 8
    blocks = []
    for block in seen.blocks:
        low = np.add(block.low_um, [0, 0, slices * block.spacing_um()[2]])
        channels = tuple(voxels[slices:] for voxels in block.channels)
        blocks.append(replace(block, low_um=tuple(low), channels=channels))
    depth = (seen.camera.eye_um[2] - blocks[0].low_um[2]) * seen.um
    # The depth buffer is 1 everywhere, so the wall is at the distance 1 / (z + w).
    wall: dict[str, Any] = {
        "_ZBufferParams": [0, 0, 0.25 / depth, 0.75 / depth],
        "_ProjectionParams": [1, 0, 0, 0],
        "_SceneDepth": 1.0,
    }
    picture = seen.draw(tmp_path, pipeline=pipeline, _Shading=0.0, **wall)
    assert decibels(picture, seen.expected(blocks, shading=False)) > 40
    assert decibels(picture, seen.expected(seen.blocks, shading=False)) < 30
    near = {**wall, "_ZBufferParams": [0, 0, 0, 50 / depth]}
    assert seen.draw(tmp_path, pipeline=pipeline, **near).max() == 0
    near["_SceneDepth"] = 0.0
    assert seen.draw(tmp_path, pipeline=pipeline, **near).max() > 0


@pytest.mark.slow
@needs_browser
@each_pipeline
def test_a_gamma_project_gets_encoded_colours(
    tmp_path: Path, scene: Callable[..., Scene], pipeline: str
) -> None:
    seen = scene((9, 7, 30))
    one = replace(seen, boxes=seen.boxes[:1])  # a gamma project blends several boxes differently
    linear = one.draw(tmp_path, pipeline=pipeline)
    coded = one.draw(tmp_path, GAMMA, pipeline=pipeline)
    assert np.allclose(coded[..., 3], linear[..., 3], atol=1e-6)
    drawn = linear[..., 3] > 0.05
    color = linear[drawn, :3] / linear[drawn, 3:]
    assert np.allclose(coded[drawn, :3] / coded[drawn, 3:], encoded(color), atol=0.01)
    assert np.abs(coded - linear).max() > 0.1
