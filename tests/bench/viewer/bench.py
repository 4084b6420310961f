"""Print the table of `make bench-viewer`: our ray march beside other renderers for the web.

vtk.js, NiiVue, three's own example and ours draw the same volume with the same transfer function,
camera and size (512 x 512). They draw alternately in one headless Chromium, for ROUNDS rounds (4).
The table has the CPU time of the process that draws, and the median of the rounds' ratios to ours.
Software draws unless STEREOCELL_GPU_FLAGS holds Chromium's flags for a GPU. On a GPU, ratios are
those of the time by the clock, because the CPU only waits.

Each renderer is compared with a float64 reference in the way in which it blends: ours adds light,
and others blend encoded colours. Errors are measured over the pixels where the reference shows
something, in three ways:

- opacity: of the opacity that the picture's brightness stands for, without light
- colour: of the colours before they are encoded for the screen, relative to the scene's colour
- screen: of the 8-bit picture. Where little is seen, the same error of light is ten times as large
  in ours, because light is encoded after it was added.

Light is off in comparisons, because each renderer has its own. One row has ours with its light.
scene.py and src/*.ts state how closely the settings of other renderers can be matched.

The rows "at the last comparison" of the docs are those of another checkout, in which `make setup`
was run: STEREOCELL_VIEWER=/path/to/other/viewer_gltf make bench-viewer ARGS="--only nuclei_soft".
The pictures stay in OUT, and so do the references, which take most of the first run.
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray
from PIL import Image

sys.path.insert(1, str(Path(__file__).parents[1]))
sys.path.insert(1, str(Path(__file__).parents[2]))

from machine import stated
from scene import SIZE_PX, Scene, brain_cells, head, nuclei, reference

from support.reference_raymarch import Values, decoded, encode, encoded, path_voxels, psnr

HERE = Path(__file__).parent
ROUNDS = int(os.environ.get("ROUNDS", "4"))
IS_GPU = "STEREOCELL_GPU_FLAGS" in os.environ
# By the camera of another renderer: the camera of our renderer with which times are compared
RIVALS = {"parallel": "narrow"}
HEAD = (
    ("scene", "program", "camera", "CPU ms", "ms", "of ours", "samples", "dB of", "dB of", "dB on"),
    ("", "", "", "a frame", "a frame", "", "a ray", "opacity", "colour", "screen"),
)
COLUMNS = "{:16} {:32} {:12} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}"
NIIVUE_OPAQUE = 0.95  # opacity at which NiiVue's rays end; NiiVue then scales the opacity to 1


@dataclass(frozen=True)
class Run:
    name: str
    renderer: str
    scene: str
    camera: str
    setting: float
    label: str  # name of the row in the table
    voxels: float | None  # length of a step, in voxels; None: the renderer counts its steps
    shading: bool = False


class Timing(TypedDict):
    """The measures of a run by run.ts."""

    name: str
    ms: list[float]
    cpu_ms: list[float]
    steps: float | None


def runs_on(scene: str) -> list[Run]:
    """Return the runs on a scene."""

    def run(renderer: str, camera: str, setting: float, label: str, step: float | None) -> Run:
        name = f"{scene}-{renderer}-{camera}-{setting:g}"
        is_lit = renderer == "ours" and setting == 1
        return Run(name, renderer, scene, camera, setting, label, step, is_lit)

    runs = [
        *(run("vtk", "perspective", h, f"vtk.js, step {h:g}", h) for h in (1, 0.5)),
        *(run("three", "perspective", h, f"three's example, step {h:g}", h) for h in (1, 0.5)),
        run("niivue", "parallel", 0, "NiiVue", 1),
        *(run("ours", camera, 0, "ours", None) for camera in ("perspective", "narrow")),
        run("ours", "perspective", 1, "ours, with its light", None),
    ]
    if scene.startswith("mri"):
        runs += [
            run("traced", "perspective", 0, "ours, a path scattered once", None),
            run("traced", "perspective", 1, "ours, a path scattered often", None),
        ]
    return runs


def missing() -> str | None:
    """Return the reason why the bench can't run on this machine, or None."""
    if shutil.which("node") is None:
        return "no node"
    chromium = os.environ.get("CHROMIUM") or "/usr/bin/chromium"
    return None if Path(chromium).exists() else f"no Chromium at {chromium}: set CHROMIUM"


def picture_of(run: Run, folder: Path) -> NDArray[np.uint8]:
    """Return a run's picture (height, width, 3), top row first."""
    width, height = SIZE_PX
    rgba = np.frombuffer((folder / f"{run.name}.rgba").read_bytes(), np.uint8)
    return rgba.reshape(height, width, 4)[::-1, :, :3]


