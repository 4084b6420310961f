"""Names, colours and columns of objects, from the file of their label map."""

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class ObjectNotes:
    """Names, colours and further columns by label. A label may lack any of them.

    names    name for people, by label
    colors   linear RGB, 0..1, by label
    columns  number or text by label, by the column's name
    """

    names: dict[int, str] = field(default_factory=dict)
    colors: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    columns: dict[str, dict[int, float | str]] = field(default_factory=dict)
