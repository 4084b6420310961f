"""Draw the middle slices of a unit across its three axes, with the extracted surface.

The amber line is the cross-section of the LOD0 mesh: the actual surface. The dashed line is the
contour of the smoothed 8-bit field at the iso-value: the intended surface. Where the two differ,
repair or simplification has changed the surface.
"""

import io
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from stereocell.filters.denoise import smooth
from stereocell.filters.reach import SMOOTHING_REACH
from stereocell.model.mesh import Mesh
from stereocell.model.spacing import Point, Spacing
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume, xyz_to_zyx
from stereocell.preview.views import MICROSCOPE, View

Color = tuple[int, int, int]
OUTLINE = (255, 190, 40)  # sRGB, 0..255, of the line around the mesh
FIELD = (70, 190, 255)  # sRGB, 0..255, of the field's contour at the iso-value
_GROUND = (38, 43, 51)
_LONGEST_PX = 300  # pixels, longest side of a slice
_GAP_PX = 6  # pixels between slices
_FINE = 3  # factor; lines are drawn this much larger and then averaged down
_DASH_PX = 4  # pixels, length of a dash
_SHOWN_PX = 330  # pixels, displayed width at which lines and text have weight 1


@dataclass(frozen=True, slots=True)
class Slice:
    """One plane through a unit in the orientation of the picture: rows down, columns right.

    grey        uint8 (rows, columns) over the intensity window; (rows, columns, 3) for colours
    spacing_um  (row, column), um
    outline     float64 (n, 2, 2): n line segments between two points (row, column), in voxels
    above       float32 (rows, columns): field minus iso-value, or None without an iso-value
    contours    colours (sRGB, 0..255), each with a field like `above`; the zero line of the field
                is drawn as a solid line
    """

    view: View
    grey: NDArray[np.uint8]
    spacing_um: tuple[float, float]
    outline: NDArray[np.float64]
    above: NDArray[np.float32] | None
    contours: tuple[tuple[Color, NDArray[np.float32]], ...] = ()


@dataclass(frozen=True, slots=True)
class MiddlePlane:
    """The middle plane of a unit across one axis, in the order of its view's axes.

    index       number of the plane along the axis
    box         the plane's box in voxels of the dataset
    grey        uint8 (rows, columns)
    spacing_um  (row, column), um
    field       float32 (rows, columns), the smoothed voxels, which contours follow
    """

    view: View
    index: int
    box: Box
    grey: NDArray[np.uint8]
    spacing_um: tuple[float, float]
    field: NDArray[np.float32]

    def above(self, iso_at: Callable[[Box], NDArray[np.float32]]) -> NDArray[np.float32]:
        """Return the field minus an iso-value, in the orientation of the picture.

        iso_at  returns the iso-value, on the scale of 8 bits, at the voxels of a box of the dataset
        """
        return self.view.plane(self.field - iso_at(self.box).transpose(self.view.order)[0])


def cut_middle_planes(
    volume: NDArray[np.uint8],
    lattice: Box,
    *,
    spacing_um: Spacing,
    sigma_um: float,
    views: Sequence[View] = MICROSCOPE,
) -> list[MiddlePlane]:
    """Return the three middle planes of a unit.

    volume      uint8 (z, y, x), the lattice's voxels, without an apron
    lattice     the lattice's box in voxels of the dataset
    spacing_um  (z, y, x), um
    sigma_um    sigma of the Gaussian before surface extraction
    views       the three views to draw
    """
    planes = []
    for view in views:
        order = view.order
        k = lattice.shape[order[0]] // 2
        turned = volume.transpose(order)
        z, y, x = (spacing_um[i] for i in order)
        reach = math.ceil(SMOOTHING_REACH * sigma_um / z)
        field = smooth(Volume(turned[max(0, k - reach) : k + reach + 1], (z, y, x)), sigma_um)
        box = _plane(lattice, order[0], k)
        planes.append(MiddlePlane(view, k, box, turned[k], (y, x), field[min(k, reach)]))
    return planes


