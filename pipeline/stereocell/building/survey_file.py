"""survey.json: the first pass's results for each channel.

pydantic turns the dataclasses into plain values and back; schemas/units.schema.json describes the
file for other readers.
"""

from dataclasses import dataclass
from functools import cache

from pydantic import TypeAdapter

from stereocell.building.out_folder import OutFolder
from stereocell.isosurface.repair import RepairOptions
from stereocell.model.channel import Appearance
from stereocell.transfer.channel_statistics import ChannelStatistics

# The files that the first pass leaves beside survey.json, and the remedy for a damaged one
WINDOW, ISO_VALUE = "units.schema.json#Window", "units.schema.json#IsoValue"
AGAIN = "run `stereocell units OUT` again"


@dataclass(frozen=True, slots=True)
class TileIso:
    """One tile's iso-value.

    value       above the background, voxel values, reconciled with the neighbours'; None: the tile
                has none, and is built with the mean of the others
    background  mean over the tile, voxel values; 0: none is subtracted
    confidence  0..1
    reason      the reason for a low confidence; empty: the value is certain
    file        the tile's own result, relative to OUT
    """

    value: float | None
    background: float
    confidence: float
    reason: str
    file: str


@dataclass(frozen=True, slots=True)
class ChannelSurvey:
    """The first pass's results for one channel.

    statistics_file  the file of the statistics, relative to OUT
    iso              by tile ID
    """

    statistics: ChannelStatistics
    statistics_file: str
    iso: dict[str, TileIso]
    repair: RepairOptions
    appearance: Appearance


Survey = dict[str, ChannelSurvey]  # by channel ID


def read_survey(out_folder: OutFolder) -> Survey:
    """Return the content of survey.json. Raises OutputError where it is missing or damaged."""
    return _surveys().validate_python(out_folder.survey())


def save_survey(out_folder: OutFolder, survey: Survey) -> None:
    """Write survey.json."""
    out_folder.save_survey(_surveys().dump_python(survey, mode="json"))


@cache
def _surveys() -> TypeAdapter[Survey]:
    return TypeAdapter(Survey)
