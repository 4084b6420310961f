"""Compile the Unity package's shader as HLSL by glslang, and draw with it as WebGL in Chromium.

tests/unity/unity_shaders stands in for Unity's include files.
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
MARKS = {"builtin": ("CGPROGRAM", "ENDCG"), "universal": ("HLSLPROGRAM", "ENDHLSL")}


def has_compiler() -> bool:
    return shutil.which("glslangValidator") is not None


def chromium() -> str | None:
    """Return the browser, if all programs for drawing are installed."""
    found = os.environ.get("CHROMIUM") or shutil.which("chromium")
    tools = all(shutil.which(name) for name in ("node", "spirv-cross", "glslangValidator"))
    return found if tools and (VIEWER / "node_modules" / "playwright-core").is_dir() else None


def program(pipeline: str = "builtin", shader: Path = SHADER) -> str:
    """Return a sub-shader's HLSL, without Unity's own pragmas.

    pipeline  "builtin" or "universal"
    """
    first, last = MARKS[pipeline]
    (found,) = re.findall(rf"{first}\n(.*?){last}", shader.read_text("utf-8"), re.DOTALL)
    return re.sub(r"^ *#pragma.*\n", "", found, flags=re.MULTILINE)


def compile_stage(
    stage: str, folder: Path, *defines: str, pipeline: str = "builtin", shader: Path = SHADER
) -> Path:
    """Return the SPIR-V of a stage. Raises CalledProcessError with the compiler's output."""
    source, out = folder / f"pass_of_{pipeline}.hlsl", folder / f"{pipeline}_{stage}.spv"
    source.write_text(program(pipeline, shader))
    subprocess.run(
        [
            *("glslangValidator", "-D", "-V", "--auto-map-bindings", "--auto-map-locations"),
            *("-S", stage, "-e", stage, *(f"-D{name}=1" for name in defines)),
            *(f"-I{SHADER.parent}", f"-I{TESTS / 'unity_shaders'}", "-o", str(out), str(source)),
        ],
        check=True,
        capture_output=True,
        timeout=60,
    )
    return out


def cross(spirv: Path, *options: str) -> str:
    command = ["spirv-cross", str(spirv), *options]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def view_of(camera: Camera, middle: NDArray[np.float64], scale: float) -> dict[str, Any]:
    """Return the values that Unity gives to shaders for a camera in the mirrored specimen (um).

    middle, scale: place of the specimen's root in um, and world units per um.
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
        "_ScaledScreenParams": [width, height, 1 + 1 / width, 1 + 1 / height],
    }


def uniform_blocks(fragment: Path) -> list[dict[str, Any]]:
    """Return the uniform blocks of a stage: name, bytes, and the members' names, types, offsets."""
    reflected = json.loads(cross(fragment, "--reflect"))
    return [
        {
            "name": ubo["name"],
            "bytes": ubo["block_size"],
            "members": reflected["types"][ubo["type"]]["members"],
        }
        for ubo in reflected["ubos"]
    ]


def filled(block: dict[str, Any], values: dict[str, Any]) -> str:
    """Return the bytes of a uniform block, in base 64."""
    data = bytearray(block["bytes"] + 16)
    for member in block["members"]:
        value = np.array(values.get(member["name"], 0.0), np.float32)
        if member["type"] == "mat4":
            value = value.T  # matrices are stored column by column
        found = value.tobytes()
        data[member["offset"] : member["offset"] + len(found)] = found
    return base64.b64encode(data).decode()


def draw(
    boxes: list[dict[str, Any]],
    camera: Camera,
    folder: Path,
    *defines: str,
    pipeline: str = "builtin",
) -> NDArray[np.float64]:
    """Return a picture (height, width, 4), linear and premultiplied, top row first.

    boxes: from the farthest; each has `values` (uniforms by name), `volume`, `table` (as the
        harness prints textures), `vertices` and `triangles`
    """
    spirv = {stage: compile_stage(stage, folder, *defines, pipeline=pipeline) for stage in STAGES}
    glsl = {stage: cross(path, "--es", "--version", "300") for stage, path in spirv.items()}
    # WebGL matches the variables of two stages by name.
    for out, into in re.findall(r"out \w+ (_\w+?_(\w+));", glsl["vert"]):
        glsl["vert"] = re.sub(rf"\b{out}\b", f"v_{into}", glsl["vert"])
        glsl["frag"] = re.sub(rf"\bi_{into}\b", f"v_{into}", glsl["frag"])
    blocks = uniform_blocks(spirv["frag"])
    samplers = {
        name: re.search(rf"uniform .*sampler[23]D (\w*{name}\w*);", glsl["frag"])[1]  # type: ignore[index]
        for name in ("_Volume", "_Table", "_CameraDepthTexture")
    }
    width, height = camera.size_px
    asked = {
        "vertex": glsl["vert"],
        "fragment": glsl["frag"],
        "blocks": [block["name"].replace("$", "_") for block in blocks],
        "samplers": samplers,
        "width": width,
        "height": height,
        "boxes": [
            {
                "uniforms": [filled(block, box["values"]) for block in blocks],
                **{key: box[key] for key in ("volume", "table", "vertices", "triangles")},
            }
            for box in boxes
        ],
    }
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
