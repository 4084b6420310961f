"""survey.json: what the first pass found of each channel.

pydantic turns the dataclasses into plain values and back; schemas/units.schema.json says what other
readers find there.
"""

from dataclasses import dataclass
from functools import cache

from pydantic import TypeAdapter

from stereocell.building.out_folder import OutFolder
from stereocell.isosurface.repair import RepairOptions
from stereocell.model.channel import Appearance
from stereocell.transfer.channel_statistics import ChannelStatistics


@dataclass(frozen=True, slots=True)
class TileIso:
    """One tile's iso-value.

    value       above the background, voxel values, reconciled with the neighbours'; None: the tile
                has none, and is built with the mean of the others
    background  mean over the tile, voxel values; 0: none is subtracted
    confidence  0..1
    reason      why the value is no better known; empty: it is sure
    file        the tile's own result, relative to OUT
    """

    value: float | None
    background: float
    confidence: float
    reason: str
    file: str


@dataclass(frozen=True, slots=True)
class ChannelSurvey:
    """One channel, as the first pass found it.

    statistics_file  where the statistics were read from, relative to OUT
    iso              by tile id
    """

    statistics: ChannelStatistics
    statistics_file: str
    iso: dict[str, TileIso]
    repair: RepairOptions
    appearance: Appearance


Survey = dict[str, ChannelSurvey]  # by channel id


def read_survey(out_folder: OutFolder) -> Survey:
    """Return what survey.json holds. Raises OutputError where it is missing or damaged."""
    return _surveys().validate_python(out_folder.survey())


def save_survey(out_folder: OutFolder, survey: Survey) -> None:
    """Write survey.json."""
    out_folder.save_survey(_surveys().dump_python(survey, mode="json"))


@cache
def _surveys() -> TypeAdapter[Survey]:
    return TypeAdapter(Survey)
