"""The report's numbers of baked maps: texels, charts, levels without maps, similarity."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from stereocell.report.facts import Facts, UnitFacts
from stereocell.report.select_units import thin_out
from stereocell.report.texture_similarity import find_close_likeness, find_likeness
from stereocell.steps.unit_files import load_lods, load_record

MAX_COMPARED = 3  # largest number of units that are drawn and compared; each takes 2 to 10 s
COMPARED = 2  # level of detail that is compared with lod0; the coarsest where there are fewer


@dataclass(frozen=True, slots=True)
class LevelMaps:
    """The maps of one channel at one level of detail.

    tiles     number of tiles with maps
    texel_um  smallest and largest edge of a texel over the tiles
    without   number of tiles without maps, by reason; there the vertices hold the occlusion and the
              sampled channel
    """

    level: int
    tiles: int
    texel_um: tuple[float, float]
    texels: int
    charts: int
    painted: bool
    without: dict[str, int]


@dataclass(frozen=True, slots=True)
class Likeness:
    """The similarity of a level of detail to lod0, as SSIM, -1..1, of pictures of both.

    views  one value for each direction in `texture_similarity.VIEWS`
    close  value of one close picture from the front
    """

    unit: str
    level: int
    views: tuple[float, ...]
    close: float

    @property
    def mean(self) -> float:
        """The mean SSIM over the directions, without the close picture."""
        return sum(self.views) / len(self.views)


def sum_up_maps(units: Sequence[UnitFacts]) -> list[LevelMaps]:
    """Return the maps of one channel's units, for each level of detail."""
    records = [load_record(unit.directory)["lods"] for unit in units if unit.lods]
    levels = max(map(len, records), default=0)
    return [
        _level([lods[level]["maps"] for lods in records if level < len(lods)], level)
        for level in range(levels)
    ]


def _level(maps: Sequence[dict[str, Any]], level: int) -> LevelMaps:
    baked = [entry for entry in maps if entry["size"][0]]
    texels = [entry["texel_um"] for entry in baked]
    without: dict[str, int] = {}
    for entry in maps:
        if entry["reason"]:
            without[entry["reason"]] = without.get(entry["reason"], 0) + 1
    return LevelMaps(
        level,
        len(baked),
        (min(texels, default=0.0), max(texels, default=0.0)),
        sum(entry["size"][0] * entry["size"][1] for entry in baked),
        sum(entry["charts"] for entry in baked),
        any(entry["painted"] for entry in maps),
        without,
    )


def compare(facts: Facts) -> list[Likeness]:
    """Return how similar a coarser level is to lod0, for a few evenly chosen units."""
    units = [unit for unit in facts.units if len(unit.lods) > 1]
    found = []
    every = max(1, -(-len(units) // MAX_COMPARED))
    for i in thin_out(len(units), every)[:MAX_COMPARED]:
        lods = load_lods(units[i].directory)
        level = min(COMPARED, len(lods) - 1)
        views = find_likeness(lods[0], lods[level])
        close = find_close_likeness(lods[0], lods[level])
        found.append(Likeness(units[i].name, level, views, close))
    return found
