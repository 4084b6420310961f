"""What a plan says of its source and settings beside the plan: gaps in the data, vain settings."""

from collections.abc import Iterator, Sequence

from stereocell.building.channels import ALL, Channel
from stereocell.building.plan import Plan
from stereocell.building.settings import Settings
from stereocell.isosurface.options import LADDER, RUNGS
from stereocell.read import Dataset
from stereocell.transfer.joint_histogram import sample_boxes

_LOOKED_AT = 16_000_000  # voxels of all channels that are looked at for NaN


def told_of_gaps(dataset: Dataset, plan: Plan) -> list[str]:
    """Return what is said of NaN and infinity; of much data some blocks are looked at.

    Raises SourceError where a channel has nothing else.
    """
    indices = list(dict.fromkeys(channel.index for channel in plan.channels))
    if not indices:
        return []
    boxes = sample_boxes(plan.region, max(1, _LOOKED_AT // len(indices)))
    found = []
    for index in indices:
        share = dataset.share_of_gaps(index, boxes, plan.level)
        if share == 1.0:
            dataset.darkest(index)
        if share > 0.0:
            found.append(
                f"{dataset.channels[index].name}: {max(share, 1e-4):.2%} of the voxels are NaN or "
                "infinite: read as the smallest finite value"
            )
    return found


def told_in_vain(settings: Settings, channels: Sequence[Channel]) -> Iterator[str]:
    """Yield what is said of each setting that another one overrules."""
    options = settings.isovalue
    for channel in channels:
        keys = (channel.name, str(channel.index), ALL)
        given = next((settings.iso_values[k] for k in keys if k in settings.iso_values), None)
        if channel.rung and given is not None and given != settings.iso_values.get(ALL):
            yield f"{channel.name}: built where --surfaces says, not at the iso-value {given}"
        if channel.rung and options.criterion != LADDER:
            yield f"{channel.name}: built where --surfaces says, not by {options.criterion}"
        is_number = channel.rung not in RUNGS if channel.rung else given is not None
        if is_number and options.scope == "tile":
            yield (
                f"{channel.name}: its level is given, so the same in all tiles: --iso-scope tile "
                "is for levels that are found"
            )
