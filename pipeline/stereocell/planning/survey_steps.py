"""Make the steps of the survey: a channel's window, and the evidence for its level in each tile."""

from stereocell.isosurface.options import CONNECTED, CRITERIA, LEVELS
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Box, Tile
from stereocell.planning.channels import Channel
from stereocell.planning.level_choice import Found, given_level, level_of_tile
from stereocell.planning.plan import Plan
from stereocell.planning.plan_source import voxels_of
from stereocell.steps.find_window import FindWindow, Window
from stereocell.steps.gather_evidence import GatherEvidence
from stereocell.steps.sum_components import SumComponents
from stereocell.transfer.windows import parse_window


def window_step(plan: Plan, channel: Channel) -> FindWindow:
    """Return the step that finds a channel's window and background."""
    settings, given = plan.settings, given_level(plan, channel)
    # The background is not subtracted from CT and MR, nor if the user gives a plain voxel value:
    # there the values themselves have a meaning.
    subtracts = plan.modality not in ("CT", "MR") if given is None else given[1]
    window = (0.0, 255.0) if channel.source else None
    if channel.name in settings.windows:
        window = parse_window(f"--window {channel.name}", settings.windows[channel.name])
    is_in_hu = plan.modality == "CT" and plan.is_hounsfield and not channel.source
    return FindWindow(
        voxels_of(plan, channel),
        plan.region,
        settings.window,
        smoothing_um=float(settings.surface.smoothing_um),
        background_um=float(settings.surface.background_um) if subtracts else 0.0,
        # shares of tissue are computed, so they have no measurement noise
        max_shift=0.0 if channel.source else settings.surface.max_shift,
        finds_holder=is_in_hu and not settings.surface.keep_holder,
        window=window,
    )


def evidence_step(plan: Plan, box: Box, *, channel: Channel, window: Window) -> GatherEvidence:
    """Return the step that gathers the evidence for levels in a tile or another box."""
    criterion = LEVELS if channel.level else plan.settings.isovalue.criterion
    return GatherEvidence(
        voxels_of(plan, channel),
        box,
        plan.region,
        float(plan.settings.surface.smoothing_um),
        window.counting,
        around(window.statistics.background, box.grown(plan.halo, plan.region)),
        criterion if criterion in CRITERIA else "",
    )


def components_step(
    plan: Plan, tile: Tile, channel: Channel, found: Found, index: int
) -> SumComponents | None:
    """Return the step that sums up a tile's components at one of the channel's levels.

    index  index of the level in `found.candidates`

    None: the channel has no such level, or the tile has no surface.
    """
    if index >= len(found.candidates):
        return None
    iso = level_of_tile(plan, tile, found, index, {}).value
    if iso is None:
        return None
    compares = index > 0 and plan.settings.isovalue.level == CONNECTED
    surface = plan.settings.surface
    return SumComponents(
        voxels_of(plan, channel),
        tile.box,
        float(surface.smoothing_um),
        iso,
        around(found.background, tile.box),
        float(surface.min_diagonal_um),
        found.window.max_shift,
        plan.step,
        level_of_tile(plan, tile, found, index - 1, {}).value if compares else None,
    )


def around(field: LatticeField | None, box: Box) -> LatticeField | None:
    """Return the part of a field near a box; None if there is no field."""
    return None if field is None else field.around(box)
