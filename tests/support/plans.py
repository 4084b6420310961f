"""Plans of small datasets."""

from collections.abc import Iterable, Mapping
from typing import Any

from stereocell.isosurface.repair_options import RepairOptions
from stereocell.isosurface.repair_rules import choose_repair
from stereocell.planning import settings as settings_module
from stereocell.planning.channels import Channel
from stereocell.planning.plan import Plan, choose_level, make_plan
from stereocell.read import Level

LEVELS = (
    Level((64, 256, 640), (0.28, 0.14, 0.14)),
    Level((64, 128, 320), (0.28, 0.28, 0.28)),
    Level((64, 64, 160), (0.28, 0.56, 0.56)),
)


CHANNELS = (Channel(0, "Hoechst 33342", (0, 0, 1)), Channel(2, "CD3ε", (0, 1, 0)))


def plan_of(
    flags: dict[str, object] | None = None,
    levels: tuple[Level, ...] = LEVELS,
    channels: tuple[Channel, ...] = CHANNELS,
    **sections: dict[str, object],
) -> Plan:
    settings = settings_module.load(None, None, flags={"plan": flags or {}, **sections})
    level = choose_level(levels, len(channels), settings)
    return make_plan(
        "in.ome.zarr",
        "in",
        fingerprint="ab" * 32,
        levels=levels,
        origin_um=(0.0, 0.0, 0.0),
        channels=channels,
        level=level,
        settings=settings,
        formats=["ome-zarr"],
    )


def choose(plan: Plan, tiles: Iterable[Mapping[str, Any]]) -> RepairOptions:
    """Return how a plan repairs a channel's surface."""
    return choose_repair(
        tiles, plan.repair, surface=plan.settings.surface, spacing_um=plan.spacing_um
    )
