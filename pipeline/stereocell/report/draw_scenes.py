"""Pictures of meshes, drawn in a separate process: without OpenGL, VTK ends its process."""

import json
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from stereocell.preview.draw_slices import encode

# run by its path, with -P: it needs no other module of this package
COMMAND = (sys.executable, "-P", str(Path(__file__).with_name("draw_meshes_process.py")))
_SECONDS = 120.0, 30.0  # time limit: for the process, and in addition for each picture
_REMEDY = "pictures of meshes need off-screen OpenGL, as Debian's libegl1 and libgl1-mesa-dri give"


@dataclass(frozen=True, slots=True)
class Surface:
    """A mesh as `save_unit` wrote it (.npz), and its colour, sRGB 0..1."""

    file: str
    color: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Scene:
    """The content of one picture. Boxes are (min, max) corners (x, y, z) in world um.

    boxes  drawn as outlines
    frame  fills the picture
    size   pixels: width, largest height
    """

    surfaces: tuple[Surface, ...]
    boxes: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...]
    frame: tuple[tuple[float, ...], tuple[float, ...]]
    size: tuple[int, int]


@dataclass(frozen=True, slots=True)
class Picture:
    """A WebP file with its size in pixels."""

    data: bytes
    width: int
    height: int


def draw_scenes(scenes: Sequence[Scene]) -> tuple[list[Picture], str]:
    """Return a picture of each scene and "", or no picture and the reason why it can't draw.

    Raises RuntimeError where the drawing itself fails.
    """
    with tempfile.TemporaryDirectory(prefix="stereocell-") as name:
        folder = Path(name)
        (folder / "scenes.json").write_text(json.dumps([asdict(scene) for scene in scenes]))
        allowed = _SECONDS[0] + _SECONDS[1] * len(scenes)
        try:
            ended = subprocess.run(
                [*COMMAND, name], capture_output=True, text=True, timeout=allowed, check=False
            )
        except subprocess.TimeoutExpired:
            return [], f"the drawing process had not ended after {allowed:g} s; {_REMEDY}"
        if ended.returncode < 0:
            how = signal.Signals(-ended.returncode).name
            return [], f"the drawing process was ended by {how}; {_REMEDY}"
        if ended.returncode:
            raise RuntimeError(f"drawing the meshes failed:\n{ended.stderr}")
        refusal = folder / "refused.txt"
        if refusal.exists():
            return [], f"{refusal.read_text()}; {_REMEDY}"
        return [_read(folder / f"{i}.png") for i in range(len(scenes))], ""


def can_draw() -> str:
    """Return the reason why this machine can't draw meshes; empty: it can. Draws one triangle."""
    with tempfile.TemporaryDirectory(prefix="stereocell-") as name:
        file = Path(name) / "triangle.npz"
        corners = np.eye(3, dtype=np.float32)
        np.savez(file, positions=corners, triangles=np.array([[0, 1, 2]]), normals=corners)
        unit = ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
        triangle = Surface(str(file), (1.0, 1.0, 1.0))
        return draw_scenes([Scene((triangle,), (), unit, (32, 32))])[1]


def _read(path: Path) -> Picture:
    with Image.open(path) as picture:
        return Picture(encode(picture.convert("RGB")), *picture.size)
