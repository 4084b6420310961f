"""The results of the survey for each channel: its window, iso-level, repair and appearance.

pydantic turns the dataclasses into plain values and back, as survey.json holds them.
"""

from dataclasses import dataclass
from functools import cache
from typing import Annotated

import numpy as np
from pydantic import AliasChoices, Field, TypeAdapter

from stereocell.isosurface.holder import Holder
from stereocell.isosurface.level import Level
from stereocell.isosurface.near_levels import ABOVE_BACKGROUND, MARK, find_near_levels, words_of
from stereocell.isosurface.repair_options import RepairOptions
from stereocell.model.channel import Appearance
from stereocell.planning.plan import Plan
from stereocell.transfer.channel_statistics import ChannelStatistics

# Least share of a body's voxels above its level, 0..1. In two trees of vessels it was .01 and .017,
# in three heads and a brain .19 to .38.
BODY_SHARE = 0.05
_LEVELS = Field(validation_alias=AliasChoices("levels", "ladder"))  # surveys of earlier versions


@dataclass(frozen=True, slots=True)
class TileIso:
    """The iso-level of a channel in one tile.

    value       level above the background, in voxel values; None: the channel has no surface
    background  mean over the tile, voxel values; 0: none is subtracted
    confidence  confidence of this tile alone, 0..1; None: it has too few voxels, or was not judged
    files       files of the tile's results, relative to OUT, by kind of result
    """

    value: float | None
    background: float
    confidence: float | None
    files: dict[str, str]


@dataclass(frozen=True, slots=True)
class Curve:
    """A channel's histogram for a chart: voxel values, and heights in 0..1."""

    values: tuple[float, ...]
    heights: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ChannelSurvey:
    """The results of the survey for one channel.

    statistics_file  file of the window, relative to OUT
    iso              level in each tile, by tile ID
    levels           all levels that were found, outermost first; empty if the level was given
    curve            the histogram in which they were found; None if the level was given
    holder           a CT's table or head holder, which is left out; None: there is none
    grid_um          um between the planes from which the surface is extracted; 0: all planes
    most_faces       most voxel faces of the surface in one tile, before planes are left out
    thin_share       share of the voxels above the level that lie in structures too thin for planes
                     surface.grid_um apart
    """

    statistics: ChannelStatistics
    statistics_file: str
    iso: dict[str, TileIso]
    repair: RepairOptions
    appearance: Appearance
    levels: Annotated[tuple[Level, ...], _LEVELS]
    curve: Curve | None
    holder: Holder | None = None
    grid_um: float = 0.0
    most_faces: int = 0
    thin_share: float = 0.0

    @property
    def is_body(self) -> bool:
        """Whether the surface encloses so much that a cut through its middle shows the inside."""
        return is_body(self.appearance, self.statistics)

    @property
    def near_levels(self) -> str:
        """The other levels that are clear or nearly clear, as text; empty: there are none."""
        level, surface = self.appearance.level, self.appearance.surface
        near = find_near_levels(
            self.levels, None if level is None else level.iso, is_unsure=surface == "unsure"
        )
        if not near or self.statistics.background is None:
            return words_of(near) if near else ""
        return words_of(near, MARK) + ABOVE_BACKGROUND

    def thinning(self, plan: Plan) -> str:
        """Return the note on a surface whose planes differ from surface.grid_um; empty: none do."""
        surface = plan.settings.surface
        if self.grid_um == surface.grid_um:
            return ""
        z, y, x = plan.with_grid(self.grid_um).step
        if (z, y, x) == (1, 1, 1):
            return (
                f"{self.thin_share:.0%} of its voxels above the iso-value lie in structures too "
                f"thin for planes {surface.grid_um:g} um apart (surface.grid_um), more than "
                f"{surface.max_thin:.0%} (surface.max_thin): all planes carry its surface"
            )
        return (
            f"up to {self.most_faces:,} voxel faces of its surface lie in a tile, more than "
            f"{plan.settings.surface.max_faces:,} (surface.max_faces): one plane in {z}, {y}, {x} "
            "along z, y, x carries its surface"
        )


def is_body(appearance: Appearance, statistics: ChannelStatistics) -> bool:
    """Return whether a surface encloses so much that a cut through its middle shows the inside."""
    level = appearance.iso_normalized
    if level is None:
        return True
    counts = np.asarray(statistics.histogram)
    above = int(counts[int(level * len(counts)) :].sum())
    return above >= BODY_SHARE * int(counts.sum())


Survey = dict[str, ChannelSurvey]  # the survey of each channel, by channel ID


@cache
def surveys() -> TypeAdapter[Survey]:
    """Return the converter between surveys and the values of survey.json."""
    return TypeAdapter(Survey)
