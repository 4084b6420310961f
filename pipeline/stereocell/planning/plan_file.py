"""Convert a plan to the content of plan.json (plan.schema.json) and back."""

from collections.abc import Mapping
from functools import cache
from typing import Any

from pydantic import TypeAdapter, ValidationError

from stereocell.model.errors import OutputError
from stereocell.model.settings import AUTO
from stereocell.model.tiling import Box
from stereocell.planning.plan import Plan
from stereocell.planning.settings import from_dict

_FORMAT, _VERSION = "stereocell-plan", 1
_AGAIN = "remove it and run `stereocell plan INPUT -o OUT`"

# Key of a channel in plans of an earlier version: the key now
_RENAMED_IN_CHANNELS = {"rung": "level"}


@cache
def _adapter() -> TypeAdapter[Plan]:
    return TypeAdapter(Plan)


def to_json(plan: Plan) -> dict[str, Any]:
    """Return the plan as the content of plan.json. The box of a tile is written into the tile."""
    content = _adapter().dump_python(plan, mode="json")
    for tile in content["tiles"]:
        tile |= tile.pop("box")
    for channel in content["channels"]:
        for key in ("source", "fingerprint", "level", "base"):
            if not channel[key]:
                del channel[key]
    for labels in content["labels"]:
        if not labels["background"]:
            del labels["background"]
    return {"format": _FORMAT, "version": _VERSION, **content}


def from_json(content: Mapping[str, Any], remedy: str = _AGAIN) -> Plan:
    """Return the plan from the content of plan.json, which must have passed its schema.

    Raises OutputError for content that no plan of StereoCell has.
    """
    tiles = [{"id": tile["id"], "box": tile} for tile in content["tiles"]]
    channels = [
        {_RENAMED_IN_CHANNELS.get(key, key): value for key, value in channel.items()}
        for channel in content["channels"]
    ]
    own = {"tiles": tiles, "channels": channels, "settings": from_dict(content["settings"])}
    try:
        plan = _adapter().validate_python({**content, **own})
        fault = _find_fault(plan)
    except ValidationError as error:  # the schema accepts a lone surrogate in a text, pydantic not
        first = error.errors(include_url=False)[0]
        fault = f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
    if fault is not None:
        raise OutputError(f"plan.json: {fault}: {remedy}")
    return plan


def _find_fault(plan: Plan) -> str | None:
    """Return a fault of an edited or damaged plan that its schema can't find; None: it has none."""
    names = [*(one.name for one in plan.channels), *(one.name for one in plan.labels)]
    for name in (plan.name, *names):
        if not name.isprintable():
            return f"name: found {name!r:.80}, expected printable characters"
    if not _is_inside(plan.region, Box((0, 0, 0), plan.region.stop)):
        return f"region: found {plan.region!s:.100}, expected a box with at least one voxel"
    for tile in plan.tiles:
        if not _is_inside(tile.box, plan.region):
            return f"tile {tile.id}: found {tile.box!s:.100}, expected a box inside the region"
    if plan.settings.surface.resolved(plan.spacing_um) != plan.settings.surface:
        return f"settings: surface: found {AUTO!r}, expected lengths"
    return None


def _is_inside(box: Box, region: Box) -> bool:
    ends = zip(region.start, box.start, box.stop, region.stop, strict=True)
    return all(low <= start < stop <= high for low, start, stop, high in ends)
