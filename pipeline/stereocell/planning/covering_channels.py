"""Leave the surface out of a channel that covers the specimen, where it would hide the others'.

A background or a marker of nearly all cells has a level like any other channel, but its surface
wraps the block, and hides what the other surfaces show. So it is drawn as a volume alone. What
tells it is the share of the region that lies above its level, as the components are counted:
smoothed, background subtracted. Names tell nothing here.

The share was tuned on microscopes' channels that have others beside them:

| volume | channels that cover | the largest of the others |
|---|---|---|
| brain_cells_2ch | background .86 | signal .02 |
| sample `cells`, 13 channels | HLADR .69, Ki67 .63 | CD45 .38 |
| sample `cycif` | none | MART1 .22 |
| sample `brain-cells` | none | Cells .04 |

A surface is left as it is where the settings state its level, or ask for it; of scans of patients,
whose skin is meant to be seen; and where no other channel has a smaller one.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

from stereocell.isosurface.level import Level
from stereocell.planning.channel_survey import Chosen
from stereocell.planning.channels import Channel
from stereocell.planning.plan import Plan


def leave_out_covering(plan: Plan, chosen: Mapping[str, Chosen]) -> dict[str, Chosen]:
    """Return the channels' levels, by channel ID, without those of channels that cover the others.

    A channel covers the others if more than surface.max_share of the region lies above its level.
    """
    most = plan.settings.surface.max_share
    shares = {id_: _share_inside(plan, one) for id_, one in chosen.items()}
    has_others = bool(plan.labels) or any(0 < share <= most for share in shares.values())
    if plan.modality or not has_others:
        return dict(chosen)
    covering = {
        one.id
        for one in plan.channels
        if shares[one.id] > most and not (one.rung or one.source or chosen[one.id].found.is_given)
    }
    return {
        one.id: _without_surface(one, chosen[one.id], shares[one.id])
        if one.id in covering
        else chosen[one.id]
        for one in plan.channels
    }


def _share_inside(plan: Plan, chosen: Chosen) -> float:
    """Return the share of the region's voxels above a channel's level; 0: it has none."""
    if not chosen.found.rungs:
        return 0.0
    inside = sum(one["voxels"] for one in chosen.components.values())
    return float(inside / math.prod(plan.region.shape))


def _without_surface(channel: Channel, chosen: Chosen, share: float) -> Chosen:
    level = chosen.found.rungs[chosen.rung]
    value = level.value if isinstance(level, Level) else level
    reason = (
        f"drawn as a volume: its surface, at {value:.5g}, would hold {share:.0%} of the specimen "
        f"and hide the other channels (--surfaces {channel.name}=outer builds it)"
    )
    return replace(
        chosen,
        found=replace(chosen.found, rungs=(), doubt=reason),
        rung=0,
        components={},
        iso={id_: replace(one, value=None, confidence=None) for id_, one in chosen.iso.items()},
    )
