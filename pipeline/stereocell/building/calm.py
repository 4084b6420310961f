"""How a surface that nothing tells from noise is built all the same: calmed.

At its level the field is frayed, in solids that join into one: a tile of a real brain's
autofluorescence (30 x 510 x 512 voxels) came to 1.42 million triangles after 376 s of simplifying,
where cells have 0.14 million after 10 s. There is no gap in it that is known to be one, so none is
closed, and what closing would have reached is spent on smoothing: the unit reads no more voxels,
neighbours still see the same field, and that tile has 65 thousand triangles after 4.5 s.
"""

from dataclasses import replace

from stereocell.building.plan import Plan
from stereocell.filters.denoise import SMOOTHING_REACH
from stereocell.model.channel import Verdict


def plan_for(plan: Plan, verdict: Verdict) -> Plan:
    """Return the plan as a channel with such a surface is built by it: calmed if it is unclear."""
    if verdict != "unclear":
        return plan
    surface = plan.settings.surface
    repair, step = plan.repair, plan.spacing_um
    closing = repair.reach_um(step) - replace(repair, alpha_um=0.0).reach_um(step)
    sigma = float(surface.smoothing_um) + closing / SMOOTHING_REACH
    calm = replace(surface, smoothing_um=sigma)
    return replace(plan, settings=replace(plan.settings, surface=calm))
