"""Reconcile the iso-values of a channel's tiles: the confidence and the final value of each tile.

The plateau of a criterion's curve is broad: many levels are nearly as good as the best, and chance
picks one. Where a neighbour's value lies on the plateau too, nothing speaks for a discontinuity,
which would show as a step in the surface. A value never leaves its own plateau.

A discontinuity lowers weak evidence: confidence = evidence ^ (1 + discontinuity / 4). The
discontinuity, 0 to 1, is the distance to the median of the neighbours that are confident by
themselves, divided by the larger of the two heights above the background. Strong evidence stays (.9
beside a neighbour eight times as bright becomes .88). A larger weight would do harm: a dark part of
a real brain, whose cells are outlined well at .44 of its neighbour's value, has .49, and keeps .44.

A channel is clear if the mean of its tiles' confidences, weighted by the strength of their edges,
reaches `isovalue.min_confidence`: tiles in which a stain is absent have hardly any edges steeper
than noise and don't count against it. In a clear channel, a tile below the bound takes the mean of
the others. In an unclear channel each tile keeps its own value.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np

from stereocell.model.channel import SurfaceConfidence
from stereocell.model.tiling import Box, Tile

PLATEAU = 0.99  # share of the best score that is as good; .95 cost a lone ball 11 % of volume
DISCONTINUITY_WEIGHT = 0.25  # growth of the evidence's exponent at a discontinuity of 1
Neighbours = Mapping[str, Sequence[str]]


@dataclass(frozen=True, slots=True)
class Reconciled:
    """One channel's iso-values.

    values              voxel values by tile id; None: the tile takes the mean of the others
    confidences         by tile id, 0..1
    confidence          of the channel, 0..1
    surface_confidence  whether its surface is clear
    """

    values: dict[str, float | None]
    confidences: dict[str, float]
    confidence: float
    surface_confidence: SurfaceConfidence


def reconcile_iso_values(
    neighbours: Neighbours, found: Mapping[str, Mapping[str, Any]], min_confidence: float
) -> Reconciled:
    """Return iso-values on which the tiles agree.

    neighbours      by tile id, as `find_neighbours` returns them
    found           by tile id: `value` (voxel values; None: the tile has none); with a value also
                    `confidence` by its own evidence, `strength`, `levels` and `score` (bins,)
    min_confidence  bound of a clear surface, 0..1
    """
    values = {tile: found[tile]["value"] for tile in neighbours}
    evidence = {
        tile: 0.0 if value is None else found[tile]["confidence"] for tile, value in values.items()
    }
    sure = {tile for tile in neighbours if evidence[tile] >= min_confidence}
    confidences = {}
    for tile, beside in neighbours.items():
        others = [values[other] for other in beside if other in sure]
        away = 0.0
        if values[tile] is not None and others:
            away = _discontinuity(values[tile], median(others))
        confidences[tile] = evidence[tile] ** (1 + DISCONTINUITY_WEIGHT * away)
    known = [tile for tile, value in values.items() if value is not None]
    if not known:
        return Reconciled(values, confidences, 0.0, "none")
    weights = [found[tile]["strength"] for tile in known]
    confidence = float(
        np.average([confidences[tile] for tile in known], weights=weights if any(weights) else None)
    )
    surface_confidence: SurfaceConfidence = "clear" if confidence >= min_confidence else "unclear"
    if surface_confidence == "clear":
        values = {
            tile: value if confidences[tile] >= min_confidence else None
            for tile, value in values.items()
        }
    return Reconciled(
        _pulled_towards(neighbours, values, found), confidences, confidence, surface_confidence
    )


def find_neighbours(tiles: Sequence[Tile]) -> dict[str, list[str]]:
    """Return the ids of the tiles that share a face with each tile, by tile id."""
    starting = defaultdict(list)
    for tile in tiles:
        for axis in range(3):
            starting[axis, tile.box.start[axis]].append(tile)
    found: dict[str, list[str]] = {tile.id: [] for tile in tiles}
    for tile in tiles:
        for axis in range(3):
            for other in starting[axis, tile.box.stop[axis]]:
                if _overlap(tile.box, other.box, axis):
                    found[tile.id].append(other.id)
                    found[other.id].append(tile.id)
    return found


def _overlap(a: Box, b: Box, axis: int) -> bool:
    """Return whether two boxes overlap along both other axes."""
    ends = zip(a.start, a.stop, b.start, b.stop, strict=True)
    return all(
        i == axis or (low < other_high and other_low < high)
        for i, (low, high, other_low, other_high) in enumerate(ends)
    )


def _discontinuity(value: float, others: float) -> float:
    height = max(abs(value), abs(others))
    return min(1.0, abs(value - others) / height) if height > 0 else 0.0


def _pulled_towards(
    neighbours: Neighbours,
    values: Mapping[str, float | None],
    found: Mapping[str, Mapping[str, Any]],
) -> dict[str, float | None]:
    """Return each tile's value, pulled half-way to the median of its neighbours' values."""
    pulled = dict(values)
    for tile, value in values.items():
        beside = [v for other in neighbours[tile] if (v := values[other]) is not None]
        if value is not None and beside:
            low, high = _plateau(value, found[tile])
            # half the way: with all of it two neighbours would only swap values
            pulled[tile] = min(max((value + median(beside)) / 2, low), high)
    return pulled


def _plateau(value: float, found: Mapping[str, Any]) -> tuple[float, float]:
    """Return the range of levels around the value that score nearly as well as the best."""
    levels, score = np.asarray(found["levels"]), np.asarray(found["score"])
    best = int(score.argmax())
    worse = np.flatnonzero(score < PLATEAU * score[best])
    end = int(np.searchsorted(worse, best))
    first = int(worse[end - 1]) + 1 if end else 0
    last = int(worse[end]) - 1 if end < len(worse) else len(levels) - 1
    return min(value, float(levels[first])), max(value, float(levels[last]))
