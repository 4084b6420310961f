"""The levels beside a channel's own: its surface could lie there instead by a little."""

from collections.abc import Sequence

from stereocell.isosurface.level import Level, clear_of

MAX_NEAR = 3
MARK = "+b"  # stands after a level that counts from the background, as flags have it
ABOVE_BACKGROUND = f" ({MARK}: above the background)"  # explains it, at the end of a line
# Confidence from which a doubtful level is named beside a surface that is unsure. Below, hardly
# anything speaks for it.
LIKELY = 0.2
_ALIKE = 0.03  # share of the contrast: levels nearer to one another are one


def find_near_levels(
    ladder: Sequence[Level], taken: float | None, *, is_unsure: bool
) -> tuple[Level, ...]:
    """Return the levels that are clear too, or fall short of it by a little, outermost first.

    Beside a surface that is unsure the likely ones count as well.

    ladder  all levels that were found, outermost first
    taken   the surface's level; None: there is no surface
    """
    clear = clear_of(ladder)
    if taken is None and clear:  # the channel holds nothing, however clear its levels look
        return ()
    near = [
        level
        for level in ladder
        if level in clear or level.is_nearly_clear or (is_unsure and level.confidence >= LIKELY)
        if taken is None or abs(level.value - taken) > _ALIKE * level.contrast
    ]
    return tuple(near[:MAX_NEAR])


def words_of(levels: Sequence[Level], mark: str = "", digits: int = 5) -> str:
    """Return levels with the share of the voxels inside: `402 (7% of the voxels), 1675 (0.9%)`.

    mark    stands after each value: `+b` where it counts from the background
    digits  of each value
    """
    first, *others = (
        f"{float(f'{level.value:.{digits}g}'):.5g}{mark} ({_percent(level.share)}"
        for level in levels
    )
    return ", ".join([f"{first} of the voxels)", *(f"{other})" for other in others)])


def _percent(share: float) -> str:
    """Return a share with two digits: `43%`, `0.017%`."""
    return f"{share:.0%}" if share >= 0.1 else f"{100 * share:.2g}%"
