"""Estimate the iso-level of each channel while the plan is made, from a few blocks, in a second.

`units` finds the level on all voxels. The plan states an estimate and the levels near it, before
hours are spent on a build. Blocks at full resolution are better for that than a coarse resolution
level, which has less noise and other slopes. A small volume is read as a whole.

Light that falls off along an axis is not corrected, because the means of a few blocks differ by
chance.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.filters.background import find_background
from stereocell.isosurface.level_evidence import (
    MAX_PADDING,
    Counting,
    denoising_reach,
    find_padding,
)
from stereocell.isosurface.level_histogram import Scale
from stereocell.model.counted import counted
from stereocell.model.image_plane import back_of_three, first_of_three, slices_back, slices_first
from stereocell.model.sample_boxes import sample_boxes
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.planning.channels import Channel
from stereocell.planning.level_choice import Found, find_level
from stereocell.planning.level_notes import note_before_reading, note_on_found
from stereocell.planning.plan import Plan
from stereocell.planning.plan_source import source_of
from stereocell.planning.survey_steps import evidence_step, window_step
from stereocell.steps.find_window import Window
from stereocell.steps.gather_evidence import evidence_of
from stereocell.steps.open_source import open_source
from stereocell.transfer.channel_statistics import find_statistics

# Share of the voxels of all channels that is read, and its bounds in voxels. In cells, brains and
# heads the levels of the blocks were within 15 % of those of all voxels, and confidences within
# 0.12.
SHARE, BOUNDS = 1 / 12, (2_000_000, 3_000_000)
LEAST = 200_000  # fewest voxels of one channel, however many channels there are
MOST_VOXELS = 500_000_000  # largest region, voxels; blocks of larger ones lie in too many chunks
MAX_CHANNELS = 12  # most channels whose level is estimated
PASSES = 3  # passes that find the background; the build's six find nearly the same levels
BLOCK = (12, 40, 40)  # voxels (slice, row, column) of a block


def notes_on_levels(plan: Plan) -> list[str]:
    """Return a line for each channel: its level, or "no surface", and whether the level is unsure.

    Regions of more than MOST_VOXELS are not read, because each block would cost a chunk of many
    times its size. One line stands for all channels beyond MAX_CHANNELS.
    """
    own = [one for one in plan.channels if not one.source]
    notes = {one.name: note_before_reading(plan, one) for one in own}
    wanted = [one for one in own if not notes[one.name]]
    found = {}
    if math.prod(plan.region.shape) <= MOST_VOXELS:
        found = _found_in_blocks(plan, wanted)
    notes |= found
    lines = [f"{name}: {note}" for name, note in notes.items() if note]
    others = len(own) - len(lines)
    if others:
        rest = f"{counted(others, 'other channel')}" if lines else "the channels"
        lines.append(f"the plan does not estimate the iso-values of {rest}: the build finds them")
    return lines


def _found_in_blocks(plan: Plan, wanted: Sequence[Channel]) -> dict[str, str]:
    """Return the notes on the first MAX_CHANNELS of these channels, by channel name."""
    channels = max(1, len(wanted))
    every = SHARE * channels * math.prod(plan.region.shape)
    most = max(LEAST, int(min(max(every, BOUNDS[0]), BOUNDS[1])) // channels)
    boxes = sample_boxes(plan.region, most, back_of_three(BLOCK, plan.slice_axis))
    is_whole = boxes == [plan.region]
    return {
        one.name: note_on_found(plan, estimate_level(plan, one, boxes), is_whole=is_whole)
        for one in wanted[:MAX_CHANNELS]
    }


def estimate_level(plan: Plan, channel: Channel, boxes: Sequence[Box]) -> Found:
    """Return a channel's levels as found in some boxes, which may be the whole region."""
    source, is_whole = open_source(source_of(plan, channel=channel)), list(boxes) == [plan.region]
    volumes = [source.read(channel.index, box, plan.level) for box in boxes]
    window = _window(plan, channel, boxes, volumes)
    evidence = {}
    for place, (box, volume) in enumerate(zip(boxes, volumes, strict=True)):
        step = evidence_step(plan, box, channel=channel, window=window)
        found = evidence_of(step, volume, box)  # no halo: it would be larger than the block
        evidence[str(place)] = found if is_whole else replace(found, profiles=None)
    return find_level(plan, channel, window, evidence)


def _window(
    plan: Plan, channel: Channel, boxes: Sequence[Box], volumes: Sequence[Volume]
) -> Window:
    """Return a channel's window as found in the boxes.

    The boxes side by side look like a coarse level of the region, so the background is found on
    them, too.
    """
    step = window_step(plan, channel)
    spacing, axis = volumes[0].spacing_um, volumes[0].slice_axis
    voxels = _side_by_side(boxes, volumes)
    least, most = float(voxels.min()), float(voxels.max())
    is_mask = least < most and bool(((voxels == least) | (voxels == most)).all())
    darkest = None if is_mask else least
    reach = first_of_three(denoising_reach(step.smoothing_um, spacing, axis), axis)
    padding = slices_back(find_padding(slices_first(voxels, axis), darkest, reach), axis)
    if padding.mean() > MAX_PADDING:
        padding[...], darkest = False, None
    scale, background = Scale.of(voxels, padding), None
    if step.background_um > 0 and not is_mask:
        background = find_background(
            voxels,
            step.region,
            spacing_um=spacing,
            block_um=step.background_um,
            padding=padding if padding.any() else None,
            passes=PASSES,
        )
    statistics = find_statistics(voxels, step.options, background=background, window=step.window)
    counting = Counting(
        scale,
        None if background is None else scale.above(background),
        darkest,
        (least, most) if is_mask else None,
    )
    return Window(statistics, counting)


def _side_by_side(boxes: Sequence[Box], volumes: Sequence[Volume]) -> NDArray[Any]:
    """Return the voxels of blocks on a regular grid, as one array without gaps (z, y, x)."""
    z, y, x = (len({box.start[axis] for box in boxes}) for axis in range(3))
    blocks = [volume.voxels for volume in volumes]
    rows = [blocks[place : place + x] for place in range(0, len(blocks), x)]
    return np.block([rows[place : place + y] for place in range(0, z * y, y)])
