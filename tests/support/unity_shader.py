"""The Unity package's shader, compiled as HLSL by glslang, and drawn with: as WebGL, in Chromium.

What Unity's own include gives stands in tests/unity/unity_shaders.
"""

import base64
import json
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from support.reference_raymarch import Camera
from support.unity_meta import PACKAGE

TESTS = Path(__file__).parents[1] / "unity"
VIEWER = Path(__file__).parents[2] / "viewer_gltf"
SHADER = PACKAGE / "Runtime" / "Shaders" / "StereoCellVolume.shader"
STAGES = ("vert", "frag")


def has_compiler() -> bool:
    return shutil.which("glslangValidator") is not None


def chromium() -> str | None:
    """Return the browser, if it and all else that draws is there."""
    found = os.environ.get("CHROMIUM") or shutil.which("chromium")
    tools = all(shutil.which(name) for name in ("node", "spirv-cross", "glslangValidator"))
    return found if tools and (VIEWER / "node_modules" / "playwright-core").is_dir() else None


def program() -> str:
    """Return the shader's HLSL, without Unity's own pragmas."""
    (found,) = re.findall(r"CGPROGRAM\n(.*?)ENDCG", SHADER.read_text("utf-8"), re.DOTALL)
    return re.sub(r"^ *#pragma.*\n", "", found, flags=re.MULTILINE)


def compile_stage(stage: str, folder: Path, *defines: str) -> Path:
    """Return the SPIR-V of a stage. Raises CalledProcessError with the compiler's words."""
    source, out = folder / "volume.hlsl", folder / f"{stage}.spv"
    source.write_text(program())
    subprocess.run(
        [
            *("glslangValidator", "-D", "-V", "--auto-map-bindings", "--auto-map-locations"),
            *("-S", stage, "-e", stage, *(f"-D{name}=1" for name in defines)),
            *(f"-I{SHADER.parent}", f"-I{TESTS / 'unity_shaders'}", "-o", str(out), str(source)),
        ],
        check=True,
        capture_output=True,
    )
    return out


def cross(spirv: Path, *options: str) -> str:
    command = ["spirv-cross", str(spirv), *options]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def view_of(camera: Camera, middle: NDArray[np.float64], scale: float) -> dict[str, Any]:
    """Return what Unity hands to shaders, of a camera in the specimen (um), which is mirrored.

    middle, scale: where the specimen's root is, um, and world units of a um.
    """
    assert camera.fov_deg is not None
    mirror = np.array([-1.0, 1.0, 1.0])
    eye = (np.array(camera.eye_um) - middle) * mirror * scale
    view = np.eye(4)
    view[:3, :3] = np.stack(camera.axes()) * mirror  # right, up, back in Unity's world
    view[:3, 3] = -view[:3, :3] @ eye
    width, height = camera.size_px
    f = 1 / np.tan(np.deg2rad(camera.fov_deg) / 2)
    near, far = 1e-3, 1e3
    projection = np.zeros((4, 4))
    projection[0, 0], projection[1, 1] = f * height / width, f
    projection[2, 2] = -(far + near) / (far - near)
    projection[2, 3], projection[3, 2] = -2 * far * near / (far - near), -1
    return {
        "unity_MatrixV": view,
        "unity_MatrixVP": projection @ view,
        "_WorldSpaceCameraPos": eye,
        "_ProjectionParams": [1, near, far, 1 / far],
    }


def draw(
    boxes: list[dict[str, Any]], camera: Camera, folder: Path, *defines: str
) -> NDArray[np.float64]:
    """Return a picture (height, width, 4), linear and premultiplied, top row first.

    boxes: from the farthest; each has `values` (uniforms by name), `volume`, `table` (as the
        harness prints textures), `vertices` and `triangles`
    """
    spirv = {stage: compile_stage(stage, folder, *defines) for stage in STAGES}
    glsl = {stage: cross(path, "--es", "--version", "300") for stage, path in spirv.items()}
    # stages of WebGL agree by names
    for out, into in re.findall(r"out \w+ (_\w+?_(\w+));", glsl["vert"]):
        glsl["vert"] = re.sub(rf"\b{out}\b", f"v_{into}", glsl["vert"])
        glsl["frag"] = re.sub(rf"\bi_{into}\b", f"v_{into}", glsl["frag"])
    reflected = json.loads(cross(spirv["frag"], "--reflect"))
    (ubo,) = reflected["ubos"]
    members = reflected["types"][ubo["type"]]["members"]
    block = re.search(r"uniform (\w+)\s*\{", glsl["frag"])
    assert block is not None
    names = [
        "_Volume",
        "_Table",
        *(["_CameraDepthTexture"] if "STEREOCELL_SCENE_DEPTH" in defines else []),
    ]
    samplers = {
        name: re.search(rf"uniform .*sampler[23]D (\w*{name}\w*);", glsl["frag"])[1]  # type: ignore[index]
        for name in names
    }
    width, height = camera.size_px
    asked = {
        "vertex": glsl["vert"],
        "fragment": glsl["frag"],
        "block": block[1],
        "samplers": samplers,
        "width": width,
        "height": height,
        "boxes": [],
    }
    for box in boxes:
        data = bytearray(ubo["block_size"] + 16)
        for member in members:
            value = np.array(box["values"].get(member["name"], 0.0), np.float32)
            if member["type"] == "mat4":
                value = value.T  # column by column
            found = value.tobytes()
            data[member["offset"] : member["offset"] + len(found)] = found
        asked["boxes"].append(
            {
                "uniforms": base64.b64encode(data).decode(),
                **{key: box[key] for key in ("volume", "table", "vertices", "triangles")},
            }
        )
    path = chromium()
    assert path is not None
    script = (TESTS / "picture.mjs").read_text("utf-8")
    done = subprocess.run(
        ["node", "--input-type=module", "-e", script, "--", path],
        input=json.dumps(asked).encode(),
        capture_output=True,
        cwd=VIEWER,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr.decode()
    pixels = np.frombuffer(done.stdout, np.float32).astype(np.float64)
    return pixels.reshape(height, width, 4)[::-1]
