"""Compare what a header of NRRD states on lengths, units and values.

The length of an axis is in `space directions`, in `spacings`, or in `axis mins` and `axis maxs`.
Its unit is in `space units` (for the space's axes) or in `units` (for the array's axes). `space
directions` takes precedence over `spacings`, and both over the ends of an axis, whose step depends
on `centerings`.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.spacing import um_per
from stereocell.read.statements import Statement, Subject, Trust, settle

Fields = Mapping[str, Any]
_REMEDY = "--spacing-um z,y,x replaces it"
_LENGTHS = Subject("voxel spacing along the axes of space", "units of the header", remedy=_REMEDY)
_UNIT = Subject("unit of length", remedy=_REMEDY)
_SPATIAL = ("domain", "space")  # kinds of an axis of space
_UNSTATED = ("???", "none", "")  # kinds that state nothing


def axis_lengths(fields: Fields, sizes: Sequence[int]) -> NDArray[np.float64]:
    """Return the voxel spacing along each axis from `spacings` or its ends; NaN: not stated."""
    spacings, by_ends = _spacings(fields, len(sizes)), _by_ends(fields, sizes)
    return np.where(np.isfinite(spacings), spacings, by_ends)


def length_notes(
    fields: Fields, sizes: Sequence[int], directions: NDArray[np.float64], axes: Sequence[int]
) -> tuple[str, ...]:
    """Compare the lengths in `space directions`, `spacings` and the axes' ends.

    directions  a row for each axis; NaN: none
    axes        indices of the axes of space
    """
    spacings, by_ends = _spacings(fields, len(sizes)), _by_ends(fields, sizes)
    stated = [("spacings", spacings), ("the range of axis mins and maxs", by_ends)]
    if fields.get("space directions") is not None:
        stated.insert(0, ("space directions", np.linalg.norm(directions, axis=1)))
    statements = [
        Statement(tuple(float(abs(n)) for n in lengths[list(axes)]), place, trust)
        for (place, lengths), trust in zip(
            stated, (Trust.STATED, Trust.REPEATED, Trust.DERIVED), strict=False
        )
        if np.isfinite(lengths[list(axes)]).all()
    ]
    return settle(_LENGTHS, statements).notes if statements else ()


def kind_notes(fields: Fields, axes: Sequence[int]) -> tuple[str, ...]:
    """Return a note if `kinds` names other axes of space than the axes that have a direction."""
    kinds = [str(kind).lower() for kind in fields.get("kinds", ())]
    stated = [index for index, kind in enumerate(kinds) if kind in _SPATIAL]
    if not stated or any(kind in _UNSTATED for kind in kinds) or stated == list(axes):
        return ()
    subject = Subject("axes of space, counted from 0")
    numbers = [Statement(tuple(map(str, axes)), "space directions")]
    numbers.append(Statement(tuple(map(str, stated)), "kinds", Trust.REPEATED))
    return settle(subject, numbers).notes


def value_notes(fields: Fields) -> tuple[str, ...]:
    """Return a note if the voxels were mapped from another range, which the format records."""
    low, high = (fields.get(name, fields.get(name.replace(" ", ""))) for name in _OLD)
    if low is None or high is None:
        return ()
    return (
        f"values: old min {float(low):g} and old max {float(high):g} state the range before the "
        "voxels were mapped to whole numbers: the voxels are read as stored",
    )


_OLD = ("old min", "old max")


def units_um(
    fields: Fields, axes: Sequence[int], *, is_patient: bool
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Return a factor to um, (3, 3), for each component of the directions, and notes.

    axes  indices of the axes of space, which are the rows of the result; the columns are the
          space's own axes

    NaN where no unit is stated; in a patient's space mm are assumed instead.
    """
    of_space = _texts(fields.get("space units"))
    listed = _texts(fields.get("units"))
    of_axes = [listed[index] if index < len(listed) else "" for index in axes]
    columns, rows = ([um_per(unit) for unit in units] for units in (of_space, of_axes))
    notes: tuple[str, ...] = ()
    if len(columns) == 3 and None not in columns:
        if None not in rows:
            notes = _compared(of_space, of_axes)
        return np.tile(np.array(columns, float), (3, 1)), notes
    factors = np.array([np.nan if unit is None else unit for unit in rows], float)
    if is_patient and np.isnan(factors).any():
        reason = "as Slicer and ITK do in a patient's space"
        odd = [unit for unit in (*of_space, *of_axes) if unit and um_per(unit) is None]
        if odd:
            reason = f"since {odd[0]!r:.40} is not a unit of length"
        notes = settle(_UNIT, [Statement("mm", reason, Trust.ASSUMED)]).notes
        factors = np.where(np.isnan(factors), 1000.0, factors)
    return np.tile(factors[:, None], (1, 3)), notes


def _compared(of_space: Sequence[str], of_axes: Sequence[str]) -> tuple[str, ...]:
    """Return a note if the units of the space's axes differ from those of the array's axes."""
    one, other = (sorted({um_per(unit) or 0.0 for unit in units}) for units in (of_space, of_axes))
    if one == other:
        return ()
    statements = [
        Statement(tuple(of_space), "space units"),
        Statement(tuple(of_axes), "units", Trust.REPEATED),
    ]
    return settle(_UNIT, statements).notes


def _texts(value: Any) -> list[str]:
    return [str(unit).strip(' "') for unit in (() if value is None else value)]


def _spacings(fields: Fields, count: int) -> NDArray[np.float64]:
    return _numbers(fields.get("spacings"), count)


def _by_ends(fields: Fields, sizes: Sequence[int]) -> NDArray[np.float64]:
    """Return the steps from the first and last position of each axis; NaN: they state none.

    A position is that of a sample (node), or of a sample's edge (cell).
    """
    count = len(sizes)
    low, high = (
        _numbers(fields.get(name, fields.get(name.replace(" ", ""))), count)
        for name in ("axis mins", "axis maxs")
    )
    centers = fields.get("centerings", fields.get("centers", ()))
    named = [str(one).lower() for one in centers] + [""] * count
    steps = np.full(count, np.nan)
    for index, size in enumerate(sizes):
        number = {"node": size - 1, "cell": size}.get(named[index], 0)
        if number > 0:
            steps[index] = (high[index] - low[index]) / number
    return np.where(steps == 0, np.nan, steps)


def _numbers(value: Any, count: int) -> NDArray[np.float64]:
    """Return a number for each axis; NaN: not stated."""
    found = np.full(count, np.nan)
    given = np.ravel(() if value is None else value).astype(float)[:count]
    found[: len(given)] = given
    return found
