"""Check that a plan's source, and that of each added channel, is unchanged since the plan."""

from pathlib import Path

from stereocell.building.open_source import open_source
from stereocell.building.plan import Plan
from stereocell.building.plan_source import source_of
from stereocell.building.tissue_files import read_whole
from stereocell.model.errors import SourceError


def require_input(plan: Plan) -> None:
    """Raise SourceError unless the input holds the voxels that were planned."""
    dataset = open_source(source_of(plan))
    if dataset.fingerprint != plan.fingerprint:
        # DICOM leaves out truncated files; the remarks report them
        remarks = "".join(f"; {remark}" for remark in dataset.remarks)
        raise SourceError(
            f"{plan.name}: changed since it was planned (fingerprint {dataset.fingerprint[:12]}, "
            f"expected {plan.fingerprint[:12]}{remarks}): plan into another OUT"
        )
    levels, channels = len(dataset.levels), len(dataset.channels)
    if plan.level >= levels or any(c.index >= channels for c in plan.channels if not c.source):
        raise SourceError(
            f"{plan.name}: holds {levels} levels and {channels} channels, the plan names others: "
            "plan into another OUT"
        )
    if any(a > b for a, b in zip(plan.region.stop, dataset.levels[plan.level].shape, strict=True)):
        raise SourceError(
            f"{plan.name}: level {plan.level} holds no such region: plan into another OUT"
        )


def require_labels(plan: Plan) -> None:
    """Raise SourceError unless the label maps hold the voxels that were planned."""
    for labels in plan.labels:
        found = open_source(labels.ref).fingerprint
        if found != labels.ref.fingerprint:
            raise SourceError(
                f"labels {labels.name!r}: changed since they were planned (fingerprint "
                f"{found[:12]}, expected {labels.ref.fingerprint[:12]}): plan into another OUT"
            )


def require_added(plan: Plan) -> None:
    """Raise SourceError or OutputError unless the added channels' voxels are unchanged."""
    for folder in {Path(channel.source).parent for channel in plan.channels if channel.source}:
        read_whole(folder)
    for channel in plan.channels:
        if channel.source and open_source(source_of(plan, channel=channel)).fingerprint != (
            channel.fingerprint
        ):
            raise SourceError(
                f"{channel.source}: channel {channel.name!r} changed since it was planned: run the "
                "command again that made it (`stereocell tissue OUT`)"
            )
