"""The level of vessels: the lowest that still adds branches, and no tissue or noise.

Half-way between blood and tissue is right for a wide vessel. A vessel as thin as a voxel reaches a
fraction of the brightness, so half-way cuts a tree into its trunk and fragments. Lower levels keep
the thin branches. A lower level is worth it where it adds branches, and does not only make vessels
thicker: a branch reaches farther from the vessels at the level before than a thicker wall does. So
the measure is the share of voxels that lie more than REACH voxels beyond them and hang on them. The
lowest level that adds LEAST_NEW is taken, also after steps that add nothing: dim branches may hang
on others by one thin place. Only the main components are measured: pieces that hang on none of them
are noise or tissue. Main components that come up apart from all vessels are tissue, and end it.

On a CT angiogram of a head (`cta_head` of the corpus) steps down to 45 add .2 to 1.3 % each, and
the next one adds .07 %. An aorta (`mra_aorta`) gains a branch at 841, 1.1 %; the steps below add
nothing until tissue comes up at 592. A made tree in noise of 20 gains 1.9 % at 214, and .06 % at
most below that.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from stereocell.isosurface.channel_level import ChannelLevels
from stereocell.isosurface.level import Level

MOST_INSIDE = 0.15  # share of all voxels: vessels with more than this inside are tissue
# Heights above the outside, as shares of the first level's. Branches as thin as a voxel have a
# quarter of a trunk's brightness.
STEPS = (1.0, 0.85, 0.7, 0.6, 0.5, 0.42, 0.35, 0.3)
ABOVE_NOISE = 4.0  # sigmas of the noise above the outside at the least
LEAST_NEW = 0.002  # share of the main components' voxels in new branches; less is noise
MOST_APART = 0.02  # share of them in components that hang on no vessel: tissue comes up
# Voxels inside over those a step before. The steps on the flank of a vessel add up to half as many;
# noise and tissue that join multiply them.
MOST_GROWTH = 1.6
_SUMMED = ("voxels", "main_voxels", "new_voxels", "apart_voxels")  # fields of ComponentSums


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
    """Return the index of the lowest level that adds branches, and no tissue or noise.

    of_levels  the ComponentSums of each tile at each level, the highest level first
    """
    sums = [
        {key: sum(tile[key] for tile in tiles.values()) for key in _SUMMED} for tiles in of_levels
    ]
    chosen = 0
    for place in range(1, len(sums)):
        before, now = sums[place - 1], sums[place]
        main = max(1, now["main_voxels"])
        if (
            now["voxels"] > MOST_GROWTH * before["voxels"]
            or now["apart_voxels"] > MOST_APART * main
        ):
            break
        if now["new_voxels"] >= LEAST_NEW * main:
            chosen = place
    return chosen
