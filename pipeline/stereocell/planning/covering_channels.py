"""Build no surface of a channel that covers the specimen, because it would hide other surfaces.

A background, or a marker of nearly all cells, has an iso-level like any other channel. Its surface
wraps the whole block and hides the other surfaces, so the channel is drawn as a volume only. The
criterion is the share of the region's voxels above the level, after smoothing and subtraction of
the background. The channel's name does not matter.

The limit, surface.max_share, was tuned on microscopes' volumes with several channels:

| volume | channels that cover, share | other channel with the largest share |
|---|---|---|
| brain_cells_2ch | background .86 | signal .02 |
| sample `cells`, 13 channels | HLADR .69, Ki67 .63 | CD45 .38 |
| sample `cycif` | none | MART1 .22 |
| sample `brain-cells` | none | Cells .04 |

The surface stays in three cases:

- The settings state its level or ask for the surface.
- The volume is a scan of a patient, whose skin is meant to be seen.
- No other channel has a surface that it could hide.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

from stereocell.isosurface.level import Level
from stereocell.planning.channel_survey import Chosen
from stereocell.planning.channels import Channel
from stereocell.planning.plan import Plan


def leave_out_covering(plan: Plan, chosen: Mapping[str, Chosen]) -> dict[str, Chosen]:
    """Return the levels by channel ID, without those of channels that cover the others.

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
        if shares[one.id] > most and not (one.level or one.source or chosen[one.id].found.is_given)
    }
    return {
        one.id: _without_surface(one, chosen[one.id], shares[one.id])
        if one.id in covering
        else chosen[one.id]
        for one in plan.channels
    }


def _share_inside(plan: Plan, chosen: Chosen) -> float:
    """Return the share of the region's voxels above a channel's level; 0: it has no level."""
    if not chosen.found.candidates:
        return 0.0
    inside = sum(one["voxels"] for one in chosen.components.values())
    return float(inside / math.prod(plan.region.shape))


def _without_surface(channel: Channel, chosen: Chosen, share: float) -> Chosen:
    level = chosen.found.candidates[chosen.index]
    value = level.value if isinstance(level, Level) else level
    reason = (
        f"drawn as a volume: its surface, at {value:.5g}, would hold {share:.0%} of the specimen "
        f"and hide the other channels (--surfaces {channel.name}=outer builds it)"
    )
    return replace(
        chosen,
        found=replace(chosen.found, candidates=(), reason=reason),
        index=0,
        components={},
        iso={id_: replace(one, value=None, confidence=None) for id_, one in chosen.iso.items()},
    )
