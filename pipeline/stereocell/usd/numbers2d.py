"""Write and read the numbers of a channel's 2D transfer functions as attributes of the stage.

The names come from the fields of TransferFunctions2d: `gradient_max` becomes `gradientMax`. The
limits come from schemas/channel.schema.json.
"""

import json
from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from math import inf
from typing import Any

from pxr import Sdf, Usd

from stereocell.model.channel import TransferFunctions2d
from stereocell.model.errors import StageError
from stereocell.storage.assets import find_asset
from stereocell.usd.layer import set_attribute
from stereocell.usd.read_attributes import shortest
from stereocell.usd.typed_values import read_as


def attribute_of(field: str) -> str:
    """Return the attribute's name for a field: `stereocell:gradientMax` for `gradient_max`."""
    first, *others = field.split("_")
    return f"stereocell:{first}{''.join(word.capitalize() for word in others)}"


ATTRIBUTES = {
    field.name: attribute_of(field.name)
    for field in fields(TransferFunctions2d)
    if field.name != "functions"
}


def write_numbers(prim: Usd.Prim, transfer_2d: TransferFunctions2d) -> None:
    """Write each number as a float attribute of a channel's material."""
    for field, attribute in ATTRIBUTES.items():
        set_attribute(prim, attribute, Sdf.ValueTypeNames.Float, getattr(transfer_2d, field))


def read_numbers(prim: Usd.Prim) -> dict[str, float]:
    """Return the numbers of a channel's 2D functions by field name; missing ones are left out.

    Stages that this pipeline wrote have all of them. Raises StageError for a number outside its
    limits.
    """
    found = {}
    for field, attribute in ATTRIBUTES.items():
        value = read_as(prim.GetAttribute(attribute), Sdf.ValueTypeNames.Float, may_be_nan=True)
        if value is None:
            continue
        expected = _outside(value, _limits()[attribute])
        if expected:
            raise StageError(
                f"{prim.GetPath()}.{attribute} is {value:g}, expected a number {expected}"
            )
        found[field] = shortest(value)
    return found


def _outside(value: float, limits: Mapping[str, Any]) -> str:
    """Return the limit that a number violates, in words; empty: none. NaN is never valid."""
    above, least = limits.get("exclusiveMinimum", -inf), limits.get("minimum", -inf)
    if not value > above:
        return f"above {above:g}"
    if not value >= least:
        return f"at least {least:g}"
    most = limits.get("maximum", inf)
    return "" if value < inf and value <= most else f"at most {most:g}"


@cache
def _limits() -> dict[str, dict[str, Any]]:
    """Return the JSON schema of each attribute of a channel, by attribute name."""
    content = json.loads(find_asset("schemas/channel.schema.json").read_bytes())
    return dict(content["properties"])
