"""Choose a channel's appearance before a build has surveyed it.

The rules are the same as in a build, applied to coarse voxels.
"""

from dataclasses import replace

import numpy as np

from stereocell.filters.denoise import denoise
from stereocell.isosurface.array_levels import gather_array_evidence
from stereocell.live.coarse_channel import CoarseChannel
from stereocell.model.channel import Appearance, TransferFunctions2d
from stereocell.model.tiling import Box, Tile
from stereocell.model.volume import Volume
from stereocell.planning.channel_survey import Chosen, appearance_of
from stereocell.planning.channels import Channel
from stereocell.planning.level_choice import find_level, level_of_tile
from stereocell.planning.plan import Plan
from stereocell.planning.survey import is_body
from stereocell.steps.find_window import Window
from stereocell.transfer.boundaries import SuggestedShapes
from stereocell.transfer.channel_statistics import NO_SUGGESTION, find_statistics
from stereocell.transfer.joint_histogram import (
    FINE_ROWS,
    STEEPEST,
    choose_gradient_max,
    count_joint,
    to_eight_bits,
)
from stereocell.transfer.windows import parse_window

JOINT_VOXELS = 1_000_000  # approximate number of voxels in the histogram of value and gradient


def load_kernels() -> None:
    """Load the compiled code that `first_appearance` needs. This takes a third of a second."""
    denoise(Volume(np.zeros((2, 2, 2), np.float32), (1.0, 1.0, 1.0)), 1.0)


def first_appearance(
    plan: Plan, channel: Channel, coarse: CoarseChannel
) -> tuple[Appearance, bool]:
    """Return a channel's appearance, found in its coarse voxels, and whether it is a body.

    The window, the iso-value and the transfer functions follow the rules of a build. The iso-value
    is chosen without connected components, which only the full resolution shows.
    """
    spacing = tuple(a * b for a, b in zip(coarse.grid.step, plan.spacing_um, strict=True))
    z, y, x = spacing
    volume = Volume(coarse.voxels, (z, y, x))
    found = gather_array_evidence(volume, modality=plan.modality)
    given = None
    if channel.name in plan.settings.windows:
        given = parse_window(f"--window {channel.name}", plan.settings.windows[channel.name])
    statistics = find_statistics(
        coarse.sample.copy(), plan.settings.window, background=found.background, window=given
    )
    steepest = _find_gradient_max(volume, statistics.window)
    suggested = SuggestedShapes(TransferFunctions2d(gradient_max=steepest), NO_SUGGESTION.reason)
    statistics = replace(statistics, suggested=suggested)
    window = Window(statistics, found.counting, None, found.max_shift)
    whole = Tile("r0_c0", Box((0, 0, 0), coarse.voxels.shape))
    # This plan is for the coarse voxels. It has one tile, with the evidence of the whole channel.
    small = replace(plan, spacing_um=(z, y, x), region=whole.box, tiles=(whole,))
    level = find_level(small, channel, window, {whole.id: found.evidence})
    iso = {whole.id: level_of_tile(small, whole, level, 0, {})}
    # Transfer functions follow the planned voxels, which will replace the coarse ones.
    fine = replace(plan, tiles=(Tile(whole.id, plan.region),))
    appearance = appearance_of(fine, channel, Chosen(level, 0, {}, iso))
    return appearance, is_body(appearance, statistics)


def _find_gradient_max(volume: Volume, window: tuple[float, float]) -> float:
    """Return the largest gradient of 2D transfer functions, by the rule of a build.

    Boundaries between materials are not searched, since that takes longer than everything else.
    """
    every = -(-volume.voxels.size // JOINT_VOXELS)
    counts = count_joint(
        to_eight_bits(volume.voxels, window),
        volume.spacing_um,
        gradient_max=STEEPEST,
        rows=FINE_ROWS,
        every=every,
    )
    return choose_gradient_max(counts)
