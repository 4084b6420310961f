"""The results of the survey for each channel: its window, level, repair and appearance.

pydantic turns the dataclasses into plain values and back, as survey.json holds them.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from pydantic import TypeAdapter

from stereocell.isosurface.holder import Holder
from stereocell.isosurface.level import Level
from stereocell.isosurface.near_levels import ABOVE_BACKGROUND, MARK, find_near_levels, words_of
from stereocell.isosurface.repair import RepairOptions
from stereocell.model.channel import Appearance
from stereocell.planning.plan import Plan
from stereocell.transfer.channel_statistics import ChannelStatistics

# Least share of the voxels above the level in a body that opens cut. Two trees of vessels had 1 and
# 1.7 percent, three heads and a brain 19 to 38.
BODY_SHARE = 0.05


@dataclass(frozen=True, slots=True)
class TileIso:
    """One tile's part of its channel's level.

    value       above the background, voxel values; None: the channel has none
    background  mean over the tile, voxel values; 0: none is subtracted
    confidence  0..1, of the tile by itself; None: nothing is there, or nobody asked
    files       the tile's own results, relative to OUT, by what they hold
    """

    value: float | None
    background: float
    confidence: float | None
    files: dict[str, str]


@dataclass(frozen=True, slots=True)
class Curve:
    """A channel's histogram for a chart: voxel values, and heights up to 1."""

    values: tuple[float, ...]
    heights: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ChannelSurvey:
    """The first passes' results for one channel.

    statistics_file  the file of the window, relative to OUT
    iso              by tile ID
    ladder           all levels that were found, outermost first; empty where one was given
    curve            what they were found on; None where one was given
    holder           a CT's table or head holder, which is left out; None: there is none
    grid_um          how far apart the planes lie that carry its surface; 0: all do
    most_faces       most voxel faces of its surface in a tile, before planes are left out
    thin_share       of its voxels above the level, those too thin for planes surface.grid_um apart
    """

    statistics: ChannelStatistics
    statistics_file: str
    iso: dict[str, TileIso]
    repair: RepairOptions
    appearance: Appearance
    ladder: tuple[Level, ...]
    curve: Curve | None
    holder: Holder | None = None
    grid_um: float = 0.0
    most_faces: int = 0
    thin_share: float = 0.0

    @property
    def is_body(self) -> bool:
        """Whether the surface encloses so much that a cut through the middle shows an inside."""
        return is_body(self.appearance, self.statistics)

    @property
    def near_levels(self) -> str:
        """The levels beside the surface's own that are clear or nearly so, as text; empty: none."""
        level, surface = self.appearance.level, self.appearance.surface
        near = find_near_levels(
            self.ladder, None if level is None else level.iso, is_unsure=surface == "unsure"
        )
        if not near or self.statistics.background is None:
            return words_of(near) if near else ""
        return words_of(near, MARK) + ABOVE_BACKGROUND

    def thinning(self, plan: Plan) -> str:
        """Return what is said of a surface that other planes carry than asked for; empty: none."""
        surface = plan.settings.surface
        if self.grid_um == surface.grid_um:
            return ""
        z, y, x = plan.with_grid(self.grid_um).step
        if (z, y, x) == (1, 1, 1):
            return (
                f"{self.thin_share:.0%} of its voxels above the level lie in structures too thin "
                f"for planes {surface.grid_um:g} um apart (surface.grid_um), more than "
                f"{surface.max_thin:.0%} (surface.max_thin): all planes carry its surface"
            )
        return (
            f"up to {self.most_faces:,} voxel faces of its surface lie in a tile, more than "
            f"{plan.settings.surface.max_faces:,} (surface.max_faces): of the planes along z, y, x "
            f"one in {z}, {y}, {x} carries it"
        )


def is_body(appearance: Appearance, statistics: ChannelStatistics) -> bool:
    """Return whether a surface encloses so much that a cut through the middle shows an inside."""
    level = appearance.iso_normalized
    if level is None:
        return True
    counts = np.asarray(statistics.histogram)
    above = int(counts[int(level * len(counts)) :].sum())
    return above >= BODY_SHARE * int(counts.sum())


Survey = dict[str, ChannelSurvey]  # by channel ID


@cache
def surveys() -> TypeAdapter[Survey]:
    """Return the converter between surveys and the values of survey.json."""
    return TypeAdapter(Survey)
