"""Check the parts of the view that a notebook sets, before the page receives them."""

import math
import re
from collections.abc import Mapping
from typing import Any

from stereocell.model.errors import UsageError

_COLOR = re.compile(r"#[0-9a-fA-F]{6}", re.ASCII)
_LONGEST_LINK = 8000  # characters, longest link that the viewer reads
_PICKED = ("tile", "channel", "object")


def check_link(link: str) -> str:
    """Return the part of a link from `#` on; empty for an empty link.

    link  a whole link, or its part from `#` on

    Raises UsageError if it is no link to a view, or longer than the viewer reads.
    """
    start, mark, view = link.partition("#")
    if (start and not mark) or (mark and not view.startswith("v=")):
        raise UsageError(f"link is {link!r:.60}, expected a link to a view, such as #v=1&eye=...")
    if len(view) > _LONGEST_LINK:
        raise UsageError(f"link has {len(view)} characters, expected at most {_LONGEST_LINK}")
    return f"#{view}" if mark else ""


def check_channels(
    channels: Mapping[str, Any], ids: Mapping[str, str]
) -> dict[str, dict[str, Any]]:
    """Return the channels' appearances by ID. Raises UsageError for an unknown channel or value.

    ids  channel IDs, by each name that a channel may be called
    """
    for name in channels:
        if name not in ids:
            known = ", ".join(ids)
            raise UsageError(f"channels: there is no {name!r:.60}, expected {known}")
    return {ids[name]: _check_appearance(name, one) for name, one in channels.items()}


def _check_appearance(id_: str, appearance: Any) -> dict[str, Any]:
    if not isinstance(appearance, Mapping):
        raise UsageError(
            f"channels: {id_} is {appearance!r:.60}, expected a dict such as {{'opacity': 0.5}}"
        )
    checked: dict[str, Any] = {}
    for name, value in appearance.items():
        where = f"channels: {name} of {id_} is {value!r:.60}, expected"
        if name == "visible":
            if not isinstance(value, bool):
                raise UsageError(f"{where} True or False")
            checked[name] = value
        elif name == "color":
            if not (isinstance(value, str) and _COLOR.fullmatch(value)):
                raise UsageError(f"{where} a colour such as '#ff8000'")
            checked[name] = value.lower()
        elif name == "opacity":
            if not (_is_number(value) and 0 <= value <= 1):
                raise UsageError(f"{where} a number from 0 to 1")
            checked[name] = float(value)
        elif name == "window":
            window = _numbers(value, 2, where + " two of the source's values, the lower first")
            if window[0] >= window[1]:
                raise UsageError(f"{where} the lower value first")
            checked[name] = window
        else:
            raise UsageError(
                f"channels: {id_} has no {name!r:.40}, expected visible, color, opacity or window"
            )
    return checked


def check_view(view: Mapping[str, Any]) -> dict[str, list[float]]:
    """Return the camera's `eye_um` and `target_um`, as far as given, as lists of floats.

    Raises UsageError for other names, for values that are not x, y, z, and for equal points.
    """
    for name in view:
        if name not in ("eye_um", "target_um"):
            raise UsageError(f"view: {name!r:.40} is unknown, expected eye_um and target_um")
    checked = {name: _numbers(view[name], 3, f"view: {name}: expected x, y, z") for name in view}
    if len(checked) == 2 and checked["eye_um"] == checked["target_um"]:
        raise UsageError("view: eye_um equals target_um, expected two different points")
    return checked


def check_picked(picked: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Return a picked point, with its tile, channel and object if given; None: no point.

    Raises UsageError without `point_um`, for other names, and for values of the wrong type.
    """
    if picked is None:
        return None
    where = f"picked is {dict(picked)!r:.80}, expected {{'point_um': (x, y, z)}}"
    if "point_um" not in picked or not set(picked) <= {"point_um", *_PICKED}:
        raise UsageError(where)
    for name in _PICKED:
        if not isinstance(picked.get(name), str | None):
            raise UsageError(where)
    return {**picked, "point_um": _numbers(picked["point_um"], 3, where)}


def _numbers(values: Any, count: int, message: str) -> list[float]:
    """Return `count` finite numbers. Raises UsageError with the message."""
    try:
        listed = list(values)
    except TypeError:
        listed = []
    if len(listed) != count or not all(_is_number(value) for value in listed):
        raise UsageError(message)
    return [float(value) for value in listed]


def _is_number(value: Any) -> bool:
    try:
        return not isinstance(value, bool | str) and math.isfinite(value)
    except TypeError:
        return False
