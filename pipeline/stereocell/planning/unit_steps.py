"""Make the steps that build the units of a plan's channels."""

import math
from collections.abc import Iterable
from itertools import product

from stereocell.meshes.alpha_wrap import find_wrapper
from stereocell.model.errors import UsageError
from stereocell.model.lattice import Lattice
from stereocell.model.settings import EIGHT_BITS
from stereocell.model.tiling import Tile
from stereocell.planning.channels import Channel
from stereocell.planning.plan import Plan
from stereocell.planning.plan_source import voxels_of
from stereocell.planning.settings import Settings
from stereocell.planning.survey import Survey
from stereocell.planning.survey_steps import around
from stereocell.steps.build_unit import BuildUnit
from stereocell.steps.labels import Labels
from stereocell.steps.unit import UnitInput, UnitOptions
from stereocell.textures.map_packages import unwrapper_version


def unit_steps(plan: Plan, survey: Survey) -> dict[str, BuildUnit]:
    """Return the step of every unit, by `<tile>/<channel>`."""
    return {
        f"{tile.id}/{channel.id}": _unit_step(plan, tile, channel, survey)
        for tile, channel in product(plan.tiles, plan.channels)
    }


def longest_first(plan: Plan, survey: Survey, names: Iterable[str]) -> list[str]:
    """Return units tile by tile, and those of a tile by their expected work, the most first.

    names  `<tile>/<channel>` of each

    So the workers of a small build end at about the same time. The work of a surface grows with its
    voxel faces. Objects of label maps come first, because their work is not known.
    """
    tiles = {tile.id: place for place, tile in enumerate(plan.tiles)}

    def rank(name: str) -> tuple[int, float]:
        tile, channel = name.split("/")
        return tiles[tile], -survey[channel].most_faces if channel in survey else -math.inf

    return sorted(names, key=rank)


def _unit_step(plan: Plan, tile: Tile, channel: Channel, survey: Survey) -> BuildUnit:
    found = survey[channel.id]
    painter, level = plan.painter(channel), found.appearance.level
    own = tile.lattice(plan.region)
    window = own.grown(plan.halo, plan.region)
    given = UnitInput(
        lattice=Lattice(
            window, own, plan.region, plan.spacing_um, plan.origin_um, plan.cap_of(channel)
        ),
        iso=None if level is None else around(level.field, window),
        background=around(found.statistics.background, window),
        repair=found.repair,
        step=plan.with_grid(found.grid_um).step,
        intensity_window=found.statistics.window,
        options=unit_options(plan.settings),
        painted=None if painter is None else survey[painter.id].statistics.window,
        holder=found.holder and found.holder.around(window),
        max_shift=None if level is None else level.max_shift,
    )
    painted = None if painter is None else voxels_of(plan, painter)
    return BuildUnit(voxels_of(plan, channel), given, painted)


def choose_units(plan: Plan, only: str | None) -> dict[str, str]:
    """Return the titles of units, by `<tile>/<channel>`.

    only  `TILE/CHANNEL`, by name or ID, to choose one unit; None: all units

    Raises UsageError if there is no such unit.
    """
    every: list[Channel | Labels] = [*plan.channels, *plan.labels]
    wanted = [(tile.id, channel) for tile in plan.tiles for channel in every]
    if only is not None:
        wanted = [(t, c) for t, c in wanted if only in {f"{t}/{name}" for name in _names(c)}]
    if only is not None and not wanted:
        raise UsageError(
            f"--only is {only!r}, expected TILE/CHANNEL with a tile from {plan.tiles[0].id} to "
            f"{plan.tiles[-1].id} and a channel of {', '.join(c.name for c in every)}"
        )
    return {f"{tile}/{channel.id}": f"{tile}/{channel.name}" for tile, channel in wanted}


def _names(channel: Channel | Labels) -> tuple[str | int, ...]:
    """Return the names by which a user may call a channel; an index counts the input's channels."""
    if isinstance(channel, Labels):
        return channel.name, channel.id
    return (channel.name, channel.id) + (() if channel.source else (channel.index,))


def unit_options(settings: Settings) -> UnitOptions:
    """Return the settings that units depend on. Raises UsageError if a package is missing."""
    surface = settings.surface
    return UnitOptions(
        float(surface.smoothing_um),
        surface.closed_tiles,
        EIGHT_BITS if settings.volume.without_vdb else settings.volume.bits,
        settings.lod,
        settings.unwrap,
        find_wrapper() if surface.wrap == "alpha-wrap" else "",
        unwrapper_version() if settings.unwrap.maps else "",
    )