def unblended(picture: NDArray[np.uint8], color: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return NiiVue's picture with opacity multiplied in once instead of twice."""
    share = np.sqrt(NIIVUE_OPAQUE * picture / color)
    pixels: NDArray[np.uint8] = np.rint(color * np.clip(share, 0, 1)).astype(np.uint8)
    return pixels


def psnr_of_opacity(
    picture: NDArray[np.uint8], ideal: Values, color: Values, *, adds_light: bool
) -> float:
    """Return the PSNR, dB, of a one-colour picture's opacity where the reference is not empty."""
    k = int(np.argmax(color))
    level = picture[..., k] / 255
    shown = decoded(level) / color[k] if adds_light else level / encoded(color)[k]
    opacity = ideal[..., 3]
    error = (np.clip(shown, 0, 1) - opacity)[opacity > 0]
    return decibels(error)


def psnr_of_color(
    picture: NDArray[np.uint8], ideal: Values, color: Values, *, adds_light: bool
) -> float:
    """Return the PSNR, dB, of the colours as they were blended, where the reference is not empty.

    The peak is the scene's colour at full opacity. So without light, an error of opacity alone
    gives the same PSNR in both ways of blending.
    """
    alpha = ideal[..., 3:]
    there = alpha[..., 0] > 0
    if adds_light:
        shown, expected, full = decoded(picture / 255), ideal[..., :3], color
    else:
        tint = ideal[there][:, :3] / alpha[there]
        expected = np.zeros_like(ideal[..., :3])
        expected[there] = encoded(tint) * alpha[there]
        shown, full = picture / 255, encoded(color)
    return decibels((shown - expected)[there] / np.sqrt(np.mean(full**2)))


def decibels(error: Values) -> float:
    """Return the PSNR, dB, of errors relative to the peak."""
    return float(-10 * np.log10(np.mean(error**2)))


def of_ours(run: Run, timings: dict[str, Timing]) -> str:
    """Return the median ratio of a run's time to that of our march without light."""
    rival = timings.get(f"{run.scene}-ours-{RIVALS.get(run.camera, run.camera)}-0")
    if rival is None:
        return ""
    its, ours = (t["ms"] if IS_GPU else t["cpu_ms"] for t in (timings[run.name], rival))
    return f"{statistics.median(a / b for a, b in zip(its, ours, strict=True)):.2f}"


def rows(run: Run, scene: Scene, timings: dict[str, Timing], folder: Path) -> list[str]:
    """Return a run's lines of the table."""
    timing = timings[run.name]
    found = picture_of(run, folder)
    Image.fromarray(found).save(folder / f"{run.name}.png")
    cpu, ms = (f"{statistics.median(timing[key]):.0f}" for key in ("cpu_ms", "ms"))
    spent = (run.scene, run.label, run.camera, cpu, ms, of_ours(run, timings))
    if run.renderer == "traced":  # its light has nothing to be compared with
        return [COLUMNS.format(*spent, "", "", "", "")]
    path = path_voxels(scene.block, scene.cameras[run.camera])
    most = float(path[path > 0].mean())
    samples = f"{timing['steps']:.0f}" if run.voxels is None else f"<= {most / run.voxels:.0f}"
    ideal = reference(scene, run.camera, run.shading, folder)
    lines = [COLUMNS.format(*spent, samples, *errors(found, ideal, scene, run))]
    if run.renderer == "niivue":
        color = encode(np.array([[[*scene.block.colors[0], 1.0]]]))
        undone = errors(unblended(found, color), ideal, scene, run)
        lines.append(COLUMNS.format("", "  its blending undone", "", "", "", "", "", *undone))
    return lines


def errors(picture: NDArray[np.uint8], ideal: Values, scene: Scene, run: Run) -> tuple[str, ...]:
    """Return the PSNR, dB, of opacity, of colour and on the screen."""
    adds_light = run.renderer == "ours"  # other renderers blend encoded colours
    color = scene.block.colors[0]
    opacity = psnr_of_opacity(picture, ideal, color, adds_light=adds_light)
    found = (
        psnr_of_color(picture, ideal, color, adds_light=adds_light),
        psnr(picture, encode(ideal, adds_light=adds_light), ideal[..., 3] > 0),
    )
    return "" if run.shading else f"{opacity:.1f}", *(f"{value:.1f}" for value in found)


def scenes_of(only: list[str] | None, *, is_full: bool) -> list[Scene]:
    """Return the scenes to measure; all if `only` is None."""
    scenes = [*nuclei(), brain_cells(), *head()]
    if is_full:
        scenes += head(is_full=True)
    names = [scene.name for scene in scenes]
    for name in only or ():
        if name not in names:
            sys.exit(f"bench-viewer: no scene {name}, expected one of {', '.join(names)}")
    return [scene for scene in scenes if only is None or scene.name in only]


def main(folder: Path, only: list[str] | None, *, is_full: bool) -> None:
    """Measure, and print the table."""
    reason = missing()
    if reason is not None:
        print(f"bench-viewer: skipped: {reason}")
        return
    folder.mkdir(parents=True, exist_ok=True)
    scenes = scenes_of(only, is_full=is_full)
    for scene in scenes:
        scene.write(folder)
    runs = {scene.name: runs_on(scene.name) for scene in scenes}
    job = folder / "job.json"
    asked = [asdict(run) for each in runs.values() for run in each]
    job.write_text(json.dumps({"rounds": ROUNDS, "runs": asked}))
    tsx = HERE / "node_modules" / ".bin" / "tsx"
    subprocess.run([tsx, HERE / "run.ts", job, folder], check=True)
    measured: list[Timing] = json.loads((folder / "timings.json").read_text("utf-8"))
    timings = {timing["name"]: timing for timing in measured}
    for head_line in HEAD:
        print(COLUMNS.format(*head_line))
    for scene in scenes:
        for run in runs[scene.name]:
            print(*rows(run, scene, timings, folder), sep="\n", flush=True)
    if not head():
        print("the real MRI: skipped: no STEREOCELL_DATA")


def parsed() -> argparse.Namespace:
    """Return the arguments."""
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", nargs="+", metavar="SCENE", help="scenes to measure")
    parser.add_argument("--full-mri", action="store_true", help="also the MRI as it was measured")
    return parser.parse_args()


if __name__ == "__main__":
    args = parsed()
    with stated():
        main(args.out, args.only, is_full=args.full_mri)
