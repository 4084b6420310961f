"""The axes of an array that its format leaves open: given, named by attributes, or assumed."""

from collections.abc import Sequence

from stereocell.model.axes import AXES, axes_of, is_axes
from stereocell.model.errors import SourceError, UsageError
from stereocell.read.series import counted


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


def settle_axes(
    where: str, shape: Sequence[int], given: str, *, named: Sequence[str] = ()
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the axes of an array and notes about them.

    given  the user's `--axes`; empty: none
    named  names from the array's own metadata; they count where all are of t, c, z, y and x

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
    if len(named) == len(shape) and is_axes("".join(named)) and all(len(n) == 1 for n in named):
        return tuple(named), ()
    if len(named) == len(shape) and set(named) <= set(AXES) and len(set(named)) == len(named):
        asked = "".join("z" if n == ("t" if "t" in named else "c") else n for n in named)
        way = f"; --axes {asked} takes what isn't y, x for slices" if is_axes(asked) else ""
        raise SourceError(
            f"{where}: one plane (2D): a volume needs at least 2 planes: found axes "
            f"{', '.join(named)}, expected z, y, x among them{way}"
        )
    if len(long) != 3 and len(shape) == 3:
        long = [0, 1, 2]
    if len(long) != 3:
        is_last = len(shape) > 3 and shape[-1] < min(shape[-4:-1])
        example = ("zyxc" if is_last else "czyx").rjust(len(shape), "t")[-5:]
        raise SourceError(
            f"{where}: {found} and no names of axes, expected three, or give them with "
            f"--axes {example} (t time, c channel)"
        )
    names = dict(zip(long, "zyx", strict=True))
    axes = tuple(names.get(place, "_") for place in range(len(shape)))
    return axes, ("no names of axes: z, y, x are assumed (else give --axes)",)
