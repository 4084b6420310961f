"""Draw a sample's files in the programs that open them, with the view of the stage's camera."""

import json
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd

from stereocell.export.options import ExportOptions
from stereocell.export.write import export_stage
from stereocell.storage.overwriting import forcing
from stereocell.usd.read_stage import hinted_box, tile_prims
from support.blender_session import PYTHON
from support.dcc.view import View, fit, view_of, write_camera

REPOSITORY = Path(__file__).parents[3]
STORM = REPOSITORY / "tests/blender/storm.py"


@dataclass(frozen=True, slots=True)
class Files:
    """A sample's files, and the camera's view in the units of each, by the file's name."""

    stage: Path
    flat: Path
    usdz: Path
    glb: Path
    views: dict[str, View]


def export_files(stage_path: Path, folder: Path) -> Files:
    """Export a stage to the files that other programs open; return their paths and views."""
    stage = Usd.Stage.Open(str(stage_path))
    view = view_of(stage)
    names = {"flat": "flat.usdc", "usdz": "light.usdz", "glb": "scene.glb"}
    files = {key: folder / name for key, name in names.items()}
    with forcing(True):
        for file in files.values():
            export_stage(stage_path, file, options=ExportOptions(lod=1))
    views = {"stage": view, "flat": view, "glb": fit(view, 1e-6, np.zeros(3))}
    boxes = np.array([hinted_box(prim) for prim in tile_prims(stage)])
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    foot = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    light = Sdf.Layer.FindOrOpen(str(files["usdz"]))
    scale = light.customLayerData["stereocell"]["scale"]
    views["usdz"] = fit(view, scale * 1e-6, foot)
    return Files(stage_path, **files, views=views)


def draw_by_storm(file: Path, view: View, unit: float, picture: Path, width: int) -> None:
    """Draw a USD file by Storm into a picture; only the lights of the file shine."""
    layer = write_camera(file, picture.with_suffix(".usda"), view, unit)
    command = [PYTHON, str(STORM), str(layer), "/View", str(picture), str(width)]
    drawn = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert drawn.returncode == 0, drawn.stderr[-2000:]


def draw_for_the_web(jobs: list[dict[str, object]], folder: Path) -> None:
    """Draw files by three.js and Cesium; the viewer's scripts/draw_models.ts documents jobs."""
    listed = folder / "jobs.json"
    listed.write_text(json.dumps(jobs, default=str))
    command = ["npx", "tsx", "scripts/draw_models.ts", str(listed)]
    drawn = subprocess.run(
        command, cwd=REPOSITORY / "viewer_gltf", capture_output=True, text=True, timeout=600
    )
    assert drawn.returncode == 0, drawn.stderr[-3000:]


def draw_by_blender(jobs: list[dict[str, object]], folder: Path) -> None:
    """Draw files by Blender and by the add-on; blender/draw.py documents the jobs."""
    listed = folder / "blender.json"
    listed.write_text(json.dumps(jobs, default=str))
    command = [PYTHON, str(REPOSITORY / "tests/blender/draw.py"), str(listed)]
    # EEVEE asks for OpenGL 4.6, and Mesa says of its drawing by software that it is 4.5
    environment = {**os.environ, "EGL_PLATFORM": "surfaceless", "MESA_GL_VERSION_OVERRIDE": "4.6"}
    drawn = subprocess.run(
        command, capture_output=True, text=True, timeout=300 + 120 * len(jobs), env=environment
    )
    assert drawn.returncode == 0, drawn.stderr[-3000:]
