"""Print the tables of `make bench-viewer`: our ray march beside other renderers for the web.

vtk.js, NiiVue, three's own example and ours draw the same volume with the same transfer function,
camera and size (512 x 512) in one headless Chromium, alternately, for ROUNDS rounds. The table has
the median time, and the median of the rounds' ratios to ours. Software draws unless
STEREOCELL_GPU_FLAGS holds Chromium's flags for a GPU, so only ratios are meaningful.

PSNR compares pictures with the float64 reference in three ways: over the whole picture, over the
pixels where the reference shows something, and there by opacity alone. Ours adds light, so a small
opacity changes 8-bit values ten times as much as in other renderers, which blend encoded colours.
The pictures stay in OUT.

Light is off in comparisons, because each renderer has its own. scene.py and src/*.ts state how
closely the settings of other renderers can be matched.
"""

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

sys.path.insert(0, str(Path(__file__).parents[2]))

from scene import SIZE_PX, Scene, brain_cells, head, nuclei, reference

from support.reference_raymarch import decoded, encode, encoded, path_voxels, psnr

HERE = Path(__file__).parent
ROUNDS = int(os.environ.get("ROUNDS", "15"))
# By the camera of another renderer: the camera of our renderer with which times are compared
RIVALS = {"parallel": "narrow"}
HEAD = (
    ("scene", "camera", "ms", "of ours", "samples", "PSNR", "where", "of its"),
    ("", "", "", "", "a ray", "dB", "drawn", "opacity"),
)
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
    steps: float | None


def runs_on(scene: str) -> list[Run]:
    """Return the runs on a scene."""

    def run(renderer: str, camera: str, setting: float, label: str, step: float | None) -> Run:
        name = f"{scene}-{renderer}-{camera}-{setting:g}"
        return Run(name, renderer, scene, camera, setting, label, step)

    peers = [
        *(run("vtk", "perspective", h, f"vtk.js, step {h:g}", h) for h in (1, 0.5, 0.25)),
        *(run("three", "perspective", h, f"three's example, step {h:g}", h) for h in (1, 0.5)),
        run("three", "perspective", 0, "three's example untouched: MIP", 1),
        run("niivue", "parallel", 0, "NiiVue", 1),
    ]
    ours = [run("ours", camera, 0, "ours", None) for camera in ("perspective", "narrow")]
    return peers + ours + [lit(scene)]


def lit(scene: str) -> Run:
    """Return the run of our renderer with the viewer's light."""
    return Run(
        f"{scene}-ours-lit", "ours", scene, "perspective", 1, "ours, with its light", None, True
    )


def runs_on_head(scene: str) -> list[Run]:
    """Return the runs on the real MRI: steps of a whole voxel, and one sample per pixel."""
    given = [
        ("vtk", "perspective", 1, "vtk.js, step 1"),
        ("three", "perspective", 1, "three's example, step 1"),
        ("niivue", "parallel", 0, "NiiVue"),
        ("ours", "perspective", 1, "ours, with its light"),
        ("traced", "perspective", 0, "ours, a sample of light, once"),
        ("traced", "perspective", 1, "ours, a sample of light, many"),
        ("ours", "narrow", 0, "ours"),
        ("ours", "perspective", 0, "ours"),
    ]
    return [
        Run(f"{scene}-{renderer}-{camera}-{setting}", renderer, scene, camera, setting, label, 1)
        for renderer, camera, setting, label in given
    ]


def head_row(run: Run, timings: dict[str, Timing], folder: Path) -> str:
    """Return a run's line of the second table: time only, because renderers differ in light."""
    Image.fromarray(picture_of(run, folder)).save(folder / f"{run.name}.png")
    ms = timings[run.name]["ms"]
    rival = timings[f"{run.scene}-ours-{RIVALS.get(run.camera, run.camera)}-0"]["ms"]
    ratio = statistics.median(its / ours for its, ours in zip(ms, rival, strict=True))
    median = statistics.median(ms)
    return f"{run.scene:15} {run.label:32} {run.camera:12} {median:7.0f} {ratio:7.2f}"


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
    picture: NDArray[np.uint8],
    opacity: NDArray[np.float64],
    color: NDArray[np.float64],
    *,
    adds_light: bool,
) -> str:
    """Return the PSNR, dB, of a one-colour picture's opacity where the reference is not empty."""
    k = int(np.argmax(color))
    level = picture[..., k] / 255
    shown = decoded(level) / color[k] if adds_light else level / encoded(color)[k]
    error = (np.clip(shown, 0, 1) - opacity)[opacity > 0]
    return f"{-10 * np.log10(np.mean(error**2)):.1f}"


