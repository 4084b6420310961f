"""Neighbouring tiles' iso-values, drawn together as far as their own evidence allows.

The summit of a criterion's curve is broad: many levels are nearly as good as the best, and which of
them wins is chance. Where a neighbour's value lies on the summit too, there is no evidence for a
jump, and a jump would show as a step in the surface. A value never leaves its own summit.
"""

from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

import numpy as np

from stereocell.tiling import Box, Tile

SUMMIT = 0.99  # of the best score: levels that are as good; .95 cost a lone ball 11 % of volume


def agree(tiles: Sequence[Tile], found: Mapping[str, Mapping[str, Any]]) -> dict[str, float | None]:
    """Return each tile's value, drawn half-way to the median of those that share a face with it.

    found  by tile id: `value` (None: the tile has none), and `levels` and `score` where it has
    """
    values = {tile.id: found[tile.id]["value"] for tile in tiles}
    drawn = dict(values)
    for tile in tiles:
        value = values[tile.id]
        beside = [
            values[other.id]
            for other in tiles
            if values[other.id] is not None and _share_a_face(tile.box, other.box)
        ]
        if value is not None and beside:
            low, high = _summit(value, found[tile.id])
            # half the way: going all of it, two neighbours would only change places
            drawn[tile.id] = min(max((value + median(beside)) / 2, low), high)
    return drawn


def _summit(value: float, found: Mapping[str, Any]) -> tuple[float, float]:
    """Return the range of levels about the value that score nearly as well as the best."""
    levels, score = np.asarray(found["levels"]), np.asarray(found["score"])
    best = int(score.argmax())
    worse = np.flatnonzero(score < SUMMIT * score[best])
    end = int(np.searchsorted(worse, best))
    first = int(worse[end - 1]) + 1 if end else 0
    last = int(worse[end]) - 1 if end < len(worse) else len(levels) - 1
    return min(value, float(levels[first])), max(value, float(levels[last]))


def _share_a_face(a: Box, b: Box) -> bool:
    touching = 0
    for low, high, other_low, other_high in zip(a.start, a.stop, b.start, b.stop, strict=True):
        if high == other_low or other_high == low:
            touching += 1
        elif high < other_low or other_high < low:
            return False
    return touching == 1
