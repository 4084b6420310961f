"""The report's picture of tissue classes: three slices, coloured by probability."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from stereocell.building.input_unchanged import require_added
from stereocell.model.color import to_srgb8
from stereocell.model.tiling import Box
from stereocell.planning.plan import Plan
from stereocell.planning.plan_source import source_of
from stereocell.preview.draw_slices import encode
from stereocell.preview.views import views_of
from stereocell.steps.open_source import open_source
from stereocell.steps.tissue_files import FOLDER, read_record

SHOWN_PX = 330  # pixels, longest edge of a slice
_GAP_PX = 6  # pixels between slices


@dataclass(frozen=True, slots=True)
class TissueFacts:
    """Content of OUT/tissue/tissue.json, and a picture: WebP data, width and height in pixels."""

    record: dict[str, Any]
    picture: tuple[bytes, int, int]


def find_tissue(out: Path, plan: Plan) -> TissueFacts | None:
    """Return the facts of the plan's tissue channels; None where there are none.

    Raises OutputError or SourceError where OUT/tissue is damaged or differs from the plan.
    """
    added = [channel for channel in plan.channels if channel.source]
    if not added:
        return None
    require_added(plan)
    record = read_record(out / FOLDER)
    dataset = open_source(source_of(plan, channel=added[0]))
    colors = np.array([channel.color for channel in added], np.float32)

    def read(box: Box) -> NDArray[np.float32]:
        parts = [dataset.read(channel.index, box).voxels for channel in added]
        return np.stack(parts).astype(np.float32) / np.float32(255)

    middle = _middle(read, plan.region)
    panels = []
    neurological = plan.settings.plan.neurological
    for view in views_of(plan.placement, is_neurological=neurological):
        axis, down, right = view.order
        shares = read(_plane(plan.region, axis, middle[axis])).transpose(
            0, 1 + axis, 1 + down, 1 + right
        )[:, 0]
        rgb = np.ascontiguousarray(view.plane(to_srgb8(np.einsum("kyx,kc->yxc", shares, colors))))
        extent = [n * plan.spacing_um[k] for n, k in zip(rgb.shape, (down, right), strict=False)]
        panels.append((Image.fromarray(rgb), extent))
    return TissueFacts(record, _paint(panels))


def _middle(read: Callable[[Box], NDArray[np.float32]], region: Box) -> list[int]:
    """Return the voxel (z, y, x) at the centre of all classes, estimated from evenly spaced slices.

    read  returns the probabilities 0..1 of a box, float32 (class, z, y, x)
    """
    found = []
    for axis in range(3):
        first, last = region.start[axis], region.stop[axis] - 1
        places = sorted({round(first + (last - first) * k / 16) for k in range(17)})
        sums = [float(read(_plane(region, axis, at)).sum()) for at in places]
        total = sum(sums)
        mean = sum(a * s for a, s in zip(places, sums, strict=True)) / total if total else first
        found.append(int(np.clip(round(mean), first, last)))
    return found


def _plane(region: Box, axis: int, at: int) -> Box:
    start, stop = list(region.start), list(region.stop)
    start[axis], stop[axis] = at, at + 1
    return Box((start[0], start[1], start[2]), (stop[0], stop[1], stop[2]))


def _paint(panels: list[tuple[Image.Image, list[float]]]) -> tuple[bytes, int, int]:
    """Return the slices side by side at one scale: WebP data, width and height in pixels."""
    scale = SHOWN_PX / max(max(extent) for _, extent in panels)
    sizes = [tuple(max(2, round(um * scale)) for um in extent) for _, extent in panels]
    width = sum(right for _, right in sizes) + _GAP_PX * (len(sizes) - 1)
    picture = Image.new("RGB", (width, max(down for down, _ in sizes)), (38, 43, 51))
    left = 0
    for (panel, _), (down, right) in zip(panels, sizes, strict=True):
        picture.paste(panel.resize((right, down), Image.Resampling.BILINEAR), (left, 0))
        left += right + _GAP_PX
    return encode(picture), *picture.size