def cut_unit(
    planes: Sequence[MiddlePlane],
    *,
    first_um: Point,
    spacing_um: Spacing,
    mesh: Mesh | None,
    iso_at: Callable[[Box], NDArray[np.float32]] | None,
) -> list[Slice]:
    """Return the three middle slices of a unit with its surface.

    first_um    (z, y, x), um, centre of the first voxel
    spacing_um  (z, y, x), um
    mesh        finest mesh, in world um; None if there is no surface
    iso_at      see `MiddlePlane.above`; None: no contour
    """
    points = None if mesh is None else voxels_of(mesh, first_um, spacing_um)
    slices = []
    for plane in planes:
        axis, down, right = plane.view.order
        outline = np.zeros((0, 2, 2))
        if points is not None and mesh is not None:
            cut = cross_section(points, mesh.triangles, axis, float(plane.index))
            rows, columns = plane.grey.shape
            outline = plane.view.points(cut[:, :, [down, right]], (rows, columns))
        above = None if iso_at is None else plane.above(iso_at)
        grey = plane.view.plane(plane.grey)
        slices.append(Slice(plane.view, grey, plane.spacing_um, outline, above))
    return slices


def cut_contour(
    planes: Sequence[MiddlePlane], iso_at: Callable[[Box], NDArray[np.float32]]
) -> list[Slice]:
    """Return the three middle slices of a unit with the contour of an iso-value.

    The contour is the only line, so it is drawn solid, in the colour of surfaces.
    """
    nothing = np.zeros((0, 2, 2))
    return [
        Slice(
            plane.view,
            plane.view.plane(plane.grey),
            plane.spacing_um,
            nothing,
            None,
            ((OUTLINE, plane.above(iso_at)),),
        )
        for plane in planes
    ]


def voxels_of(mesh: Mesh, first_um: Point, spacing_um: Spacing) -> NDArray[np.float64]:
    """Return a mesh's vertices in voxels, from the voxel at first_um: float64 (n, 3), zyx."""
    positions = xyz_to_zyx(mesh.positions.astype(np.float64))
    return (positions - np.asarray(first_um)) / np.asarray(spacing_um)


def cross_section(
    points: NDArray[np.float64], triangles: NDArray[np.uint32], axis: int, at: float
) -> NDArray[np.float64]:
    """Cut triangles with the plane points[:, axis] = at; return segments, float64 (n, 2, 3).

    points     (m, 3), float64
    triangles  (k, 3), indices of points

    A vertex on the plane counts as above it. Each triangle then gives one segment or none, and
    closed meshes give closed lines.
    """
    above = points[:, axis] >= at
    sides = above[triangles]
    mixed = sides.any(axis=1) & ~sides.all(axis=1)
    crossed, sides = triangles[mixed].astype(np.int64), sides[mixed]
    # One of the three corners is alone on its side. Both ends of the segment lie on its edges.
    lone = np.where(sides[:, 0] == sides[:, 1], 2, np.where(sides[:, 0] == sides[:, 2], 1, 0))
    rows = np.arange(len(crossed))
    tip = points[crossed[rows, lone]]
    ends = []
    for step in (1, 2):
        other = points[crossed[rows, (lone + step) % 3]]
        rise = other[:, axis] - tip[:, axis]
        ends.append(tip + (other - tip) * ((at - tip[:, axis]) / rise)[:, None])
    return np.stack(ends, axis=1) if len(crossed) else np.zeros((0, 2, 3))


def draw_slices(slices: list[Slice]) -> tuple[bytes, int, int]:
    """Return a WebP picture of the slices, and its width and height in pixels."""
    picture = paint_slices(slices, _LONGEST_PX)
    return encode(picture), *picture.size


