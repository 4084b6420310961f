"""Read single values of a composed stage, and say which prim lacks one."""

from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Tf, Usd

from stereocell.errors import StageError

Point = tuple[float, float, float]


def value_of(prim: Usd.Prim, name: str) -> Any:  # what USD holds there
    """Return an attribute's value at the default time. Raises StageError if it has none."""
    value = prim.GetAttribute(name).Get() if prim.HasAttribute(name) else None
    if value is None:
        raise StageError(f"{prim.GetPath()}.{name}: no value")
    return value


def file_of(attribute: Usd.Attribute) -> Path:
    """Return the file that an asset attribute resolves to. Raises StageError if there is none."""
    asset = attribute.Get() if attribute else None
    if asset is None or not asset.resolvedPath:
        named = asset.path if asset is not None else ""
        raise StageError(f"{attribute.GetPath()}: no file at {named!r}")
    return Path(asset.resolvedPath)


def color_of(attribute: Usd.Attribute) -> tuple[float, float, float]:
    """Return a colour. Raises StageError if it is none, or one brighter than glTF can say."""
    value = attribute.Get() if attribute else None
    if value is None or not all(0 <= part <= 1 for part in value):
        raise StageError(f"{attribute.GetPath()}: {value}, expected three numbers in 0..1")
    r, g, b = (shortest(part) for part in value)
    return r, g, b


def point_of(value: Gf.Vec3d) -> Point:
    x, y, z = (float(part) for part in value)
    return x, y, z


def shortest(number: float) -> float:
    """Return the shortest decimal that is this float32: 0.2, not 0.20000000298023224."""
    return float(str(np.float32(number)))


def select_variant(prim: Usd.Prim, variant_set: str, variant: str) -> None:
    """Select a variant for this process alone: in the session layer, which is never saved."""
    stage = prim.GetStage()
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        prim.GetVariantSet(variant_set).SetVariantSelection(variant)


def one_line(error: object) -> str:
    """Return what USD says about an error, without its line breaks and places in its source."""
    args = error.args if isinstance(error, Tf.ErrorException) else ()
    text = "; ".join(entry.commentary for entry in args) or str(error)
    return " ".join(text.split())
