"""Make the reference to a plan's source, or to the source of one of its channels."""

from stereocell.planning.channels import Channel
from stereocell.planning.input_files import as_asked
from stereocell.planning.plan import Plan
from stereocell.steps.open_source import SourceRef, Voxels


def source_of(plan: Plan, *, channel: Channel | None = None) -> SourceRef:
    """Return the reference to a plan's source, or to the source of its own that a channel has."""
    if channel is not None and channel.source:
        return SourceRef(channel.source, 0, (), fingerprint=channel.fingerprint)
    return as_asked(plan.source, plan.settings.plan, fingerprint=plan.fingerprint)


def voxels_of(plan: Plan, channel: Channel) -> Voxels:
    """Return the voxels of a channel at the resolution level that is built."""
    ref = source_of(plan, channel=channel)
    return Voxels(ref, channel.index, plan.level_of(channel), plan.spacing_um, plan.origin_um)
