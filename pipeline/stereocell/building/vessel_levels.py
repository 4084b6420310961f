"""The level of vessels: the lowest that still adds branches, and no tissue or noise.

Half-way between blood and tissue is right for a wide vessel. A vessel as thin as a voxel reaches a
fraction of the brightness, so half-way cuts a tree into its trunk and fragments. Lower levels keep
the thin branches. A lower level is worth it where the vessels get longer, and not only thicker: a
tube of radius r and length l has a surface s of 2 pi r l and a volume v of pi r^2 l, so that its
length is s^2 / (4 pi v), whatever its radius. Only the main components are measured: pieces that
hang on none of them are noise or tissue, and a rough thickening makes many of these.

On a CT angiogram of a head (`cta_head` of the corpus) that estimate grows by 1.35 from a level of
128 to 64, and the voxels of a skeleton by 1.45. An aorta (`mra_aorta`) gains a branch from 929 to
841; below, it thickens and gains 3 % a step at most. LEAST_GAIN lies just above these 3 %.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from stereocell.isosurface.channel_level import ChannelLevels
from stereocell.isosurface.level import Level

MOST_INSIDE = 0.15  # share of all voxels: vessels with more than this inside are tissue
# Heights above the outside, as shares of the first level's. Half of that is a quarter of the
# trunk's brightness; lower levels follow the trunk's own blur.
STEPS = (1.0, 0.85, 0.7, 0.6, 0.5)
ABOVE_NOISE = 4.0  # sigmas of the noise above the outside at the least
LEAST_GAIN = 1.035  # length over that a step before: smaller gains are a thicker, rougher surface
# Voxels inside over those a step before. The steps on the flank of a vessel add up to half as many;
# noise and tissue that join multiply them.
MOST_GROWTH = 1.6
_SUMMED = ("voxels", "main_voxels", "main_faces")  # fields of ComponentSums


def find_vessel_levels(levels: ChannelLevels) -> tuple[Level, ...]:
    """Return the levels that vessels may lie at, the highest first; none without a clear level.

    The first is the outermost clear level that is not tissue by its share of the voxels.
    """
    narrow = [level for level in levels.clear if level.share <= MOST_INSIDE]
    if not narrow:
        return levels.clear[-1:]
    first = narrow[0]
    least = first.outside + ABOVE_NOISE * levels.noise
    height = first.value - first.outside
    lower = [first.outside + share * height for share in STEPS[1:]]
    judged = [levels.judge(value) for value in lower if value >= least]
    return (first, *(level for level in judged if level.share <= MOST_INSIDE))


def choose_connected(of_levels: Sequence[Mapping[str, Mapping[str, Any]]]) -> int:
    """Return the index of the lowest level that adds length, and no tissue or noise.

    of_levels  the ComponentSums of each tile at each level, the highest level first
    """
    sums = [
        {key: sum(tile[key] for tile in tiles.values()) for key in _SUMMED} for tiles in of_levels
    ]
    chosen = 0
    for place in range(1, len(sums)):
        before, now = sums[place - 1], sums[place]
        if now["voxels"] > MOST_GROWTH * before["voxels"]:
            break
        if _length(now) < LEAST_GAIN * _length(before):
            break
        chosen = place
    return chosen


def _length(sums: Mapping[str, int]) -> float:
    """Return the length of tubes with so many triangles and voxels, in an arbitrary unit."""
    return float(sums["main_faces"]) ** 2 / max(1, sums["main_voxels"])
