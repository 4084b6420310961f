"""Choose the pictures of a report, and draw them on the workers of a build."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from stereocell.engine.run import Engine
from stereocell.model.channel import SurfaceLevel
from stereocell.model.tiling import Tile
from stereocell.model.volume import zyx_to_xyz
from stereocell.planning.channels import Channel
from stereocell.planning.level_choice import highest_of
from stereocell.planning.other_levels import OtherLevel, ends_of, find_other_levels
from stereocell.planning.plan import Plan
from stereocell.planning.survey import ChannelSurvey
from stereocell.preview.views import views_of
from stereocell.report.draw_scenes import Picture, Scene, Surface
from stereocell.report.facts import Facts, UnitFacts
from stereocell.report.objects import LabelFacts
from stereocell.report.select_units import choose_level, choose_units, thin_out
from stereocell.report.unit_pictures import DrawnIso, DrawnUnit, UnitPictures, draw

MAX_PICTURED = 60  # largest number of units with pictures
# Largest number of triangles in one picture, of a tile and of the whole specimen
_TILE_TRIANGLES, WHOLE_TRIANGLES = 400_000, 1_500_000
# pixels: width and largest height of a picture
_TILE_PX, _WHOLE_PX = (420, 420), (1120, 620)


@dataclass(frozen=True, slots=True)
class Pictures:
    """All pictures that are drawn from units.

    whole  the specimen
    tiles  the surfaces of each pictured tile, by the tile's ID
    units  the pictures of each pictured unit, by `UnitFacts.key`
    """

    whole: Picture
    tiles: dict[str, Picture]
    units: dict[tuple[str, str], DrawnUnit]


def draw_pictures(facts: Facts, labels: Sequence[LabelFacts], engine: Engine) -> Pictures:
    """Draw all pictures of a report on an engine's workers.

    Raises TasksFailedError where units are damaged, after all others are drawn.
    """
    scenes = {"specimen": _scene(facts, None, labels)}
    scenes |= {tile.id: _scene(facts, tile) for tile, _ in pictured_units(facts.plan)}
    units = _unit_pictures(facts)
    tasks: list[tuple[str, Scene | UnitPictures]] = [
        *scenes.items(),
        *((f"{tile}/{channel}", unit) for (tile, channel), unit in units.items()),
    ]
    drawn = engine.run("report", draw, tasks, needs=(draw.__module__,))
    whole, *tiles = cast("list[Picture]", drawn[: len(scenes)])
    found = cast("list[DrawnUnit]", drawn[len(scenes) :])
    return Pictures(
        whole,
        dict(zip(list(scenes)[1:], tiles, strict=True)),
        dict(zip(units, found, strict=True)),
    )


def pictured_units(plan: Plan) -> list[tuple[Tile, list[Channel]]]:
    """Return the tiles with pictures, each with the channels whose slices are drawn."""
    chosen = choose_units(len(plan.tiles), len(plan.channels), MAX_PICTURED)
    return [(plan.tiles[tile], [plan.channels[one] for one in own]) for tile, own in chosen]


def clearest_unit(facts: Facts, channel: Channel) -> UnitFacts:
    """Return the unit of a channel with the most triangles, or else the one in the middle."""
    units = [unit for unit in facts.units if unit.channel == channel]
    with_surface = [unit for unit in units if unit.lods]
    if not with_surface:
        return units[len(units) // 2]
    return max(with_surface, key=lambda unit: unit.lods[0].triangles)


def channels_with_threshold(facts: Facts) -> list[Channel]:
    """Return the channels whose adaptive threshold is shown.

    The voxels of a tissue class are probabilities, and their histogram has no such threshold.
    """
    found = [
        channel
        for channel in facts.plan.channels
        if not channel.source
        and facts.survey[channel.id].statistics.threshold is not None
        and facts.survey[channel.id].appearance.threshold_normalized is not None
    ]
    return found[:MAX_PICTURED]


def other_levels(facts: Facts, channel: Channel) -> list[OtherLevel]:
    """Return the next-best iso-values of a channel. `clearest_unit` shows them."""
    found = facts.survey[channel.id]
    subtracts = found.statistics.background is not None
    return list(
        find_other_levels(
            facts.plan,
            channel,
            found.levels,
            subtracts=subtracts,
            taken=None if found.appearance.level is None else found.appearance.level.iso,
            threshold=found.appearance.threshold,
            ends=None if found.curve is None else ends_of(found.curve.values),
            highest=highest_of(found.statistics, subtracts),
        )
    )


def _unit_pictures(facts: Facts) -> dict[tuple[str, str], UnitPictures]:
    """Return the pictures to draw of each unit, by `UnitFacts.key`."""
    sliced = {(tile.id, one.id) for tile, own in pictured_units(facts.plan) for one in own}
    shown = {clearest_unit(facts, channel).key for channel in facts.plan.channels}
    with_threshold = channels_with_threshold(facts)
    wanted = {}
    for unit in facts.units:
        found, is_shown = facts.survey[unit.channel.id], unit.key in shown
        share = found.appearance.threshold_normalized
        others = other_levels(facts, unit.channel) if is_shown else []
        has_slices = unit.key in sliced
        has_threshold = is_shown and unit.channel in with_threshold
        if has_slices or others or has_threshold:
            wanted[unit.key] = UnitPictures(
                unit.directory,
                unit.tile.lattice(facts.plan.region),
                facts.plan.position_um(unit.tile.lattice(facts.plan.region).start),
                facts.plan.spacing_um,
                float(facts.plan.settings.surface.smoothing_um),
                views_of(
                    facts.plan.placement, is_neurological=facts.plan.settings.plan.neurological
                ),
                has_slices,
                bool(unit.lods),
                _own_level(found),
                tuple(_level_of(found, other) for other in others),
                share if has_threshold else None,
            )
    return wanted


def _own_level(found: ChannelSurvey) -> DrawnIso | None:
    level, statistics = found.appearance.level, found.statistics
    if level is None:
        return None
    return DrawnIso(level.field, statistics.background, statistics.window)


def _level_of(found: ChannelSurvey, other: OtherLevel) -> DrawnIso:
    field = SurfaceLevel(other.value, None, 0.0).field
    background = found.statistics.background if other.above else None
    return DrawnIso(field, background, found.statistics.window)


def _scene(facts: Facts, tile: Tile | None, labels: Sequence[LabelFacts] = ()) -> Scene:
    """Return the scene of a tile, or of the whole specimen if `tile` is None.

    labels  label maps, which are drawn only if the plan has no image channels
    """
    tiles = facts.plan.tiles if tile is None else (tile,)
    most = WHOLE_TRIANGLES if tile is None else _TILE_TRIANGLES
    units = [u for u in facts.units if u.lods and (tile is None or u.tile == tile)]
    level, every = level_in_picture(units, most)
    boxes = [_box_um(facts, t) for t in tiles]
    corners = np.array(boxes)
    return Scene(
        surfaces=tuple(
            Surface(
                u.directory.absolute(),
                min(level, len(u.lods) - 1),
                facts.survey[u.channel.id].appearance.color,
            )
            for u in (units[i] for i in thin_out(len(units), every))
        )
        + tuple(
            Surface(folder.absolute(), len(one.levels) - 1, one.color)
            for one in (labels if not facts.plan.channels else ())
            for folder in one.units
        ),
        boxes=tuple(boxes),
        frame=(tuple(corners[:, 0].min(axis=0)), tuple(corners[:, 1].max(axis=0))),
        size=_WHOLE_PX if tile is None else _TILE_PX,
    )


def level_in_picture(units: Sequence[UnitFacts], most: int) -> tuple[int, int]:
    """Return the level of detail of some units' surfaces in a picture, and k: 1 in k is drawn."""
    triangles = [[lod.triangles for lod in unit.lods] for unit in units]
    return choose_level(triangles, most) if triangles else (0, 1)


def _box_um(facts: Facts, tile: Tile) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the bounding box of a tile's mesh as two corners (x, y, z), world um."""
    lattice = tile.lattice(facts.plan.region)
    ends = [lattice.start, [end - 1 for end in lattice.stop]]
    corners = zyx_to_xyz([facts.plan.position_um(end) for end in ends])
    return tuple(corners.min(axis=0).tolist()), tuple(corners.max(axis=0).tolist())
