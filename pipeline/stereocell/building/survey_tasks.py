"""The survey's tasks: what a worker looks at to find a channel's window, and its level."""

from stereocell.building.channels import Channel
from stereocell.building.level_choice import given_level
from stereocell.building.plan import Plan
from stereocell.building.plan_source import source_of
from stereocell.building.source_tasks import around
from stereocell.building.steps.find_window import StatisticsTask, Window
from stereocell.building.steps.gather_evidence import EvidenceTask
from stereocell.isosurface.options import CRITERIA, LADDER
from stereocell.model.tiling import Box
from stereocell.transfer.windows import parse_window


def statistics_task(plan: Plan, channel: Channel) -> StatisticsTask:
    """Return the task that finds a channel's window and background."""
    settings, given = plan.settings, given_level(plan, channel)
    # CT and MR have values that mean something; so has a value that is given of voxels as they are
    subtracts = plan.modality not in ("CT", "MR") if given is None else given[1]
    subtracts = subtracts and settings.surface.background_um != 0
    level, window = plan.level_of(channel), (0.0, 255.0) if channel.source else None
    if channel.name in settings.windows:
        window = parse_window(f"--window {channel.name}", settings.windows[channel.name])
    ref = source_of(plan, channel=channel)
    is_in_hu = plan.modality == "CT" and plan.is_hounsfield and not channel.source
    finds_holder = is_in_hu and not settings.surface.keep_holder
    # shares of tissue have no noise that was measured
    max_shift = 0.0 if channel.source else settings.surface.max_shift
    return StatisticsTask(
        ref, level, channel.index, plan.region, settings, subtracts, max_shift, finds_holder, window
    )


def evidence_task(plan: Plan, box: Box, *, channel: Channel, window: Window) -> EvidenceTask:
    """Return the task that gathers the evidence of one tile, or of another box of the region."""
    criterion = LADDER if channel.rung else plan.settings.isovalue.criterion
    return EvidenceTask(
        source_of(plan, channel=channel),
        plan.level_of(channel),
        channel.index,
        box,
        plan.region,
        float(plan.settings.surface.smoothing_um),
        window.counting,
        around(window.statistics.background, box.grown(plan.halo, plan.region)),
        criterion if criterion in CRITERIA else "",
    )
