"""Two-dimensional transfer functions: value and gradient magnitude to colour and opacity.

A function is a list of shapes, the widgets of Kniss, Kindlmann & Hansen, IEEE TVCG 8(3), 2002: a
rectangle, or a triangle that stands on its tip at gradient 0, which is the region that Levoy, IEEE
CG&A 8(3), 1988, keeps of an iso-surface: as thick at every steepness. `evaluate2d` makes a table of
them; docs/transfer-functions.md states it as a formula, and the viewer computes the same bytes.
"""

from collections.abc import Mapping, Sequence
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from stereocell.model.channel import (
    OpacityPoints,
    Shape,
    ShapeKind,
    Shapes,
)
from stereocell.transfer.joint_histogram import COLUMNS, ROWS

NAME = "arcs"  # name of the proposed function, beside those of transfer/opacity.py
MAX_SHAPES = 32  # most shapes of one function: more neither fit a link nor a person's eye


def evaluate2d(shapes: Shapes, *, size: tuple[int, int] = (ROWS, COLUMNS)) -> NDArray[np.uint8]:
    """Return the table of a function, uint8 RGBA (rows, columns, 4), straight alpha.

    Row j stands for the gradient magnitude j / (rows - 1), column k for the value k / (columns -
    1). RGB is a factor to the channel's colour, A what one finest voxel spacing absorbs. Shapes
    that overlap absorb together and share the colour by their opacities.
    """
    rows, columns = size
    gradient = (np.arange(rows) / (rows - 1))[:, np.newaxis]
    value = (np.arange(columns) / (columns - 1))[np.newaxis]
    clear = np.ones(size)
    weight = np.zeros(size)
    color = np.zeros((*size, 3))
    for shape in shapes:
        opacity = shape.opacity * _cover(shape, value, gradient, 0.5 / (columns - 1))
        clear = clear * (1 - opacity)
        weight = weight + opacity
        color = color + opacity[..., np.newaxis] * np.array(shape.color)
    mean = np.ones((*size, 3))
    np.divide(color, weight[..., np.newaxis], out=mean, where=weight[..., np.newaxis] > 0)
    rgba = np.concatenate([mean, (1 - clear)[..., np.newaxis]], axis=2)
    return np.floor(255 * rgba + 0.5).astype(np.uint8)


def find_fault(shape: Shape) -> str:
    """Return what is wrong with a shape, found against expected; empty if nothing is."""
    if shape.kind not in get_args(ShapeKind):
        return f"kind is {shape.kind!r}, expected one of {', '.join(get_args(ShapeKind))}"
    for name, (low, high) in (("values", shape.values), ("gradients", shape.gradients)):
        if not 0 <= low < high <= 1:
            return f"{name} are ({low:g}, {high:g}), expected them to rise within 0..1"
    numbers = {"tip": shape.tip, "opacity": shape.opacity, "softness": shape.softness}
    numbers |= {f"color.{part}": number for part, number in zip("rgb", shape.color, strict=True)}
    for name, number in numbers.items():
        if not 0 <= number <= 1:
            return f"{name} is {number:g}, expected 0..1"
    return ""


def fall_back(shapes: Shapes) -> OpacityPoints:
    """Return opacity points that stand for shapes where nothing knows gradients.

    At each value the most that a shape has there at its upper end.
    """
    edges = {0.0, 1.0}
    for shape in shapes:
        (low, high), soft = shape.values, shape.softness * (shape.values[1] - shape.values[0]) / 2
        edges |= {low, low + soft, (low + high) / 2, high - soft, high}
    values = np.array(sorted({round(edge, 4) for edge in edges}))
    most = np.zeros(len(values))
    for shape in shapes:
        low, high = shape.values
        most = np.maximum(most, shape.opacity * _across(values, low, high, shape.softness, 1e-9))
    return tuple((float(v), round(float(o), 4)) for v, o in zip(values, most, strict=True))


def _cover(
    shape: Shape, value: NDArray[np.float64], gradient: NDArray[np.float64], smallest: float
) -> NDArray[np.float64]:
    """Return how much a shape has of each cell, 0..1; value (1, n), gradient (m, 1) to (m, n)."""
    low, high = shape.values
    bottom, top = shape.gradients
    if shape.kind == "triangle":
        share = gradient / top
        left, right = shape.tip + (low - shape.tip) * share, shape.tip + (high - shape.tip) * share
        across = _across(value, left, right, shape.softness, smallest)
    else:
        across = _across(value, low, high, shape.softness, smallest)
        # what is beyond an end of the window is clipped to it: no edge there
        middle = (low + high) / 2
        if low == 0:
            across = np.where((value >= 0) & (value <= middle), 1.0, across)
        if high == 1:
            across = np.where((value <= 1) & (value >= middle), 1.0, across)
    half = (top - bottom) / 2
    depth = np.ones_like(gradient)
    if bottom > 0:
        depth = np.minimum(depth, (gradient - bottom) / half)
    if top < 1:
        depth = np.minimum(depth, (top - gradient) / half)
    cover: NDArray[np.float64] = across * _soften(depth, shape.softness)
    return cover


def _across(
    value: NDArray[np.float64],
    low: float | NDArray[np.float64],
    high: float | NDArray[np.float64],
    softness: float,
    smallest: float,
) -> NDArray[np.float64]:
    """Return the share of opacity between edges that lie at least `smallest` from their middle."""
    middle, half = (low + high) / 2, np.maximum((high - low) / 2, smallest)
    return _soften(1 - np.abs(value - middle) / half, softness)


def _soften(depth: NDArray[np.float64], softness: float) -> NDArray[np.float64]:
    """Return 0 outside (depth below 0), 1 from `softness` on, straight in between."""
    if softness == 0:
        return (depth >= 0).astype(np.float64)
    return np.clip(depth / softness, 0.0, 1.0)


def shapes_from(content: Sequence[Mapping[str, Any]]) -> Shapes:
    """Return the shapes that JSON holds, as dataclasses.asdict made them; it passed its schema."""
    return tuple(
        Shape(
            one["kind"],
            tuple(one["values"]),
            tuple(one["gradients"]),
            one["tip"],
            tuple(one["color"]),
            one["opacity"],
            one["softness"],
        )
        for one in content
    )
