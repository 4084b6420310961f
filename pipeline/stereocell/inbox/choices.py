"""The few settings of a specimen that a person chooses in the inbox."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from stereocell.inbox.refused import RefusedError
from stereocell.model.titles import MAX_TITLE
from stereocell.planning.settings import NO_PRESET, preset_names

DARK, BRIGHT = "dark", "bright"  # brightness of the background around structures
_MAX_CHANNELS = 1000
_MAX_SERIES = 100_000
_MAX_UM = 1e7  # um; a larger voxel spacing is refused


@dataclass(frozen=True, slots=True)
class Choices:
    """A person's choices. StereoCell makes the choices that are empty.

    channels    indices of the source's channels, as texts
    series      number of one image among several, from 1, as a text
    background  `bright` if structures are darker than their surroundings
    spacing_um  voxel spacing (x, y, z), um, for files that state none or a wrong one
    """

    preset: str = ""
    channels: tuple[str, ...] = ()
    series: str = ""
    background: str = ""
    spacing_um: tuple[float, ...] = ()
    title: str = ""

    def settings(self) -> dict[str, Any]:
        """Return the chosen settings of the plan, by name. `spacing_um` becomes (z, y, x)."""
        found: dict[str, Any] = {}
        if self.channels:
            found["channels"] = list(self.channels)
        if self.series:
            found["series"] = int(self.series)
        if self.background == BRIGHT:
            found["dark"] = True
        if self.spacing_um:
            found["spacing_um"] = list(self.spacing_um[::-1])
        return found

    def to_json(self) -> dict[str, Any]:
        """Return the choices as plain values."""
        lists = {"channels": list(self.channels), "spacing_um": list(self.spacing_um)}
        return {**asdict(self), **lists}

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> "Choices":
        """Return the choices from which `to_json` made the content."""
        lists = {name: tuple(content[name]) for name in ("channels", "spacing_um")}
        return cls(**{**content, **lists})


def parse_choices(content: Any, before: Choices) -> Choices:
    """Return the choices `before` with the changes of a request. Raises RefusedError."""
    known = Choices.__dataclass_fields__
    if not isinstance(content, dict) or not content.keys() <= known.keys():
        raise RefusedError(400, f"choices: expected an object with only {', '.join(known)}")
    changes = dict(content)
    for name, value in content.items():
        if name == "channels":
            changes[name] = _channels_of(value)
        elif name == "spacing_um":
            changes[name] = _spacing_of(value)
        elif not isinstance(value, str):
            raise RefusedError(400, f"{name}: expected a text")
    if changes.get("preset", "") not in ("", NO_PRESET, *preset_names()):
        raise RefusedError(400, f"preset: expected one of {', '.join(preset_names())}, {NO_PRESET}")
    if changes.get("background", "") not in ("", DARK, BRIGHT):
        raise RefusedError(400, f"background: expected {DARK} or {BRIGHT}")
    if series := changes.get("series", ""):
        _require_number("series", series, range(1, _MAX_SERIES))
    title = changes.get("title", "").strip()
    if len(title) > MAX_TITLE or not title.isprintable():
        raise RefusedError(400, f"title: expected at most {MAX_TITLE} printable characters")
    if "title" in changes:
        changes["title"] = title
    return replace(before, **changes)


def _channels_of(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or len(value) > _MAX_CHANNELS:
        raise RefusedError(400, "channels: expected a list of the channels' IDs")
    for one in value:
        if not isinstance(one, str):
            raise RefusedError(400, "channels: expected a list of the channels' IDs")
        _require_number("channels", one, range(_MAX_CHANNELS))
    if len(set(value)) < len(value):
        raise RefusedError(400, "channels: found a channel twice, expected each once")
    return tuple(value)


def _spacing_of(value: Any) -> tuple[float, ...]:
    is_list = isinstance(value, list) and len(value) in (0, 3)
    if not is_list or not all(type(one) in (int, float) and 0 < one < _MAX_UM for one in value):
        raise RefusedError(400, "spacing_um: expected three lengths x, y, z in um, each above 0")
    return tuple(float(one) for one in value)


def _require_number(name: str, text: str, within: range) -> None:
    is_number = text.isascii() and text.isdecimal() and len(text) <= 6
    if not is_number or int(text) not in within:
        raise RefusedError(400, f"{name}: expected a number from {within.start} as a text")
