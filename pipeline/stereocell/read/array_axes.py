"""The axes of an array that its format leaves open: given, named by attributes, or assumed."""

import re
from collections.abc import Sequence

from stereocell.model.axes import AXES, axes_of, is_axes
from stereocell.model.errors import SourceError, UsageError
from stereocell.read.series import counted
from stereocell.read.statements import Statement, Subject, Trust, settle

_ORDER = Subject("order of the axes", remedy="--axes names another one")
_WORDS = {
    "time": "t", "timepoint": "t", "frame": "t",
    "channel": "c", "band": "c", "wavelength": "c",
    "depth": "z", "slice": "z", "plane": "z", "section": "z", "level": "z",
    "row": "y", "lat": "y", "latitude": "y",
    "column": "x", "col": "x", "lon": "x", "longitude": "x",
}  # fmt: skip
_ANGLES = ("theta", "angle", "tilt", "projection", "rotation")
_LETTER = re.compile(
    r"(?:dim|axis|coord|pos|n|p)?[_\- ]?([tczyx])"
    r"(?:[_\- ]?(?:dim|axis|space|coord|coordinate|pos|position|c|um|nm|mm|px|pixels?|index))?"
)


def axis_of(name: str) -> str:
    """Return the axis that a name of a dimension means; the name in lower case: it means none.

    >>> [axis_of(name) for name in ("Z", "x_um", "Time", "columns", "zspace", "phony_dim_0")]
    ['z', 'x', 't', 'x', 'z', 'phony_dim_0']
    """
    text = name.strip().lower()
    if (word := _WORDS.get(text) or _WORDS.get(text.removesuffix("s"))) is not None:
        return word
    found = _LETTER.fullmatch(text)
    return found[1] if found else text


def given_axes(where: str, shape: Sequence[int], given: str) -> tuple[str, ...]:
    """Return the axes of an array by the user's `--axes`: a letter for each, `_` where it has none.

    given  letters of all axes, or of those longer than 1, slowest first, as `zcyx`

    Raises UsageError where the letters don't fit the shape.
    """
    letters = axes_of(given)
    long = [place for place, size in enumerate(shape) if size > 1]
    places = range(len(shape)) if len(letters) == len(shape) else long
    if not is_axes(letters) or len(letters) != len(places):
        lengths = ", ".join(str(int(shape[place])) for place in long)
        raise UsageError(
            f"{where}: --axes {given:.40}: found axes {lengths} long, expected {len(long)} letters "
            f"of {', '.join(AXES)}, each once, with z, y and x among them"
        )
    names = dict(zip(places, letters, strict=True))
    return tuple(names.get(place, "_") for place in range(len(shape)))


def settle_stated_axes(
    where: str, shape: Sequence[int], given: str, stated: Sequence[Statement]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the axes of an array and notes about them.

    given   the user's `--axes`; empty: none
    stated  the names of the axes, slowest first, by each field that names them; a field counts
            where all its names are of t, c, z, y and x (see `axis_of`), z, y and x among them

    Without any, three axes longer than 1 are taken for z, y, x; others may have length 1. Raises
    UsageError where `given` doesn't fit, SourceError where the axes can't be told.
    """
    found = f"found {counted(len(shape), 'dimension')} {tuple(int(n) for n in shape)}"
    long = [index for index, size in enumerate(shape) if size > 1]
    if len(shape) < 3 or (len(long) < 3 < len(shape)):
        raise SourceError(
            f"{where}: one plane (2D): a volume needs at least 2 planes: {found}, expected z, y, x"
        )
    if given:
        return given_axes(where, shape, given), ()
    lists = [(one, _axes_by(one, shape)) for one in stated]
    complete = [Statement(axes, one.place, one.trust) for one, axes in lists if _is_complete(axes)]
    if complete:
        settled = settle(_ORDER, complete)
        assert isinstance(settled.value, tuple)
        return tuple(str(axis) for axis in settled.value), settled.notes
    for one, axes in lists:
        if one.trust is not Trust.ASSUMED:
            _require_space(where, axes)
    if len(long) != 3 and len(shape) == 3:
        long = [0, 1, 2]
    if len(long) != 3:
        raise SourceError(
            f"{where}: {found} and no names of axes, expected three, or give them with "
            f"--axes {_example(shape, stated)} (t time, c channel)"
        )
    names = dict(zip(long, "zyx", strict=True))
    assumed = tuple(names.get(place, "_") for place in range(len(shape)))
    reason = "no names of axes"
    unknown = [axes for _, axes in lists if any(axis.strip("_") for axis in axes)]
    if unknown:
        reason = f"the names {', '.join(filter(None, unknown[0])):.100} are no axes of a volume"
    return assumed, (f"{reason}: z, y, x are assumed (else give --axes)",)


def _axes_by(one: Statement, shape: Sequence[int]) -> tuple[str, ...]:
    """Return the axes that a statement names; empty: it names another number of them."""
    names = one.value if isinstance(one.value, tuple) else (one.value,)
    if len(names) != len(shape):
        return ()
    axes = [axis_of(str(name)) for name in names]
    return tuple(
        "_" if axis not in AXES and size == 1 else axis
        for axis, size in zip(axes, shape, strict=True)
    )


def _is_complete(axes: tuple[str, ...]) -> bool:
    return all(len(axis) == 1 for axis in axes) and is_axes("".join(axes).replace("_", ""))


def _require_space(where: str, axes: tuple[str, ...]) -> None:
    """Raise SourceError where the names of axes say that the array is no volume."""
    named = [axis for axis in axes if axis != "_"]
    angle = next((axis for axis in named if axis.rstrip("s").startswith(_ANGLES)), "")
    if angle:
        raise SourceError(
            f"{where}: found axes {', '.join(named)}: {angle:.40} is an angle, so these are "
            "projections; expected the volume that is reconstructed of them"
        )
    if named and set(named) <= set(AXES) and len(set(named)) == len(named):
        asked = "".join("z" if n == ("t" if "t" in named else "c") else n for n in named)
        way = f"; --axes {asked} takes what isn't y, x for slices" if is_axes(asked) else ""
        raise SourceError(
            f"{where}: one plane (2D): a volume needs at least 2 planes: found axes "
            f"{', '.join(named)}, expected z, y, x among them{way}"
        )


def _example(shape: Sequence[int], stated: Sequence[Statement]) -> str:
    """Return axes that the user may give for an array of more than three.

    An assumed order of three axes is that of the last three, as MATLAB's is.
    """
    for one in stated:
        if one.trust is Trust.ASSUMED and isinstance(one.value, tuple):
            return "".join(str(axis) for axis in one.value[-3:]).rjust(len(shape), "c")
    is_last = len(shape) > 3 and shape[-1] < min(shape[-4:-1])
    return ("zyxc" if is_last else "czyx").rjust(len(shape), "t")[-5:]
