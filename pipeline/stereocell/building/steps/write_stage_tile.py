"""The task of a worker that writes one tile of the stage from its units. Picklable.

The keys of the stage and of its tiles cover this module's whole lineage: see storage/cache_key.py.
"""

import hashlib
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from stereocell.building.out_folder import OutFolder
from stereocell.building.plan import Plan
from stereocell.building.unit_files import (
    find_closed,
    is_whole,
    load_lods,
    load_measured,
    load_volume,
)
from stereocell.formats.vdb import MEASURED_NAME
from stereocell.formats.vdb_read import read_vdb_head
from stereocell.model.channel import PaintColors
from stereocell.model.object_table import ObjectTable, SharedWalls
from stereocell.model.tile_content import ChannelContent, TileContent
from stereocell.model.tiling import Tile
from stereocell.storage.cache_key import key_of
from stereocell.storage.file_list import FileList
from stereocell.storage.json_files import find_sealed, read_sealed, write_sealed
from stereocell.storage.workspace import cached, remove
from stereocell.usd import write_stage as stage_writer
from stereocell.usd import written_files

_RECORD = "units.schema.json#StageTile"


@dataclass(frozen=True, slots=True)
class TileTask:
    """One tile of the stage.

    content  the tile without its channels
    units    ID, unit folder and sampled colours of each channel
    shared   IDs of those whose volume is another channel's: they have surfaces alone
    tables   of the tile's objects: the ID of their label map, and which ones touch
    record   units/<tile>/stage.json: the key of the tile as written, and its files
    key      digest of the inputs of the tile to write
    """

    stage_dir: Path
    content: TileContent
    units: tuple[tuple[str, Path, PaintColors | None], ...]
    record: Path
    key: str
    shared: frozenset[str] = frozenset()
    tables: tuple[tuple[str, ObjectTable, SharedWalls], ...] = ()

    @property
    def folder(self) -> Path:
        """The folder of the tile in the stage."""
        return self.stage_dir / "tiles" / self.content.id

    def is_done(self) -> bool:
        """Return whether the tile and its units are whole, and its inputs are unchanged."""
        found = find_sealed(self.record, _RECORD)
        if found is None or found["key"] != self.key:
            return False
        are_whole = all(is_whole(folder) for _, folder, _ in self.units)
        return are_whole and written_files.is_kept(self.folder, found["files"], since=self.record)

    def listed(self) -> tuple[FileList, int]:
        """Return the files of a finished tile, by their paths from the stage's folder, and the
        bytes of its voxels as measured.
        """
        found = read_sealed(self.record, _RECORD, written_files.REMEDY)
        files = {f"tiles/{self.content.id}/{name}": one for name, one in found["files"].items()}
        return files, found["measured_bytes"]


def tile_task(
    out_folder: OutFolder,
    plan: Plan,
    *,
    index: Mapping[str, str],
    tile: Tile,
    tables: Mapping[str, ObjectTable],
) -> TileTask:
    """Return the task of one tile.

    index   the units' keys, by `<tile>/<channel>`
    tables  of all objects, by the ID of their label map
    """
    units = tuple(
        (
            channel.id,
            out_folder.unit_dir(tile.id, channel.id, index[f"{tile.id}/{channel.id}"]),
            None if painter is None else PaintColors(channel.color, painter.color),
        )
        for channel in plan.channels
        for painter in [plan.painter(channel)]
    )
    units += tuple(
        (labels.id, out_folder.unit_dir(tile.id, labels.id, index[f"{tile.id}/{labels.id}"]), None)
        for labels in plan.labels
    )
    own = tuple(
        (id_, table.of_tile(tile.id), table.touching(tile.id)) for id_, table in tables.items()
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
    made_of = [(channel_id, folder.name, paint) for channel_id, folder, paint in units]
    shared = plan.shared_volumes
    depends = [
        asdict(content),
        [(*one, paint and asdict(paint)) for *one, paint in made_of],
        sorted(shared),
        [(id_, digest_of_table(table), _digest(touching)) for id_, table, touching in own],
    ]
    key = key_of(depends, sys.modules[__name__])
    record = out_folder.tile_file(tile.id)
    return TileTask(out_folder.stage_dir, content, units, record, key, shared, own)


def _digest(walls: SharedWalls) -> str:
    return hashlib.sha256(walls.labels.tobytes() + walls.area_um2.tobytes()).hexdigest()


def digest_of_table(table: ObjectTable) -> str:
    """Return a digest of all that a table holds."""
    digest = hashlib.sha256(table.labels.tobytes() + table.boxes.tobytes())
    for rows in table.rows.values():
        digest.update(rows.tobytes())
    for column in table.columns:
        digest.update(repr([getattr(column, name) for name in _DESCRIBED]).encode())
        digest.update(column.values.tobytes())
    digest.update(repr((sorted(table.rows), table.names, table.default)).encode())
    return digest.hexdigest()


_DESCRIBED = ("id", "name", "about", "unit", "categories", "colors")


def run_tile(task: TileTask) -> None:
    """Write one tile of the stage from its units. Raises OutputError where one is damaged."""
    remove(task.record)
    tables = {id_: (table, touching) for id_, table, touching in task.tables}
    no_volume = task.shared | tables.keys()
    with cached(*(folder for _, folder, _ in task.units)):
        channels = tuple(
            ChannelContent(
                channel_id,
                load_lods(folder),
                None if channel_id in no_volume else load_volume(folder),
                paint,
                find_closed(folder),
                None if channel_id in no_volume else load_measured(folder),
                *tables.get(channel_id, (None, None)),
            )
            for channel_id, folder, paint in task.units
        )
        files = stage_writer.write_tile(task.stage_dir, replace(task.content, channels=channels))
        grids = [grid for file in task.folder.glob("*.vdb") for grid in read_vdb_head(file)]
    measured = sum(grid.end - grid.start for grid in grids if grid.name == MEASURED_NAME)
    write_sealed(task.record, {"key": task.key, "files": files, "measured_bytes": measured})
