"""A first look at the levels of a channel, while the plan is made: on blocks, in a second.

`units` finds the level on all voxels. The plan names the levels that are near one another before
hours are spent on a build. Blocks of full resolution tell that better than a coarse level, which
has less noise and other slopes. A small volume is looked at as a whole.

Light that falls off along an axis is not looked for: few blocks have means that differ by chance.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.building.channels import Channel
from stereocell.building.level_choice import Found, find_doubt, find_level, given_level
from stereocell.building.open_source import open_source
from stereocell.building.plan import Plan
from stereocell.building.plan_source import source_of
from stereocell.building.survey_file import TileIso
from stereocell.building.survey_tasks import evidence_task, statistics_task
from stereocell.building.tasks.evidence import evidence_of
from stereocell.building.tasks.window import Window
from stereocell.filters.background import find_background
from stereocell.isosurface.level import Level
from stereocell.isosurface.level_evidence import (
    MAX_PADDING,
    Counting,
    denoising_reach,
    find_padding,
)
from stereocell.isosurface.level_histogram import Scale
from stereocell.isosurface.near_levels import find_near_levels, words_of
from stereocell.isosurface.options import NO_SURFACE
from stereocell.model.channel import LOW_CONFIDENCE
from stereocell.model.image_plane import back_of_three, first_of_three, slices_back, slices_first
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.transfer.channel_statistics import find_statistics
from stereocell.transfer.joint_histogram import sample_boxes

# Voxels of all channels together that are looked at: this share of all, within these bounds. In
# cells, brains and heads the levels of the blocks are within 15 % of those of all voxels, and
# confidences within .12
SHARE, BOUNDS = 1 / 12, (2_000_000, 3_000_000)
LEAST = 200_000  # voxels of one channel, however many there are
MOST_VOXELS = 500_000_000  # of a channel's region: blocks of larger ones lie in too many chunks
MARGIN = 0.1  # of a confidence by blocks: an estimate below the bound by less is not called unsure
MAX_CHANNELS = 12  # channels that are looked at
PASSES = 3  # that find the background; all six find nearly the same levels
BLOCK = (12, 40, 40)  # voxels (slice, row, column) of a block


def notes_on_levels(plan: Plan) -> list[str]:
    """Return a line for each channel whose level is unsure, or has others near it.

    Channels whose level is given need none, and neither do further surfaces of a channel. Of
    regions beyond MOST_VOXELS there are none: each block would cost a chunk of many times its size.
    """
    is_large = math.prod(plan.region.shape) > MOST_VOXELS
    if is_large or plan.settings.isovalue.rung == NO_SURFACE:
        return []
    wanted = [
        channel
        for channel in plan.channels
        if not channel.source and not channel.rung and given_level(plan, channel) is None
    ]
    channels = max(1, len(wanted))
    every = SHARE * channels * math.prod(plan.region.shape)
    most = max(LEAST, int(min(max(every, BOUNDS[0]), BOUNDS[1])) // channels)
    boxes = sample_boxes(plan.region, most, back_of_three(BLOCK, plan.slice_axis))
    is_whole = boxes == [plan.region]
    notes = [
        (one.name, _note(estimate_level(plan, one, boxes), is_whole))
        for one in wanted[:MAX_CHANNELS]
    ]
    return [f"{name}: {note}" for name, note in notes if note]


def estimate_level(plan: Plan, channel: Channel, boxes: Sequence[Box]) -> Found:
    """Return a channel's level as some boxes of the region alone tell it: all of it, or blocks."""
    source, is_whole = open_source(source_of(plan, channel=channel)), list(boxes) == [plan.region]
    volumes = [source.read(channel.index, box, plan.level) for box in boxes]
    window = _window(plan, channel, boxes, volumes)
    evidence = {}
    for place, (box, volume) in enumerate(zip(boxes, volumes, strict=True)):
        task = evidence_task(plan, box, channel=channel, window=window)
        found = evidence_of(task, volume, box)  # without a halo, which would be most of a block
        evidence[str(place)] = found if is_whole else replace(found, profiles=None)
    return find_level(plan, channel, window, evidence)


def _note(found: Found, is_whole: bool) -> str:
    """Return what is said of one channel; empty: it has a clear level with no other near it.

    is_whole  whether all voxels were looked at: else the levels are estimates
    """
    if found.levels is None or found.is_fixed:
        return ""
    ladder, mark = found.levels.ladder, "+b" if found.subtracts else ""
    about, digits = ("", 5) if is_whole else ("about ", 3)
    rungs = [rung for rung in found.rungs if isinstance(rung, Level)]
    if len(rungs) > 1:
        return f"its level is one of {about}{words_of(rungs, mark, digits)}, by the pieces of each"
    if not rungs:
        near = find_near_levels(ladder, None, is_unsure=False)
        if not near:
            return ""
        return f"no clear surface; near levels: {about}{words_of(near, mark, digits)}"
    (taken,) = rungs
    doubt = find_doubt(found, 0, [TileIso(taken.value, 0.0, taken.confidence, {})])
    is_unsure = bool(doubt) or taken.confidence < LOW_CONFIDENCE - (0.0 if is_whole else MARGIN)
    near = find_near_levels(ladder, taken.value, is_unsure=is_unsure)
    if not near and not is_unsure:
        return ""
    level = f"{'unsure ' if is_unsure else ''}level {about}{words_of(rungs, mark, digits)}"
    return f"{level}; near levels: {words_of(near, mark, digits)}" if near else level


def _window(
    plan: Plan, channel: Channel, boxes: Sequence[Box], volumes: Sequence[Volume]
) -> Window:
    """Return a channel's window as the boxes tell it.

    Side by side the boxes stand for the region as a coarser level does. So the background is found
    on them, too.
    """
    task = statistics_task(plan, channel)
    spacing, axis = volumes[0].spacing_um, volumes[0].slice_axis
    voxels = _side_by_side(boxes, volumes)
    surface, least, most = task.settings.surface, float(voxels.min()), float(voxels.max())
    is_mask = least < most and bool(((voxels == least) | (voxels == most)).all())
    darkest = None if is_mask else least
    reach = first_of_three(denoising_reach(float(surface.smoothing_um), spacing, axis), axis)
    padding = slices_back(find_padding(slices_first(voxels, axis), darkest, reach), axis)
    if padding.mean() > MAX_PADDING:
        padding[...], darkest = False, None
    scale, background = Scale.of(voxels, padding), None
    if task.subtracts and not is_mask:
        background = find_background(
            voxels,
            task.region,
            spacing_um=spacing,
            block_um=float(surface.background_um),
            padding=padding if padding.any() else None,
            passes=PASSES,
        )
    statistics = find_statistics(
        voxels, task.settings.window, background=background, window=task.window
    )
    counting = Counting(
        scale,
        None if background is None else scale.above(background),
        darkest,
        (least, most) if is_mask else None,
    )
    return Window(statistics, counting)


def _side_by_side(boxes: Sequence[Box], volumes: Sequence[Volume]) -> NDArray[Any]:
    """Return the voxels of blocks that stand in rows along z, y and x, as one array."""
    z, y, x = (len({box.start[axis] for box in boxes}) for axis in range(3))
    blocks = [volume.voxels for volume in volumes]
    rows = [blocks[place : place + x] for place in range(0, len(blocks), x)]
    return np.block([rows[place : place + y] for place in range(0, z * y, y)])
