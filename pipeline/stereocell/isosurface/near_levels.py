"""List the other levels at which a channel's surface could lie almost as well."""

from collections.abc import Sequence

from stereocell.isosurface.level import Level, clear_of

MAX_NEAR = 3
MARK = "+b"  # suffix of a level above the background, also in flags
ABOVE_BACKGROUND = f" ({MARK}: above the background)"  # explains MARK at the end of a line
# Least confidence, 0..1, at which an unclear level is listed beside an unsure surface. Hardly any
# evidence supports levels below it.
LIKELY = 0.2
_ALIKE = 0.03  # share of the contrast; levels nearer to one another count as one


def find_near_levels(
    levels: Sequence[Level], taken: float | None, *, is_unsure: bool
) -> tuple[Level, ...]:
    """Return the other levels that are clear or nearly clear, outermost first.

    If the surface is unsure, levels with a confidence of at least LIKELY are listed as well.

    levels  all levels that were found, outermost first
    taken   the surface's level; None: there is no surface
    """
    clear = clear_of(levels)
    if taken is None and clear:  # the channel has no surface, although its levels look clear
        return ()
    near = [
        level
        for level in levels
        if level in clear or level.is_nearly_clear or (is_unsure and level.confidence >= LIKELY)
        if taken is None or abs(level.value - taken) > _ALIKE * level.contrast
    ]
    return tuple(near[:MAX_NEAR])


def words_of(levels: Sequence[Level], mark: str = "", digits: int = 5) -> str:
    """Return text for levels and the voxels inside: `402 (7% of the voxels), 1675 (0.9%)`.

    mark    suffix of each value: `+b` if it counts from the background
    digits  significant digits of each value
    """
    first, *others = (
        f"{float(f'{level.value:.{digits}g}'):.5g}{mark} ({_percent(level.share)}"
        for level in levels
    )
    return ", ".join([f"{first} of the voxels)", *(f"{other})" for other in others)])


def _percent(share: float) -> str:
    """Return a share with two digits: `43%`, `0.017%`."""
    return f"{share:.0%}" if share >= 0.1 else f"{100 * share:.2g}%"
