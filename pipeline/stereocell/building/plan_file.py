"""The plan as plan.json holds it (plan.schema.json), and back."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from stereocell.building.plan import Channel, Plan
from stereocell.building.settings import from_dict, to_dict
from stereocell.model.errors import OutputError
from stereocell.model.rigid_transform import to_matrix
from stereocell.model.settings import AUTO
from stereocell.model.tiling import Box, Tile

_FORMAT, _VERSION = "stereocell-plan", 1


def to_json(plan: Plan) -> dict[str, Any]:
    """Return the plan as plain values, as plan.json holds it."""
    return {
        "format": _FORMAT,
        "version": _VERSION,
        "source": plan.source,
        "name": plan.name,
        "fingerprint": plan.fingerprint,
        "level": plan.level,
        "level_reason": plan.level_reason,
        "spacing_um": list(plan.spacing_um),
        "origin_um": list(plan.origin_um),
        "region": _box_json(plan.region),
        "halo": list(plan.halo),
        "tiles": [{"id": tile.id, **_box_json(tile.box)} for tile in plan.tiles],
        "channels": [_channel_json(c) for c in plan.channels],
        "settings": to_dict(plan.settings),
        "modality": plan.modality,
        "placement": [list(row) for row in plan.placement],
    }


def from_json(content: Mapping[str, Any]) -> Plan:
    """Return the plan that `to_json` was given; the content has passed its schema.

    Raises OutputError for what no plan of ours says.
    """
    plan = _from_json(content)
    fault = _find_fault(plan)
    if fault is not None:
        raise OutputError(f"plan.json: {fault}: remove it and run `stereocell plan INPUT -o OUT`")
    return plan


def _find_fault(plan: Plan) -> str | None:
    """Return what a schema can't say of a plan that was edited or damaged."""
    for name in (plan.name, *(channel.name for channel in plan.channels)):
        if not name.isprintable():
            return f"name: found {name!r:.80}, expected one that can be shown"
    if not _is_inside(plan.region, Box((0, 0, 0), plan.region.stop)):
        return f"region: found {plan.region!s:.100}, expected voxels in it"
    for tile in plan.tiles:
        if not _is_inside(tile.box, plan.region):
            return f"tile {tile.id}: found {tile.box!s:.100}, expected a box inside the region"
    if plan.settings.surface.resolved(plan.spacing_um) != plan.settings.surface:
        return f"settings: surface: found {AUTO!r}, expected lengths"
    return None


def _is_inside(box: Box, region: Box) -> bool:
    ends = zip(region.start, box.start, box.stop, region.stop, strict=True)
    return all(low <= start < stop <= high for low, start, stop, high in ends)


def _from_json(content: Mapping[str, Any]) -> Plan:
    return Plan(
        source=content["source"],
        name=content["name"],
        fingerprint=content["fingerprint"],
        level=content["level"],
        level_reason=content["level_reason"],
        spacing_um=tuple(content["spacing_um"]),
        origin_um=tuple(content["origin_um"]),
        region=_box(content["region"]),
        halo=tuple(content["halo"]),
        tiles=tuple(Tile(tile["id"], _box(tile)) for tile in content["tiles"]),
        channels=tuple(
            Channel(
                c["index"],
                c["name"],
                tuple(c["color"]),
                c.get("source", ""),
                c.get("fingerprint", ""),
            )
            for c in content["channels"]
        ),
        settings=from_dict(content["settings"]),
        modality=content["modality"],
        placement=to_matrix(content["placement"]),
    )


def _channel_json(channel: Channel) -> dict[str, Any]:
    own = {k: v for k, v in asdict(channel).items() if v or k not in ("source", "fingerprint")}
    return {**own, "color": list(channel.color)}


def _box_json(box: Box) -> dict[str, list[int]]:
    return {"start": list(box.start), "stop": list(box.stop)}


def _box(content: Mapping[str, Any]) -> Box:
    return Box(tuple(content["start"]), tuple(content["stop"]))