def paint_slices(
    slices: Sequence[Slice], longest_px: int, *, shown_px: int = _SHOWN_PX
) -> Image.Image:
    """Return a picture of three slices: the second below the first, the third on its right.

    longest_px  pixels, longest side of a slice
    shown_px    pixels, displayed width; lines and text scale with it

    All three slices have the same scale and the specimen's proportions.
    """
    longest = max(um for s in slices for um in _extent(s))
    scale = longest_px / longest
    shapes = [tuple(max(2, round(um * scale)) for um in _extent(s)) for s in slices]
    (down, right), (deep, _), (_, wide) = shapes
    width, height = right + _GAP_PX + wide, down + _GAP_PX + deep
    weight = max(1.0, width / shown_px)
    corners = ((0, 0), (0, down + _GAP_PX), (right + _GAP_PX, 0))
    picture = Image.new("RGB", (width, height), _GROUND)
    draw = ImageDraw.Draw(picture)
    for part, (rows, columns), corner in zip(slices, shapes, corners, strict=True):
        picture.paste(_panel(part, (columns, rows), weight), corner)
        if min(rows, columns) >= 24 * weight:
            _write(draw, (corner[0] + 4, corner[1] + 2), part.view.name, weight)
        if min(rows, columns) >= 60 * weight:
            _write_ends(draw, part.view.ends, corner, (columns, rows), weight)
    if min(down, right) >= 60 * weight:
        _scale_bar(draw, (right, down), scale, weight)
    return picture


def paint_slice(part: Slice, longest_px: int) -> Image.Image:
    """Return a picture of one slice with a scale bar; its longest side has `longest_px` pixels."""
    scale = longest_px / max(_extent(part))
    rows, columns = (max(2, round(um * scale)) for um in _extent(part))
    weight = max(1.0, longest_px / _SHOWN_PX)
    picture = _panel(part, (columns, rows), weight)
    draw = ImageDraw.Draw(picture)
    if min(rows, columns) >= 60 * weight:
        _write(draw, (4, 2), part.view.name, weight)
        _write_ends(draw, part.view.ends, (0, 0), (columns, rows), weight)
        _scale_bar(draw, (columns, rows), scale, weight)
    return picture


def encode(picture: Image.Image) -> bytes:
    """Return the picture as a WebP file."""
    buffer = io.BytesIO()
    picture.save(buffer, "WEBP", quality=78, method=4)
    return buffer.getvalue()


def _extent(part: Slice) -> tuple[float, float]:
    return part.grey.shape[0] * part.spacing_um[0], part.grey.shape[1] * part.spacing_um[1]


def _plane(lattice: Box, axis: int, k: int) -> Box:
    start, stop = list(lattice.start), list(lattice.stop)
    start[axis] += k
    stop[axis] = start[axis] + 1
    return Box((start[0], start[1], start[2]), (stop[0], stop[1], stop[2]))


def _panel(part: Slice, size: tuple[int, int], weight: float) -> Image.Image:
    picture = Image.fromarray(part.grey).resize(size, Image.Resampling.BILINEAR)
    panel = picture.convert("RGB")
    if part.above is not None:
        panel.paste(FIELD, (0, 0), _zero_line(part.above, size, weight, is_dashed=True))
    for color, above in part.contours:
        panel.paste(color, (0, 0), _zero_line(above, size, weight, is_dashed=False))
    if len(part.outline):
        panel.paste(OUTLINE, (0, 0), _lines(part, size, weight))
    return panel


def _zero_line(
    above: NDArray[np.float32], size: tuple[int, int], weight: float, *, is_dashed: bool
) -> Image.Image:
    """Return the mask of the zero line of `above` (rows, columns), solid or dashed."""
    fine = (size[0] * _FINE, size[1] * _FINE)
    inside = np.asarray(Image.fromarray(above).resize(fine, Image.Resampling.BILINEAR)) > 0
    edge = np.zeros(inside.shape, bool)
    edge[:-1] |= inside[:-1] != inside[1:]
    edge[:, :-1] |= inside[:, :-1] != inside[:, 1:]
    if is_dashed:
        dash = round(_DASH_PX * _FINE * weight)
        is_drawn = np.arange(fine[0] + fine[1]) // dash % 2 == 0
        # Dashes and gaps alternate along the diagonals of the picture.
        edge &= sliding_window_view(is_drawn, fine[0])[: fine[1]]
    return _averaged(edge, weight)


