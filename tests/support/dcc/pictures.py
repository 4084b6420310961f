"""The pictures of one sample, a program and a file each, and what is measured of them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from pxr import Usd

from support.dcc.measures import Measures, measure
from support.dcc.programs import (
    Files,
    draw_by_blender,
    draw_by_storm,
    draw_for_the_web,
    export_files,
)
from support.dcc.truth import Truth, find_truth
from support.dcc.view import lights_of

UNITS = {"stage": 1e-6, "flat": 1e-6, "usdz": 1.0}  # metres in a unit of each USD file
VOLUMES = "add-on, volumes"
COLUMNS = {
    "Storm, stage": ("storm", "stage"),
    "Storm, usdc": ("storm", "flat"),
    "Storm, usdz": ("storm", "usdz"),
    "Blender, stage": ("blender", "stage"),
    "Blender, usdc": ("blender", "flat"),
    "Blender, usdz": ("blender", "usdz"),
    "Blender, glb": ("blender", "glb"),
    "add-on": ("add-on", "stage"),
    VOLUMES: ("add-on", "stage"),
    "three, glb": ("three", "glb"),
    "three, usdz": ("three", "usdz"),
    "Cesium, glb": ("cesium", "glb"),
}


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture, and what was measured of it; `drawn` is its silhouette."""

    file: Path
    drawn: NDArray[np.bool_]
    measures: Measures

    @property
    def caption(self) -> list[str]:
        """Return the measures in two lines."""
        found = self.measures
        hues = " ".join(f"{name[:8]} {hue:.1f}" for name, hue in found.hues.items())
        light = f"luminance {found.luminance:.2f}, silhouette {found.silhouette:.3f}"
        return [light, f"hues: {hues}" if hues else "no hue"]


def draw_pictures(stage_path: Path, folder: Path, size: tuple[int, int]) -> dict[str, Picture]:
    """Draw a stage and what is exported of it in each program; return the pictures by column."""
    files = export_files(stage_path, folder)
    small = (size[0] // 2, size[1] // 2)  # of volumes, which take longest
    _draw(files, folder, size, small)
    stage, view = Usd.Stage.Open(str(stage_path)), files.views["stage"]
    truth, small_truth = (find_truth(stage, view, pixels) for pixels in (size, small))
    return {
        column: _read(_place(folder, column), small_truth, is_seen_through=True)
        if column == VOLUMES
        else _read(_place(folder, column), truth)
        for column in COLUMNS
    }


def _place(folder: Path, column: str) -> Path:
    return folder / f"{column.replace(', ', '_')}.png"


def _draw(files: Files, folder: Path, size: tuple[int, int], small: tuple[int, int]) -> None:
    by_blender, for_the_web = [], []
    lights = lights_of(Usd.Stage.Open(str(files.stage)))
    for column, (program, kind) in COLUMNS.items():
        file, view, picture = getattr(files, kind), files.views[kind], _place(folder, column)
        job = {"file": file, "view": view.json(), "pixels": size, "picture": picture}
        if program == "storm":
            draw_by_storm(file, view, UNITS[kind], picture, size[0])
        elif program in ("blender", "add-on"):
            if kind in ("stage", "flat"):
                job["view"] = None
            if column == VOLUMES:
                job |= {"pixels": small, "choices": {"representation": "volume"}}
            by_blender.append({**job, "by": program})
        else:
            # a .glb has no lights, a .usdz its own but for the image of the dome
            suns = lights["suns"] if kind == "glb" else []
            for_the_web.append({**job, "program": program, "lights": {**lights, "suns": suns}})
    draw_by_blender(by_blender, folder)
    draw_for_the_web(for_the_web, folder)


def _read(file: Path, truth: Truth, *, is_seen_through: bool = False) -> Picture:
    with Image.open(file) as opened:
        image = np.asarray(opened.convert("RGBA")) / 255
    return Picture(
        file, image[..., 3] > 0.5, measure(image, truth, is_seen_through=is_seen_through)
    )