def row(run: Run, scene: Scene, timings: dict[str, Timing], folder: Path) -> str:
    """Return a run's line of the table."""
    timing = timings[run.name]
    ideal = reference(scene, run.camera, run.shading, folder)
    there = ideal[..., 3] > 0
    Image.fromarray(picture_of(run, folder)).save(folder / f"{run.name}.png")
    is_ours = run.renderer == "ours"  # other renderers blend encoded colours
    expected, found = encode(ideal, adds_light=is_ours), picture_of(run, folder)
    ms, steps = statistics.median(timing["ms"]), timing["steps"]
    path = path_voxels(scene.block, scene.cameras[run.camera])
    most = float(path[path > 0].mean())
    samples = f"{steps:.0f}" if run.voxels is None else f"<= {most / run.voxels:.0f}"
    rival = timings.get(f"{run.scene}-ours-{RIVALS.get(run.camera, run.camera)}-0")
    ratio = ""
    if rival is not None:
        pairs = zip(timing["ms"], rival["ms"], strict=True)
        ratio = f"{statistics.median(its / ours for its, ours in pairs):.2f}"
    text = (
        f"{run.scene:15} {run.label:32} {run.camera:12} {ms:7.0f} {ratio:>7} {samples:>8} "
        f"{psnr(found, expected):7.1f} {psnr(found, expected, there):7.1f} "
        f"{psnr_of_opacity(found, ideal[..., 3], scene.block.colors[0], adds_light=is_ours):>7}"
    )
    if run.renderer != "niivue":
        return text
    color = encode(np.array([[[*scene.block.colors[0], 1.0]]]))
    undone = unblended(found, color)
    return (
        f"{text}\n{'':15} {'  its blending undone':32} {'':12} {'':7} {'':7} {'':>8} "
        f"{psnr(undone, expected):7.1f} {psnr(undone, expected, there):7.1f}"
    )


def main(folder: Path) -> None:
    """Measure, and print the table."""
    reason = missing()
    if reason is not None:
        print(f"bench-viewer: skipped: {reason}")
        return
    folder.mkdir(parents=True, exist_ok=True)
    heads = head()
    scenes = {scene.name: scene for scene in (*nuclei(), brain_cells(), *heads)}
    for scene in scenes.values():
        scene.write(folder)
    runs = [run for name in ("nuclei_soft", "nuclei_default") for run in runs_on(name)]
    runs += [Run("brain_cells-ours", "ours", "brain_cells", "perspective", 0, "ours", None)]
    runs += [lit("brain_cells")]
    on_heads = [run for scene in heads for run in runs_on_head(scene.name)]
    job = folder / "job.json"
    asked = [asdict(run) for run in (*runs, *on_heads)]
    job.write_text(json.dumps({"rounds": ROUNDS, "runs": asked}))
    tsx = HERE / "node_modules" / ".bin" / "tsx"
    subprocess.run([tsx, HERE / "run.ts", job, folder], check=True)
    measured: list[Timing] = json.loads((folder / "timings.json").read_text("utf-8"))
    timings = {timing["name"]: timing for timing in measured}
    for line in HEAD:
        print(f"{line[0]:15} {'':32} {line[1]:12}", *(f"{text:>7}" for text in line[2:4]), end=" ")
        print(f"{line[4]:>8}", *(f"{text:>7}" for text in line[5:]))
    for run in runs:
        print(row(run, scenes[run.scene], timings, folder))
    for run in on_heads:
        print(head_row(run, timings, folder))
    if not heads:
        print("the real MRI: skipped: no STEREOCELL_DATA")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