def _lines(part: Slice, size: tuple[int, int], weight: float) -> Image.Image:
    """Return the mask of the outline. Each segment is drawn as points close enough to touch."""
    shape = (size[1] * _FINE, size[0] * _FINE)
    fine = np.array(shape)
    pixels = (part.outline + 0.5) * (fine / np.array(part.grey.shape))
    steps = np.ceil(np.abs(pixels[:, 1] - pixels[:, 0]).max(axis=1)).astype(np.int64) + 1
    segment = np.repeat(np.arange(len(steps)), steps)
    along = np.arange(len(segment)) - np.repeat(np.cumsum(steps) - steps, steps)
    share = (along / np.maximum(steps[segment] - 1, 1))[:, None]
    points = pixels[segment, 0] + (pixels[segment, 1] - pixels[segment, 0]) * share
    cells = np.floor(points).astype(np.int64)
    cells = cells[((cells >= 0) & (cells < fine)).all(axis=1)]
    mask = np.zeros(shape, bool)
    mask[cells[:, 0], cells[:, 1]] = True
    return _averaged(mask, weight)


def _averaged(mask: NDArray[np.bool_], weight: float) -> Image.Image:
    """Reduce a mask to the picture's size, with lines about `weight` pixels wide."""
    reach = max(1, round((_FINE * weight - 1) / 2))
    wide = _widened(_widened(mask, reach).T, reach).T
    return Image.fromarray(wide.astype(np.uint8) * np.uint8(255)).reduce(_FINE)


def _widened(mask: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """Widen a mask by `reach` rows on both sides. This is ten times as fast as SciPy's filter."""
    wide = mask.copy()
    for step in range(1, reach + 1):
        wide[step:] |= mask[:-step]
        wide[:-step] |= mask[step:]
    return wide


def _write(
    draw: ImageDraw.ImageDraw,
    at: tuple[float, float],
    text: str,
    weight: float,
    anchor: str = "la",
) -> None:
    font = find_font(round(10 * weight))
    draw.text(at, text, (255, 255, 255), font, anchor, stroke_width=1, stroke_fill=(0, 0, 0))


def _write_ends(
    draw: ImageDraw.ImageDraw,
    ends: tuple[str, str, str, str],
    corner: tuple[int, int],
    size: tuple[int, int],
    weight: float,
) -> None:
    """Write a letter in the middle of each edge of a slice: left, right, top, bottom.

    ends    the letters, in this order
    corner  upper left corner of the slice in the picture, pixels (x, y)
    size    (columns, rows) of the slice, pixels
    """
    (x, y), (width, height), gap = corner, size, round(3 * weight)
    places = (
        ((x + gap, y + height / 2), "lm"),
        ((x + width - gap, y + height / 2), "rm"),
        ((x + width / 2, y + gap), "ma"),
        ((x + width / 2, y + height - gap), "md"),
    )
    for text, (at, anchor) in zip(ends, places, strict=True):
        _write(draw, at, text, weight, anchor)


@cache
def find_font(size: int) -> ImageFont.FreeTypeFont:
    """Return a font from matplotlib's package that has a micro sign; `size` in pixels."""
    place = find_spec("matplotlib")  # finding the package avoids its import, which takes 0.2 s
    if place is None or place.origin is None:
        raise ModuleNotFoundError("matplotlib is not installed, expected the font in its package")
    fonts = Path(place.origin).parent / "mpl-data" / "fonts" / "ttf"
    return ImageFont.truetype(fonts / "DejaVuSans.ttf", size)


def _scale_bar(draw: ImageDraw.ImageDraw, xy: tuple[int, int], scale: float, weight: float) -> None:
    """Draw a scale bar at the lower left: 1, 2 or 5 times a power of ten, in um.

    xy     width and height of the picture, or of its first slice, in pixels
    scale  pixels per um
    """
    longest = 0.35 * xy[0] / scale
    power = 10.0 ** math.floor(math.log10(longest))
    length = max(step * power for step in (1, 2, 5) if step * power <= longest)
    y = xy[1] - 7
    draw.rectangle((5, y - 2, 7 + length * scale, y + 2), fill=(0, 0, 0))
    draw.rectangle((6, y - 1, 6 + length * scale, y + 1), fill=(255, 255, 255))
    _write(
        draw,
        (6, y - 4 - 12 * weight),
        f"{length:g} µm" if length < 1000 else f"{length / 1000:g} mm",
        weight,
    )
