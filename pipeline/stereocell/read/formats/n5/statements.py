"""Find the axes and the voxel spacing of an N5 dataset in every field that states them.

| field | axes | spacing |
|---|---|---|
| `axes` | fastest first, as everything in N5 | |
| `_ARRAY_DIMENSIONS`, `axis_names` and others, as Python writes them | slowest first | |
| `pixelResolution`, `resolution` with `units` | | fastest first |
| `transform` of COSEM | slowest first | in this order |

COSEM's `transform` is an attribute of the dataset, or part of the group's `multiscales`. Fields of
the dataset take precedence over those of the group around it.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stereocell.read.array_spacing import spacing_of
from stereocell.read.axis_names import NAME_LISTS, listed_names
from stereocell.read.axis_spacings import AxisSpacings
from stereocell.read.spacing import Triple
from stereocell.read.stated_numbers import numbers_of
from stereocell.read.statements import Statement, Trust

Attributes = Mapping[str, Any]
_SLOWEST_FIRST = ("x", "y", "z")  # axes, slowest first, if `axes` lists z, y, x


def named_axes(level: Attributes, group: Attributes) -> list[Statement]:
    """Return the names of a dataset's axes, slowest first, for each field that names them."""
    found = []
    rank = len(numbers_of(level.get("dimensions")))
    for attributes, place, trust in (
        (level, "axes of the dataset", Trust.STATED),
        (group, "axes of the group", Trust.REPEATED),
    ):
        if isinstance(listed := attributes.get("axes"), list):
            names = tuple(str(axis).lower() for axis in reversed(listed))
            found.append(Statement(names, place, trust))
        for field in NAME_LISTS if rank else ():
            if field != "axes" and (slowest_first := listed_names(attributes.get(field), rank)):
                found.append(
                    Statement(slowest_first, f"{field}{place.removeprefix('axes')}", trust)
                )
    for transform, place, trust in _transforms(level, group):
        names = tuple(str(axis).lower() for axis in transform["axes"])
        found.append(Statement(names, f"axes of {place}", trust))
    return found


def order_note(stated: Sequence[Statement], axes: Sequence[str], given: str) -> tuple[str, ...]:
    """Return a note if `axes` lists z first, since N5 lists the fastest axis first.

    given  the user's `--axes`
    """
    is_odd = tuple(axes) == _SLOWEST_FIRST and not given
    if not is_odd or not any(
        one.value == _SLOWEST_FIRST and one.place.startswith("axes of the") for one in stated
    ):
        return ()
    return (
        "order of the axes: `axes` lists z, y, x, and N5 lists the fastest axis first, so x is "
        "the slowest: --axes zyx reads it in the other order",
    )


def settle_spacing(
    level: Attributes, group: Attributes, axes: Sequence[str]
) -> tuple[Triple | None, tuple[str, ...]]:
    """Return the spacing (z, y, x) of the finest level, um (None: not stated), and notes.

    axes  names of the dataset's axes, slowest first
    """
    spacings = AxisSpacings(axes)
    for transform, place, trust in _transforms(level, group):
        named = [str(axis).lower() for axis in transform["axes"]]
        _add(spacings, numbers_of(transform["scale"]), transform.get("units"), named, place, trust)
    for attributes, of, trust in (
        (level, "the dataset", Trust.STATED),
        (group, "the group", Trust.REPEATED),
    ):
        for name in ("pixelResolution", "resolution"):
            sizes: Any = attributes.get(name)
            unit: Any = None
            if isinstance(sizes, Mapping):
                sizes, unit = sizes.get("dimensions"), sizes.get("unit")
            unit = unit or attributes.get("units", attributes.get("unit"))
            unit = unit[::-1] if isinstance(unit, list) else unit
            _add(spacings, numbers_of(sizes)[::-1], unit, axes, f"{name} of {of}", trust)
    settled = spacings.settled()
    z, y, x = settled.spacing_um
    whole = None if z is None or y is None or x is None else (z, y, x)
    return whole, settled.notes


def _add(
    spacings: AxisSpacings, sizes: Sequence[float], unit: Any, axes: Sequence[str],
    place: str, trust: Trust,
) -> None:  # fmt: skip
    found = spacing_of(sizes, unit, axes) if sizes else None
    if found is not None:
        spacings.add_all(found, place, trust)


def _transforms(
    level: Attributes, group: Attributes
) -> Iterator[tuple[Mapping[str, Any], str, Trust]]:
    """Yield the transforms of the finest level that name z, y and x once each, and their place."""
    try:
        in_group = group["multiscales"][0]["datasets"][0]["transform"]
    except (LookupError, TypeError):
        in_group = None
    for found, place, trust in (
        (level.get("transform"), "transform of the dataset", Trust.STATED),
        (group.get("transform"), "transform of the group", Trust.REPEATED),
        (in_group, "transform in the group's multiscales", Trust.REPEATED),
    ):
        if not isinstance(found, Mapping):
            continue
        named, scale = found.get("axes"), found.get("scale")
        if not isinstance(named, list) or not isinstance(scale, list):
            continue
        letters = [str(axis).lower() for axis in named]
        if all(letters.count(axis) == 1 for axis in "zyx"):
            yield found, place, trust
