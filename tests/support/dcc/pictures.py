"""Draw one sample in each program from each file, and measure the pictures."""

from collections.abc import Collection
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
# Column of the .glb as Blender's default camera sees it. From the front, it is in the shade of
# Blender's default lamp, which stands behind it.
BY_DEFAULT_CAMERA = "Blender's view, glb"
# Column of the import without volumes, drawn by Blender's renderer EEVEE
EEVEE = "add-on, EEVEE"
COLUMNS = {
    "Storm, stage": ("storm", "stage"),
    "Storm, usdc": ("storm", "flat"),
    "Storm, usdz": ("storm", "usdz"),
    "Blender, stage": ("blender", "stage"),
    "Blender, usdc": ("blender", "flat"),
    "Blender, usdz": ("blender", "usdz"),
    "Blender, glb": ("blender", "glb"),
    BY_DEFAULT_CAMERA: ("blender", "glb"),
    "add-on": ("add-on", "stage"),
    EEVEE: ("add-on", "stage"),
    VOLUMES: ("add-on", "stage"),
    "three, glb": ("three", "glb"),
    "three, usdz": ("three", "usdz"),
    "Cesium, glb": ("cesium", "glb"),
}


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture's file and measures; `drawn` is the silhouette: the pixels that are covered."""

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


def draw_pictures(
    stage_path: Path, folder: Path, size: tuple[int, int], columns: Collection[str] = tuple(COLUMNS)
) -> dict[str, Picture]:
    """Draw a stage and its exported files in each program; return the pictures by column."""
    files = export_files(stage_path, folder)
    small = (size[0] // 2, size[1] // 2)  # for volumes, which take longest to draw
    _draw(files, folder, columns, (size, small))
    stage, view = Usd.Stage.Open(str(stage_path)), files.views["stage"]
    truth, small_truth = (find_truth(stage, view, pixels) for pixels in (size, small))
    other = {VOLUMES: small_truth, BY_DEFAULT_CAMERA: None}
    return {
        column: _read(
            _place(folder, column), other.get(column, truth), is_seen_through=column == VOLUMES
        )
        for column in columns
    }


def _place(folder: Path, column: str) -> Path:
    return folder / f"{column.replace(', ', '_')}.png"


def _draw(
    files: Files,
    folder: Path,
    columns: Collection[str],
    sizes: tuple[tuple[int, int], tuple[int, int]],
) -> None:
    size, small = sizes
    by_blender, by_eevee, for_the_web = [], [], []
    lights = lights_of(Usd.Stage.Open(str(files.stage)))
    for column in columns:
        program, kind = COLUMNS[column]
        file, view, picture = getattr(files, kind), files.views[kind], _place(folder, column)
        job = {"file": file, "view": view.json(), "pixels": size, "picture": picture}
        if program == "storm":
            draw_by_storm(file, view, UNITS[kind], picture, size[0])
        elif program in ("blender", "add-on"):
            if kind in ("stage", "flat"):
                job["view"] = None
            if column == BY_DEFAULT_CAMERA:
                job["view"] = "default"
            if column == VOLUMES:
                job |= {"pixels": small, "choices": {"representation": "volume"}}
            if column == EEVEE:
                by_eevee.append({**job, "by": program, "engine": "BLENDER_EEVEE"})
                continue
            by_blender.append({**job, "by": program})
        else:
            # A .glb has no lights. A .usdz lacks only the dome's image, which is added here.
            suns = lights["suns"] if kind == "glb" else []
            for_the_web.append({**job, "program": program, "lights": {**lights, "suns": suns}})
    draw_by_blender(by_blender, folder)
    if by_eevee:
        draw_by_blender(by_eevee, folder)
    draw_for_the_web(for_the_web, folder)


def _read(file: Path, truth: Truth | None, *, is_seen_through: bool = False) -> Picture:
    with Image.open(file) as opened:
        image = np.asarray(opened.convert("RGBA")) / 255
    return Picture(
        file, image[..., 3] > 0.5, measure(image, truth, is_seen_through=is_seen_through)
    )
