"""Axes of an array whose format leaves them open: given by the user, named or assumed."""

from collections.abc import Sequence

from stereocell.model.axes import AXES, axes_of, is_axes
from stereocell.model.counted import counted
from stereocell.model.errors import SourceError, UsageError
from stereocell.read.axis_names import axes_of_names
from stereocell.read.statements import Statement, Subject, Trust, settle

_ORDER = Subject("order of the axes", remedy="--axes names another one")
_ANGLES = ("theta", "angle", "tilt", "projection", "rotation")


def given_axes(where: str, shape: Sequence[int], given: str) -> tuple[str, ...]:
    """Return the axes of an array from `--axes`: a letter for each, `_` for axes without one.

    given  letters of all axes, or of the axes longer than 1, slowest first, such as `zcyx`

    Raises UsageError where the letters don't fit the shape.
    """
    letters = axes_of(given)
    long = [place for place, size in enumerate(shape) if size > 1]
    places = range(len(shape)) if len(letters) == len(shape) else long
    if not is_axes(letters) or len(letters) != len(places):
        lengths = ", ".join(str(int(shape[place])) for place in long)
        raise UsageError(
            f"{where}: --axes {given:.40}: found axes of length {lengths}, expected {len(long)} "
            f"letters of {', '.join(AXES)}, each at most once, with z, y and x among them"
        )
    names = dict(zip(places, letters, strict=True))
    return tuple(names.get(place, "_") for place in range(len(shape)))


def settle_stated_axes(
    where: str, shape: Sequence[int], given: str, stated: Sequence[Statement]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the axes of an array, and notes on them.

    given   the user's `--axes`; empty: none
    stated  for each field that names the axes, the names, slowest first. A field decides if all
            its names mean t, c, z, y or x (see read/axis_names.py), with z, y and x among them

    If no field decides, names that mean axes count, and the other axes are assumed to be z, y, x
    in this order. Axes of length 1 may have no name. Raises UsageError where `given` doesn't fit,
    SourceError where the axes can't be determined.
    """
    found = f"found {counted(len(shape), 'dimension')} {tuple(int(n) for n in shape)}"
    long = sum(size > 1 for size in shape)
    if len(shape) < 3 or (long < 3 < len(shape)):
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
    named, best = max(
        lists, key=lambda pair: (_count(pair[1]), bool(_quoted(pair[0]))), default=(None, ())
    )
    axes = with_assumed(best or ("",) * len(shape), shape)
    if not axes:
        names = f"the names {_quoted(named)}" if named and _count(best) else "no names of axes"
        raise SourceError(
            f"{where}: {found} and {names}, expected three, or give them with "
            f"--axes {_example(shape, stated)} (t time, c channel)"
        )
    return axes, (_assumption(axes, best, named),)


def with_assumed(axes: Sequence[str], shape: Sequence[int]) -> tuple[str, ...]:
    """Return the axes, with z, y and x in this order where no name means an axis.

    axes   t, c, z, y or x for each dimension, slowest first; any other text names no axis

    Empty: the number of unnamed dimensions differs from the number of axes that are missing.
    """
    known = [axis for axis in axes if axis in tuple(AXES)]
    missing = [axis for axis in "zyx" if axis not in known]
    unknown = [place for place, axis in enumerate(axes) if axis not in tuple(AXES)]
    long = [place for place in unknown if shape[place] > 1]
    places = long if len(long) == len(missing) else unknown
    if len(places) != len(missing) or len(set(known)) != len(known):
        return ()
    assumed = dict(zip(places, missing, strict=True))
    return tuple(
        assumed.get(place, axis if axis in tuple(AXES) else "_") for place, axis in enumerate(axes)
    )


def _count(axes: Sequence[str]) -> int:
    """Return the number of dimensions whose name means t, c, z, y or x."""
    return sum(axis in tuple(AXES) for axis in axes)


def _quoted(named: Statement) -> str:
    names = named.value if isinstance(named.value, tuple) else (named.value,)
    return ", ".join(str(name) for name in names if str(name).strip())[:100]


def _assumption(axes: Sequence[str], by_names: Sequence[str], named: Statement | None) -> str:
    """Return the note on axes that are assumed, in part or all."""
    if named is None or not _quoted(named):
        return "the axes have no names: z, y, x are assumed (else give --axes)"
    if not _count(by_names):
        reason = f"the names {_quoted(named)} are no axes of a volume"
        return f"{reason}: z, y, x are assumed (else give --axes)"
    guessed = [
        axis for axis, own in zip(axes, by_names, strict=True) if axis != own and axis != "_"
    ]
    return (
        f"{named.place}: the names {_quoted(named)} are not all axes of a volume: "
        f"{', '.join(guessed)} {'is' if len(guessed) == 1 else 'are'} assumed for the others, in "
        "this order (else give --axes)"
    )


def _axes_by(one: Statement, shape: Sequence[int]) -> tuple[str, ...]:
    """Return the axes that a statement names; empty: it has the wrong number of names."""
    names = one.value if isinstance(one.value, tuple) else (one.value,)
    if len(names) != len(shape):
        return ()
    axes = axes_of_names([str(name) for name in names])
    return tuple(
        "_" if axis not in tuple(AXES) and size == 1 else axis
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
            "projections, expected the volume that was reconstructed from them"
        )
    if named and set(named) <= set(AXES) and len(set(named)) == len(named):
        asked = "".join("z" if n == ("t" if "t" in named else "c") else n for n in named)
        way = f"; --axes {asked} reads the axis beside y, x as slices" if is_axes(asked) else ""
        raise SourceError(
            f"{where}: one plane (2D): a volume needs at least 2 planes: found axes "
            f"{', '.join(named)}, expected z, y, x among them{way}"
        )


def _example(shape: Sequence[int], stated: Sequence[Statement]) -> str:
    """Return an example of `--axes` for an array of more than three dimensions.

    An assumed order of three axes applies to the last three dimensions, as in MATLAB.
    """
    for one in stated:
        if one.trust is Trust.ASSUMED and isinstance(one.value, tuple):
            return "".join(str(axis) for axis in one.value[-3:]).rjust(len(shape), "c")
    is_last = len(shape) > 3 and shape[-1] < min(shape[-4:-1])
    return ("zyxc" if is_last else "czyx").rjust(len(shape), "t")[-5:]
