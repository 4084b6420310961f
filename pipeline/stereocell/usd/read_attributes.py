"""Read single values of a composed stage. The errors name the prim and the attribute."""

from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Usd

from stereocell.model.errors import StageError
from stereocell.usd.typed_values import read_as, require_type

Point = tuple[float, float, float]


def value_of(prim: Usd.Prim, name: str, expected: Sdf.ValueTypeName) -> Any:  # USD's own type
    """Return an attribute's value at the default time.

    Raises StageError if it has no value, or one of another type than `expected`.
    """
    value = read_as(prim.GetAttribute(name), expected)
    if value is None:
        raise StageError(
            f"{prim.GetPath()}.{name}: found no value, expected one of type {expected}"
        )
    return value


def require_still(*attributes: Usd.Attribute) -> None:
    """Raise StageError for an animated attribute: readers use the default time only."""
    for attribute in attributes:
        if attribute and attribute.GetNumTimeSamples():
            raise StageError(over_time(attribute))


def over_time(attribute: Usd.Attribute) -> str:
    """Return the error message for an animated attribute."""
    return (
        f"{attribute.GetPath()}: found values over time, expected one without a time: "
        "export a single frame"
    )


def file_of(attribute: Usd.Attribute) -> Path:
    """Return the file that an asset attribute resolves to. Raises StageError if there is none."""
    asset = read_as(attribute, Sdf.ValueTypeNames.Asset)
    if asset is None or not asset.resolvedPath:
        named = asset.path if asset is not None else ""
        raise StageError(
            f"{attribute.GetPath()}: found no file at {named!r}, expected one: correct the path"
        )
    return Path(asset.resolvedPath)


def color_of(attribute: Usd.Attribute, value: Any = None) -> tuple[float, float, float]:
    """Return a colour, linear RGB. Raises StageError if it is missing or has values outside 0..1.

    value  one colour of an attribute that holds an array; None: the attribute holds one colour
    """
    if value is None:
        value = read_as(attribute, Sdf.ValueTypeNames.Color3f, may_be_nan=True)
    else:
        require_type(attribute.GetPath(), value, Sdf.ValueTypeNames.Color3f, may_be_nan=True)
    if value is None or not all(0 <= part <= 1 for part in value):
        raise StageError(f"{attribute.GetPath()} is {value}, expected three numbers from 0 to 1")
    r, g, b = (shortest(part) for part in value)
    return r, g, b


def numbers_of(prim: Usd.Prim, name: str, count: int) -> list[float]:
    """Return an attribute's numbers. Raises StageError unless there are `count`, all finite."""
    value = prim.GetAttribute(name).Get()
    if value is None:
        raise StageError(
            f"{prim.GetPath()}.{name}: found no value, expected {count} finite numbers"
        )
    try:
        numbers = [] if isinstance(value, str) else [float(part) for part in np.ravel(value)]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != count or not all(map(isfinite, numbers)):
        raise StageError(
            f"{prim.GetPath()}.{name}: found {value!s:.60}, expected {count} finite numbers"
        )
    return numbers


def sizes_of(prim: Usd.Prim, name: str, count: int) -> list[int]:
    """Return an attribute's whole numbers. Raises StageError unless there are `count` from 0 up."""
    numbers = numbers_of(prim, name, count)
    if not all(number >= 0 and number.is_integer() for number in numbers):
        raise StageError(
            f"{prim.GetPath()}.{name}: found {numbers}, expected whole numbers of voxels"
        )
    return [int(number) for number in numbers]


def point_of(prim: Usd.Prim, name: str) -> Point:
    """Return a point or a vector (x, y, z). Raises StageError unless it has 3 finite numbers."""
    x, y, z = numbers_of(prim, name, 3)
    return x, y, z


def shortest(number: float) -> float:
    """Return the shortest decimal that is the same float32: 0.2, not 0.20000000298023224."""
    return float(str(np.float32(number)))


def select_variant(prim: Usd.Prim, variant_set: str, variant: str) -> None:
    """Select a variant in the session layer, which is never saved."""
    if prim.GetVariantSet(variant_set).GetVariantSelection() == variant:
        return  # to select it again would compose the prim again
    stage = prim.GetStage()
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        prim.GetVariantSet(variant_set).SetVariantSelection(variant)
