"""Read the 2D transfer functions of a composed stage: arrays with one entry per shape."""

from typing import Any

from pxr import Sdf, Usd

from stereocell.model.channel import Shape, Shapes
from stereocell.model.errors import StageError
from stereocell.transfer.shapes2d import MAX_SHAPES, find_fault
from stereocell.usd.read_attributes import shortest
from stereocell.usd.typed_values import read_as

_BOXES = "stereocell:shapes"
_KINDS, _COLORS = "stereocell:shapeKinds", "stereocell:shapeColors"
_TIPS, _SOFTNESS = "stereocell:shapeTips", "stereocell:shapeSoftness"
_TYPES = {
    _BOXES: Sdf.ValueTypeNames.Float4Array,
    _KINDS: Sdf.ValueTypeNames.TokenArray,
    _COLORS: Sdf.ValueTypeNames.Color4fArray,
    _TIPS: Sdf.ValueTypeNames.FloatArray,
    _SOFTNESS: Sdf.ValueTypeNames.FloatArray,
}


def read_shapes(prim: Usd.Prim) -> Shapes:
    """Return the shapes of a channel's selected transfer function; empty: the function is 1D.

    Kinds and boxes are required. Without the other arrays, tips are in the middle of the values,
    shapes have the channel's colour with opacity 1, and softness is 0.5.

    Raises StageError for an invalid shape, too many shapes, or arrays of different lengths.
    """
    boxes = [tuple(shortest(number) for number in box) for box in _values(prim, _BOXES)]
    count = len(boxes)
    kinds = _as_long(prim, _KINDS, count, None)
    if count > MAX_SHAPES:
        raise StageError(
            f"{prim.GetPath()}.{_BOXES}: found {count} shapes, expected at most {MAX_SHAPES}"
        )
    tips = _as_long(prim, _TIPS, count, [(v0 + v1) / 2 for v0, v1, _, _ in boxes])
    colors = _as_long(prim, _COLORS, count, [(1.0, 1.0, 1.0, 1.0)] * count)
    softness = _as_long(prim, _SOFTNESS, count, [0.5] * count)
    shapes = []
    for i, (kind, (v0, v1, g0, g1), color) in enumerate(zip(kinds, boxes, colors, strict=True)):
        r, g, b, opacity = (shortest(part) for part in color)
        soft, tip = shortest(softness[i]), shortest(tips[i])
        shape = Shape(kind, (v0, v1), (g0, g1), tip, (r, g, b), opacity, soft)
        fault = find_fault(shape)
        if fault:
            raise StageError(f"{prim.GetPath()}.{_BOXES}: shape {i}: {fault}")
        shapes.append(shape)
    return tuple(shapes)


def _values(prim: Usd.Prim, name: str) -> list[Any]:  # items of the attribute's USD type
    return list(read_as(prim.GetAttribute(name), _TYPES[name]) or [])


def _as_long(prim: Usd.Prim, name: str, count: int, default: list[Any] | None) -> list[Any]:
    """Return an array with an entry for each shape, or the default if the array is missing.

    Raises StageError if the array has another length, or is missing without a default.
    """
    values = _values(prim, name)
    if not values and default is not None:
        return default
    if len(values) != count:
        raise StageError(
            f"{prim.GetPath()}.{name}: found {len(values)} entries, expected {count}, one for each "
            f"shape in {_BOXES}"
        )
    return values
