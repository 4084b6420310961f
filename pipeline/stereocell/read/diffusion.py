"""Diffusion images stored in one array of NRRD or NIfTI: several b-values and directions.

They count as time points, as those of DICOM do. The images without diffusion weighting (b 0) show
anatomy best, so they come first.
"""

from collections.abc import Sequence
from itertools import groupby

from stereocell.model.counted import agreeing, counted

# relative difference up to which two b-values count as one: scanners state the value reached
_NEAR = 0.05
_UNWEIGHTED = 10.0  # s/mm2; smaller b-values count as 0, because scanners state 5 for 0
_MOST_RANGES = 4  # most ranges of time points that a note lists for one b-value


def order_of(b_values: Sequence[float]) -> list[int]:
    """Return the order of the images: as stored if the first one has b 0, else by b-value."""
    stored = list(range(len(b_values)))
    if not b_values or b_values[0] <= _UNWEIGHTED:
        return stored
    return sorted(stored, key=lambda index: b_values[index])


def diffusion_note(b_values: Sequence[float], place: str) -> str:
    """Return a note that lists the images by their b-values.

    b_values  s/mm2, in the order of the file
    place     the field or file that states them
    """
    order = order_of(b_values)
    in_order = [b_values[index] for index in order]
    levels = _levels(in_order)
    listed = ", ".join(_described(level, in_order, levels) for level in sorted(set(levels)))
    moved = "" if order == sorted(order) else ", in the order of b-values and not of the file"
    return (
        f"{counted(len(b_values), 'image')} at a place "
        f"{agreeing(len(b_values), 'is', 'are')} of diffusion ({place}) and count as points in "
        f"time{moved}; --time picks one: {listed}"
    )


def _levels(b_values: Sequence[float]) -> list[float]:
    """Return for each image the lowest b-value that counts as the same as its own."""
    lowest: list[float] = []
    for value in sorted(b_values):
        is_same = bool(lowest) and (
            value <= _UNWEIGHTED or value - lowest[-1] <= _NEAR * max(value, 1.0)
        )
        if not is_same:
            lowest.append(0.0 if value <= _UNWEIGHTED else value)
    return [max(low for low in lowest if low <= value) for value in b_values]


def _described(level: float, b_values: Sequence[float], levels: Sequence[float]) -> str:
    places = [index for index, own in enumerate(levels) if own == level]
    ranges = []
    for _, run in groupby(enumerate(places), key=lambda pair: pair[1] - pair[0]):
        indices = [place for _, place in run]
        ranges.append(f"{indices[0]}" + (f" to {indices[-1]}" if len(indices) > 1 else ""))
    more = ", ..." if len(ranges) > _MOST_RANGES else ""
    directions = f" in {len(places)} directions" if level and len(places) > 1 else ""
    shown = round(level) if level else 0
    return f"b {shown} s/mm2{directions} at {', '.join(ranges[:_MOST_RANGES])}{more}"
