"""Find the iso-level of vessels: the lowest that still adds branches, and no tissue or noise.

A level half-way between blood and tissue is right for a wide vessel. A vessel as thin as a voxel
has only a fraction of that brightness, so this level cuts a tree into its trunk and fragments.
Lower levels keep the thin branches, but also make vessels thicker.

Distance distinguishes new branches from thicker walls: a branch reaches farther from the vessels
of the level before. The measure is the share of voxels that are connected to these vessels and lie
more than REACH voxels away from them. The lowest level that adds LEAST_NEW is taken. Steps in
between may add nothing, because a dim branch may be connected by one thin place.

Only the main connected components are measured, since pieces apart from them are noise or tissue.
The search ends when main components appear apart from all vessels, because these are tissue.

In a CT angiogram of a head (`cta_head` of the corpus) steps down to 45 add .2 to 1.3 % each, and
the next one adds .07 %. An aorta (`mra_aorta`) gains a branch of 1.1 % at 841; the steps below add
nothing until tissue appears at 592. A synthetic tree in noise of 20 gains 1.9 % at 214, and at most
.06 % below that.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from stereocell.isosurface.channel_level import ChannelLevels
from stereocell.isosurface.level import Level

MOST_INSIDE = 0.15  # largest share of all voxels inside vessels; a level with more shows tissue
# Heights above the outside, as shares of the first level's height. Branches as thin as a voxel have
# a quarter of a trunk's brightness.
STEPS = (1.0, 0.85, 0.7, 0.6, 0.5, 0.42, 0.35, 0.3)
ABOVE_NOISE = 4.0  # sigmas of the noise; least height of a level above the outside
LEAST_NEW = 0.002  # share of the main components' voxels; smaller new branches are noise
MOST_APART = 0.02  # share of the main components' voxels; more apart from vessels are tissue
# Ratio of the voxels inside to those at the step before. Steps on the flank of a vessel add at most
# half as many voxels; noise and tissue multiply them.
MOST_GROWTH = 1.6
_SUMMED = ("voxels", "main_voxels", "new_voxels", "apart_voxels")  # fields of ComponentSums


def find_vessel_levels(levels: ChannelLevels) -> tuple[Level, ...]:
    """Return the levels that may show vessels, the highest first; none without a clear level.

    The first is the outermost clear level with at most MOST_INSIDE of the voxels inside.
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
    """Return the index of the lowest level that adds branches, but no tissue or noise.

    of_levels  the ComponentSums of each tile, for each level, the highest level first
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
