"""Draw the middle slices of a specimen, with the proposed iso-values as contours."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.live.coarse_channel import CoarseChannel
from stereocell.model.channel import Appearance
from stereocell.model.color import to_srgb8
from stereocell.model.spacing import Spacing
from stereocell.model.tiling import Box
from stereocell.preview.draw_slices import OUTLINE, Color, Slice, paint_slice
from stereocell.preview.png_slices import to_bytes
from stereocell.preview.views import View

_LONGEST_PX = 480  # pixels, longest side of a picture
# 0..1: share of white in a contour's colour, and brightness of the channel of that colour. A
# contour would be invisible on bright voxels if both were plain.
_WHITE, _LIGHT = 0.6, 0.6
_NO_LINES = np.zeros((0, 2, 2))


@dataclass(frozen=True, slots=True)
class ShownChannel:
    """A channel's coarse voxels, and how they are drawn."""

    coarse: CoarseChannel
    appearance: Appearance


def hex_of(color: Sequence[float]) -> str:
    """Return a linear colour, 0..1, as `#rrggbb`."""
    return "#" + "".join(f"{value:02x}" for value in _srgb(color))


def write_middle_slices(
    channels: Sequence[ShownChannel], views: Sequence[View], spacing_um: Spacing, folder: Path
) -> list[dict[str, str]]:
    """Write a picture for each axis; return the axes, names and files of the pictures.

    spacing_um  voxel spacing (z, y, x) of the resolution level that is built, um
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for view in views:
        axis = "zyx"[view.order[0]]
        picture = paint_slice(_slice(channels, view, spacing_um), _LONGEST_PX)
        picture.save(folder / f"{axis}.png")
        written.append({"axis": axis, "name": view.name, "image": f"slices/{axis}.png"})
    return written


def _slice(channels: Sequence[ShownChannel], view: View, spacing_um: Spacing) -> Slice:
    grey, contours, is_one = None, [], len(channels) == 1
    for shown in channels:
        box = _middle(shown.coarse.voxels.shape, view.order[0])
        plane = _cut(shown.coarse.voxels, box, view)
        bytes_ = to_bytes(plane, shown.appearance.window)
        color = (255, 255, 255) if is_one else _srgb(shown.appearance.color)
        light = 1.0 if is_one else _LIGHT
        tinted = bytes_[..., None] * (light * np.array(color, np.float32) / 255)
        grey = tinted if grey is None else grey + _fitted(tinted, grey.shape[:2])
        level = shown.appearance.level
        if level is None:
            continue
        above = plane - np.float32(level.iso)
        if level.background is not None:
            under = np.broadcast_to(level.background.at(box), _shape(box))
            above -= view.plane(under.transpose(view.order)[0])
        contours.append((OUTLINE if is_one else _lighter(color), above))
    assert grey is not None
    step = channels[0].coarse.grid.step
    down, right = (step[i] * spacing_um[i] for i in view.order[1:])
    picture = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    return Slice(view, picture, (down, right), _NO_LINES, None, tuple(contours))


def _middle(shape: tuple[int, ...], axis: int) -> Box:
    start, stop = [0, 0, 0], list(shape)
    start[axis] = shape[axis] // 2
    stop[axis] = start[axis] + 1
    return Box((start[0], start[1], start[2]), (stop[0], stop[1], stop[2]))


def _shape(box: Box) -> tuple[int, ...]:
    return tuple(b - a for a, b in zip(box.start, box.stop, strict=True))


def _cut(voxels: NDArray[np.float32], box: Box, view: View) -> NDArray[np.float32]:
    part = voxels[tuple(slice(a, b) for a, b in zip(box.start, box.stop, strict=True))]
    return np.ascontiguousarray(view.plane(part.transpose(view.order)[0]))


def _fitted(picture: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """Resize a picture to `shape`, rows and columns; coarse channels may differ by a voxel."""
    rows, columns = (
        np.minimum(np.arange(n) * m // n, m - 1) for n, m in zip(shape, picture.shape, strict=False)
    )
    found: NDArray[Any] = picture[rows][:, columns]
    return found


def _srgb(color: Sequence[float]) -> Color:
    red, green, blue = (int(value) for value in to_srgb8(np.asarray(color, np.float32)))
    return red, green, blue


def _lighter(color: Color) -> Color:
    red, green, blue = (round(value + (255 - value) * _WHITE) for value in color)
    return red, green, blue
