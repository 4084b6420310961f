"""The axes of an array whose format does not name them: given, named by attributes, or assumed."""

from collections.abc import Sequence

from stereocell.model.axes import AXES, is_axes
from stereocell.model.errors import SourceError, UsageError


def settle_axes(
    where: str, shape: Sequence[int], given: str, named: Sequence[str] = ()
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the axes of an array and notes about them.

    given  the user's `--axes`; empty: none
    named  names from the array's own metadata; they count where all are of t, c, z, y and x

    Without any, three axes longer than 1 are taken for z, y, x; others may have length 1. Raises
    UsageError where `given` doesn't fit, SourceError where the axes can't be told.
    """
    found = f"found {len(shape)} dimensions {tuple(int(n) for n in shape)}"
    if len(shape) < 3:
        raise SourceError(f"{where}: a volume needs at least 2 planes: {found}, expected z, y, x")
    if given:
        if not is_axes(given) or len(given) != len(shape):
            raise UsageError(
                f"{where}: --axes {given}: {found}, expected a letter of {AXES} for each, "
                "z, y and x among them"
            )
        return tuple(given), ()
    if len(named) == len(shape) and is_axes("".join(named)) and all(len(n) == 1 for n in named):
        return tuple(named), ()
    long = [index for index, size in enumerate(shape) if size > 1]
    if len(long) != 3 and len(shape) == 3:
        long = [0, 1, 2]
    if len(long) != 3:
        is_last = len(shape) > 3 and shape[-1] < min(shape[-4:-1])
        example = ("zyxc" if is_last else "czyx").rjust(len(shape), "t")[-5:]
        raise SourceError(
            f"{where}: {found} and no names of axes, expected three, or give them with "
            f"--axes {example} (t time, c channel)"
        )
    axes = [f"single{index}" for index in range(len(shape))]
    for index, name in zip(long, "zyx", strict=True):
        axes[index] = name
    return tuple(axes), ("no names of axes: z, y, x are assumed (else give --axes)",)
