"""The Unity package's shader whole: it compiles as HLSL, and draws what was imported."""

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stereocell.bundle.write import write_bundle
from stereocell.engine.run import Engine
from support.bundle_picture import read_blocks
from support.bundles import load, write_tiles
from support.reference_raymarch import Camera, psnr, render
from support.unity_shader import STAGES, chromium, compile_stage, draw, has_compiler, view_of

pytestmark = pytest.mark.skipif(
    not has_compiler(), reason="needs glslangValidator: run `make mono`"
)
UM = 1e-6
DEPTH, GAMMA, STEREO = (
    "STEREOCELL_SCENE_DEPTH",
    "UNITY_COLORSPACE_GAMMA",
    "UNITY_STEREO_INSTANCING_ENABLED",
)


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("defines", [(), (DEPTH,), (GAMMA,), (STEREO,), (STEREO, DEPTH, GAMMA)])
def test_each_variant_compiles(stage: str, defines: tuple[str, ...], tmp_path: Path) -> None:
    assert compile_stage(stage, tmp_path, *defines).stat().st_size > 1000


def test_an_unknown_name_does_not(tmp_path: Path) -> None:
    """What the test above is worth: the compiler sees the whole program."""
    with pytest.raises(subprocess.CalledProcessError):
        compile_stage("frag", tmp_path, "march=gone+")


@pytest.mark.slow
@pytest.mark.skipif(
    chromium() is None, reason="needs SPIRV-Cross, Node and Chromium: run `make mono`"
)
@pytest.mark.parametrize("shading", [0.0, 1.0])
def test_an_imported_specimen_is_drawn_as_the_reference_draws_it(
    tmp_path: Path, imported: Callable[..., Any], shading: float
) -> None:
    """From the bundle to the pixel: importer, placements, textures, shader, culling, blending."""
    bundle = tmp_path / "bundle"
    write_bundle(write_tiles(tmp_path / "stage"), bundle, None, run=Engine(0).run)
    found = imported(bundle)
    root = found["root"]
    scale = root["scale"][0] * UM
    bounds = load(bundle / "manifest.json")["specimen"]["bounds_um"]
    middle = np.mean([bounds["min"], bounds["max"]], axis=0)
    camera = Camera(tuple(middle + np.array([9, 7, 30])), tuple(middle), (120, 90), fov_deg=35.0)
    view = view_of(camera, middle, scale)
    boxes = []
    for tile in root["children"]:
        (volume,) = (c for c in tile["children"] if c["name"] == "volume")
        for box in volume["children"]:
            to_world = np.eye(4)
            to_world[:3, :3] *= root["scale"][0] * box["scale"][0]
            to_world[:3, 3] = box["position"]
            material = box["material"]
            values = {
                **{k: v for k, v in material.items() if not isinstance(v, dict)},
                **box["block"],
                **view,
                "unity_ObjectToWorld": to_world,
                "unity_WorldToObject": np.linalg.inv(to_world),
                "_Shading": shading,
            }
            textures = {"volume": material["_Volume"], "table": material["_Table"]}
            mesh = {"vertices": box["vertices"], "triangles": box["triangles"]}
            away = np.linalg.norm(np.subtract(box["position"], view["_WorldSpaceCameraPos"]))
            boxes.append((away, {"values": values, **textures, **mesh}))
    boxes.sort(key=lambda each: -each[0])
    picture = draw([box for _, box in boxes], camera, tmp_path)

    blocks = read_blocks(bundle, [c["id"] for c in found["channels"]])
    eye = np.array(camera.eye_um)
    blocks.sort(key=lambda b: -np.linalg.norm(np.mean([b.low_um, b.high_um], axis=0) - eye))
    expected = np.zeros_like(picture)
    for block in blocks:
        over = render(block, camera, shading=shading > 0)
        expected = over + (1 - over[..., 3:]) * expected
    assert expected[..., 3].max() > 0.5
    assert np.abs(picture - expected).mean() < 0.002
    assert psnr(np.rint(255 * picture[..., :3]), np.rint(255 * expected[..., :3])) > 40
    flipped = np.abs(picture[:, ::-1] - expected).mean()
    assert flipped > 5 * np.abs(picture - expected).mean()  # that a mirrored one would be seen
