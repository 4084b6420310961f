"""What a label map's own file says of its objects."""

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class ObjectNotes:
    """Names, colours and further columns by label; each may be missing for some.

    names       for people
    colors      linear RGB, 0..1
    columns     by the property's name: numbers or texts by label
    """

    names: dict[int, str] = field(default_factory=dict)
    colors: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    columns: dict[str, dict[int, float | str]] = field(default_factory=dict)
