"""Two-dimensional transfer functions: value and gradient magnitude to colour and opacity.

A function is a list of shapes, like the widgets of Kniss, Kindlmann & Hansen, IEEE TVCG 8(3), 2002.
A shape is a rectangle, or a triangle that stands on its tip at gradient 0. The triangle is the
region around an iso-surface of Levoy, IEEE CG&A 8(3), 1988, whose thickness does not depend on the
steepness. `evaluate2d` makes a table of the shapes; docs/transfer-functions.md states it as a
formula, and the viewer computes the same bytes.
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
MAX_SHAPES = 32  # largest number of shapes of a function; more fit neither a link nor the eye


def evaluate2d(shapes: Shapes, *, size: tuple[int, int] = (ROWS, COLUMNS)) -> NDArray[np.uint8]:
    """Return the table of a function, uint8 RGBA (rows, columns, 4), straight alpha.

    Row j stands for the gradient magnitude j / (rows - 1), and column k for the value
    k / (columns - 1). RGB is a factor to the channel's colour, and A is the absorption along one
    finest voxel spacing. Overlapping shapes absorb together, and mix their colours by opacity.
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
    """Return the fault of a shape, as found and expected values; empty if there is none."""
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
    """Return opacity points that replace the shapes in programs that know no gradients.

    The opacity at each value is the largest of any shape, at the shape's upper end.
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
    """Return how much a shape covers each cell (m, n), 0..1. value: (1, n); gradient: (m, 1)."""
    low, high = shape.values
    bottom, top = shape.gradients
    if shape.kind == "triangle":
        share = gradient / top
        left, right = shape.tip + (low - shape.tip) * share, shape.tip + (high - shape.tip) * share
        across = _across(value, left, right, shape.softness, smallest)
    else:
        across = _across(value, low, high, shape.softness, smallest)
        # Values beyond an end of the window are clipped to it, so there is no edge at the end.
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
    """Return how much a shape covers values, 0..1.

    low, high  the shape's ends, which count as at least `smallest` away from its middle
    """
    middle, half = (low + high) / 2, np.maximum((high - low) / 2, smallest)
    return _soften(1 - np.abs(value - middle) / half, softness)


def _soften(depth: NDArray[np.float64], softness: float) -> NDArray[np.float64]:
    """Return 0 for a depth below 0, and 1 from `softness` on, linear in between."""
    if softness == 0:
        return (depth >= 0).astype(np.float64)
    return np.clip(depth / softness, 0.0, 1.0)


def shapes_from(content: Sequence[Mapping[str, Any]]) -> Shapes:
    """Return the shapes from JSON that has passed its schema, as dataclasses.asdict made it."""
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
