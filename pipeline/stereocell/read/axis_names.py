"""Names that writers give to the axes of an array, and the axis that each name means.

| writer | field |
|---|---|
| Zarr v3, xarray | `dimension_names`, `_ARRAY_DIMENSIONS` |
| funlib and daisy, where a `^` ends the name of an axis that is not spatial | `axis_names` |
| openPMD | `axisLabels` |
| others | `axis_labels`, `axis_order`, `axes`, `dims` |
"""

import ast
import re
from collections.abc import Sequence
from typing import Any

from stereocell.model.axes import AXES
from stereocell.read.stated_texts import text_of

NAME_LISTS = (
    *("dimension_names", "_ARRAY_DIMENSIONS", "axis_names", "axis_labels"),
    *("axisLabels", "axis_order", "axes", "dims"),
)
_WORDS = {
    "time": "t", "timepoint": "t", "frame": "t",
    "channel": "c", "band": "c", "wavelength": "c", "ch": "c",
    "depth": "z", "slice": "z", "plane": "z", "section": "z", "level": "z", "lev": "z",
    "altitude": "z", "elevation": "z",
    "row": "y", "lat": "y", "latitude": "y", "height": "y",
    "column": "x", "col": "x", "lon": "x", "longitude": "x", "width": "x",
}  # fmt: skip
_NOT_OF_SPACE = "^"
_LETTER = re.compile(
    r"(?:dim|axis|coord|pos|n|p)?[_\- ]?([tczyx])"
    r"(?:[_\- ]?(?:dim|axis|space|coord|coordinate|pos|position|c|um|nm|mm|px|pixels?|index))?"
)
_BETWEEN = re.compile(r"[\s,:;]+")


def axis_of(name: str) -> str:
    """Return the axis that a dimension's name means; the name in lower case if it means none.

    >>> [axis_of(name) for name in ("Z", "x_um", "Time", "columns", "zspace", "phony_dim_0")]
    ['z', 'x', 't', 'x', 'z', 'phony_dim_0']
    """
    text = name.strip().lower()
    if text.endswith(_NOT_OF_SPACE):
        axis = axis_of(text.rstrip(_NOT_OF_SPACE))
        return axis if axis in ("t", "c") else "c"
    if (word := _WORDS.get(text) or _WORDS.get(text.removesuffix("s"))) is not None:
        return word
    found = _LETTER.fullmatch(text)
    return found[1] if found else text


def axes_of_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return the axis of each name, as `axis_of` does.

    A height is y beside a width. If another name means y and none means z, a height is z, as in
    files on the atmosphere.

    >>> axes_of_names(["width", "height", "depth"]), axes_of_names(["height", "lat", "lon"])
    (('x', 'y', 'z'), ('z', 'y', 'x'))
    """
    axes = [axis_of(name) for name in names]
    if axes.count("y") == 2 and "z" not in axes:
        axes = [
            "z" if name.strip().lower() == "height" else axis
            for name, axis in zip(names, axes, strict=True)
        ]
    return tuple(axes)


def listed_names(value: Any, count: int) -> tuple[str, ...]:
    """Return the names of `count` axes that an attribute lists; empty: it has no such list.

    The attribute is a list of texts or of tables with a `name`, or one text with all names.

    >>> listed_names("z:y:x", 3), listed_names([{"name": "z"}, {"name": "y"}, {"name": "x"}], 3)
    (('z', 'y', 'x'), ('z', 'y', 'x'))
    >>> listed_names("['x', 'y', 'z']", 3), listed_names("ZYX", 3), listed_names("volume", 3)
    (('x', 'y', 'z'), ('Z', 'Y', 'X'), ())
    """
    if text := text_of(value):
        names = _in_text(text)
    elif isinstance(value, list | tuple) or getattr(value, "ndim", 0) == 1:
        names = [text_of(one.get("name") if isinstance(one, dict) else one) for one in value]
    else:
        names = []
    return tuple(names) if len(names) == count and any(names) else ()


def _in_text(text: str) -> list[str]:
    if text.startswith(("[", "(")):
        try:
            found = ast.literal_eval(text)
        except (ValueError, SyntaxError, MemoryError, RecursionError):
            found = None
        if isinstance(found, list | tuple):
            return [text_of(one) for one in found]
    parts = _BETWEEN.split(text.strip("[]() "))
    if len(parts) == 1 and set(text.lower()) <= set(AXES):
        return list(text)
    return parts
