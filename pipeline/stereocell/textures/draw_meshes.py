"""Draw meshes without OpenGL, with the same result on every machine.

The projection is parallel, by default from the front, above and the right. One lamp stands over the
left shoulder, and a weaker one on the right. Light also comes from the sky and the ground.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.depth_buffer import place_points
from stereocell.kernels.shading import light_pixels, shrink, shrink_visible
from stereocell.model.color import to_srgb8
from stereocell.textures.rasterize import Seen

Vector = NDArray[np.float64]
Box = tuple[tuple[float, ...], tuple[float, ...]]

# Direction of the eye, from the front, above and the right: x right, y up, z towards the viewer.
_EYE = np.array([0.42, 0.5, 1.0])
_UP = np.array([0.0, 1.0, 0.0])
# Linear light from below and from above, 0..1
_GROUND_LIGHT, _SKY_LIGHT = 0.06, 0.18
# Direction to each lamp (right, up, towards the eye), and its linear light, 0..1
_LAMPS = (((-0.5, 0.7, 1.0), 0.85), ((0.9, 0.1, 0.5), 0.2))
_GLOSS = 0.12  # share of the light that is mirrored
_BACKGROUND = (0.0033, 0.0040, 0.0052)  # linear RGB
_LINES = (0.148, 0.171, 0.214)  # linear RGB of the outlines of boxes
_FINE = 2  # factor by which an image is drawn larger and then averaged down
_MARGIN = 1.04  # size of the drawn part of the scene, as a multiple of the frame's


@dataclass(frozen=True, slots=True)
class Shape:
    """A mesh in memory, with linear RGB 0..1 for all of it (3,) or for its vertices (n, 3)."""

    positions: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    normals: NDArray[np.float32]
    color: Vector


@dataclass(frozen=True, slots=True)
class _View:
    """The projection of the world to an image. The columns of `axes` point right, up, to the eye.

    size  (height, width) in pixels, as drawn before averaging
    """

    axes: Vector
    centre: Vector
    scale: float
    size: tuple[int, int]

    def place(self, points: NDArray[np.floating]) -> tuple[Vector, Vector]:
        """Return the pixels (n, 2), x right, y down, and depths (n,), larger is nearer."""
        height, width = self.size
        places, depth = np.empty((len(points), 2)), np.empty(len(points))
        middle = np.array([width / 2, height / 2])
        given = np.require(points, requirements=["C", "W"])
        axes = np.ascontiguousarray(self.axes)
        place_points(given, self.centre, axes, self.scale, middle, places, depth)
        return places, depth


def draw_pixels(
    shapes: Iterable[Shape],
    frame: Box,
    size: tuple[int, int],
    *,
    boxes: Iterable[Box] = (),
    turned_deg: float = 0.0,
) -> NDArray[np.uint8]:
    """Return an image of meshes (h, w, 3), sRGB.

    frame       corners (x, y, z) in world um of a box that fills the image
    size        pixels: width, largest height
    boxes       boxes that are drawn as outlines
    turned_deg  angle of the eye around the upright axis; at 0 `frame` fills the image
    """
    view = _look_at(frame, size, turned_deg)
    picture, nearest = _shade(shapes, view)
    for low, high in boxes:
        _outline(picture, nearest, view, np.array([low, high]))
    height, width = view.size
    mean = np.empty((height // _FINE, width // _FINE, 3))
    shrink(picture, _FINE, mean)
    return to_srgb8(mean.astype(np.float32))


def draw_side(shapes: Iterable[Shape], box: Box, axes: Vector, longest: int) -> NDArray[np.uint8]:
    """Return an image of meshes (h, w, 4) on a transparent ground, in parallel projection.

    box      box (corners x, y, z, world um) whose projection fills the image
    axes     (3, 3), columns are directions in the world: right, up, and to the eye
    longest  number of pixels of the longer edge
    """
    low, high = (np.array(corner) for corner in box)
    across, upright = (float(np.abs(axes[:, k]) @ (high - low)) for k in (0, 1))
    scale = longest / max(across, upright)
    width, height = (max(1, round(edge * scale)) for edge in (across, upright))
    size = (height * _FINE, width * _FINE)
    view = _View(axes, (low + high) / 2, _FINE * scale, size)
    picture, nearest = _shade(shapes, view)
    light, cover = np.empty((height, width, 3)), np.empty((height, width))
    shrink_visible(picture, nearest, _FINE, light, cover)
    alpha = np.rint(255 * cover).astype(np.uint8)
    return np.dstack([to_srgb8(light.astype(np.float32)), alpha])


def _shade(shapes: Iterable[Shape], view: _View) -> tuple[Vector, Vector]:
    """Return the linear light (h, w, 3) of the nearest surfaces, and their depths (h, w)."""
    picture = np.empty((*view.size, 3))
    picture[:] = _BACKGROUND
    seen = Seen.nothing(view.size)
    drawn = []
    for number, shape in enumerate(shapes):
        places, depth = view.place(shape.positions)
        seen.add(number, places, depth, shape.triangles)
        drawn.append((shape, places))
    for number, (shape, places) in enumerate(drawn):  # pixels of hidden surfaces are not shaded
        light_pixels(
            number,
            seen.mesh,
            seen.triangle,
            np.ascontiguousarray(shape.triangles, np.uint32),
            places,
            np.ascontiguousarray(shape.normals, np.float32),
            np.ascontiguousarray(np.atleast_2d(shape.color), np.float64),
            np.ascontiguousarray(view.axes),
            _lamps(),
            _GROUND_LIGHT,
            _SKY_LIGHT,
            _GLOSS,
            picture,
        )
    return picture, seen.nearest


def _lamps() -> Vector:
    """Return for each lamp the direction to it, the direction halfway to the eye, and its light."""
    lamps = []
    for direction, light in _LAMPS:
        to_lamp = np.array(direction) / np.linalg.norm(direction)
        halfway = to_lamp + np.array([0.0, 0.0, 1.0])
        lamps.append(np.r_[to_lamp, halfway / np.linalg.norm(halfway), light])
    return np.array(lamps)


def turning_frame(low: Vector, high: Vector) -> Box:
    """Return a frame that contains a box (x, y, z) at every turn around the upright axis."""
    middle, half = (low + high) / 2, (high - low) / 2
    aside = np.abs(_EYE[[0, 2]]).sum() / np.hypot(_EYE[0], _EYE[2])
    half[[0, 2]] = np.hypot(half[0], half[2]) / aside
    return tuple((middle - half).tolist()), tuple((middle + half).tolist())


def _look_at(frame: Box, size: tuple[int, int], turned_deg: float) -> _View:
    low, high = (np.array(corner) for corner in frame)
    to_eye = _EYE / np.linalg.norm(_EYE)
    right = np.cross(_UP, to_eye)
    right /= np.linalg.norm(right)
    up = np.cross(to_eye, right)
    # Width and height of the frame's box as seen from the eye
    across, upright = float(np.abs(right) @ (high - low)), float(np.abs(up) @ (high - low))
    width, most = size
    height = int(np.clip(width * upright / across, min(0.3 * width, most), most))
    scale = _FINE * min(width / across, height / upright) / _MARGIN
    axes = np.stack([right, up, to_eye], axis=1)
    if turned_deg:
        sin, cos = np.sin(np.radians(turned_deg)), np.cos(np.radians(turned_deg))
        axes = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]]) @ axes
    return _View(axes, (low + high) / 2, scale, (height * _FINE, width * _FINE))


def _outline(picture: Vector, nearest: Vector, view: _View, ends: Vector) -> None:
    """Draw the edges of a box where no surface is nearer. ends: (2, 3), corners of the box."""
    height, width = view.size
    for axis in range(3):
        beside, above = (axis + 1) % 3, (axis + 2) % 3
        for i in (0, 1):
            for j in (0, 1):
                edge = ends.copy()
                edge[:, beside], edge[:, above] = ends[i, beside], ends[j, above]
                places, depth = view.place(edge)
                steps = int(np.ceil(np.abs(places[1] - places[0]).max())) + 1
                share = np.linspace(0, 1, steps)[:, None]
                column, row = np.floor(places[0] + share * (places[1] - places[0])).T.astype(int)
                here = depth[0] + share[:, 0] * (depth[1] - depth[0])
                inside = (row >= 0) & (row < height - 1) & (column >= 0) & (column < width - 1)
                row, column, here = row[inside], column[inside], here[inside]
                # Two pixels are one pixel wide after averaging.
                for down, on in ((0, 0), (0, 1), (1, 0), (1, 1)):
                    seen = here >= nearest[row + down, column + on]
                    picture[row[seen] + down, column[seen] + on] = _LINES
