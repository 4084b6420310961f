"""What a worker is given and does to write one tile of the stage from its units. Picklable.

The key of the stage holds this module's whole lineage: see lineage.py.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from stereocell.mirror import at_hand
from stereocell.plan import Plan
from stereocell.specimen import ChannelContent, PaintColors, TileContent
from stereocell.store import Store
from stereocell.tiling import Tile
from stereocell.unit_files import find_closed, load_lods, load_volume
from stereocell.write import usd


@dataclass(frozen=True, slots=True)
class TileTask:
    """content: the tile without its channels; units: id, unit folder and paint of each channel."""

    stage_dir: Path
    content: TileContent
    units: tuple[tuple[str, Path, PaintColors | None], ...]


def tile_task(store: Store, plan: Plan, index: Mapping[str, str], tile: Tile) -> TileTask:
    """Return the task of one tile; `index` holds the units' keys, by `<tile>/<channel>`."""
    units = tuple(
        (
            channel.id,
            store.unit_dir(tile.id, channel.id, index[f"{tile.id}/{channel.id}"]),
            None if painter is None else PaintColors(channel.color, painter.color),
        )
        for channel in plan.channels
        for painter in [plan.painter(channel)]
    )
    lattice = tile.lattice(plan.region)
    content = TileContent(
        id=tile.id,
        spacing_um=plan.spacing_um,
        first_um=plan.position_um(lattice.start),
        last_um=plan.position_um([end - 1 for end in lattice.stop]),
        own_shape=tile.box.shape,
        channels=(),
    )
    return TileTask(store.stage_dir, content, units)


def run_tile(task: TileTask) -> None:
    """Write one tile of the stage from its units. Raises OutputError."""
    with at_hand(*(folder for _, folder, _ in task.units)):
        channels = tuple(
            ChannelContent(
                channel_id, load_lods(folder), load_volume(folder), paint, find_closed(folder)
            )
            for channel_id, folder, paint in task.units
        )
        usd.write_tile(task.stage_dir, replace(task.content, channels=channels))
