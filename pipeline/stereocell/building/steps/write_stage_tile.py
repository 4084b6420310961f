"""The step that writes one tile of the stage from its units."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

from stereocell.building.out_folder import OutFolder
from stereocell.building.plan import Plan
from stereocell.building.unit_files import (
    find_closed,
    is_whole,
    load_lods,
    load_measured,
    load_volume,
)
from stereocell.engine.step import Step, content_of
from stereocell.formats.vdb import MEASURED_NAME
from stereocell.formats.vdb_read import read_vdb_head
from stereocell.model.channel import PaintColors
from stereocell.model.object_table import ObjectTable, SharedWalls
from stereocell.model.tile_content import ChannelContent, TileContent
from stereocell.model.tiling import Tile
from stereocell.storage.file_list import FileList
from stereocell.storage.json_files import find_sealed, read_sealed, write_sealed
from stereocell.storage.workspace import cached, remove
from stereocell.usd import write_stage as stage_writer
from stereocell.usd import written_files

_RECORD = "units.schema.json#StageTile"


@dataclass(frozen=True, slots=True)
class UnitPart:
    """The unit of one channel in a tile; `paint`: the colours of its surface, if it is painted."""

    channel_id: str
    folder: Path
    paint: PaintColors | None = None

    def key_content(self) -> list[object]:
        """Return what counts in a key: a unit's folder is named by its key."""
        return [self.channel_id, self.folder.name, content_of(self.paint)]


@dataclass(frozen=True, slots=True)
class TableOfTile:
    """The objects of a label map in a tile, and which of them touch."""

    labels_id: str
    table: ObjectTable
    touching: SharedWalls

    def key_content(self) -> list[object]:
        """Return what counts in a key: digests of both."""
        return [self.labels_id, digest_of_table(self.table), _digest(self.touching)]


@dataclass(frozen=True, slots=True)
class WriteStageTile(Step[FileList]):
    """Write one tile of the stage.

    Its place is the tile's record in OUT, which lists the files as they were written: OUT/stage
    holds these, and an artist may edit them there.

    content  the tile without its channels
    shared   IDs of the channels whose volume is another channel's: they have surfaces alone
    """

    VERSION: ClassVar[int] = 1

    content: TileContent
    units: tuple[UnitPart, ...]
    shared: frozenset[str] = frozenset()
    tables: tuple[TableOfTile, ...] = ()

    def is_kept(self, place: Path) -> bool:
        """Return whether the tile and its units are whole, and its inputs are unchanged."""
        found = find_sealed(place, _RECORD)
        if found is None or found["key"] != self.key:
            return False
        are_whole = all(is_whole(unit.folder) for unit in self.units)
        folder = _stage_of(place) / "tiles" / self.content.id
        return are_whole and written_files.is_kept(folder, found["files"], since=place)

    def keep(self, place: Path) -> None:
        """Write the tile and its record. Raises OutputError where a unit is damaged."""
        remove(place)
        files, measured = _write(self, _stage_of(place))
        write_sealed(place, {"key": self.key, "files": files, "measured_bytes": measured})

    def listed(self, place: Path) -> tuple[FileList, int]:
        """Return the files of the finished tile, by their paths from the stage's folder, and the
        bytes of its voxels as measured.
        """
        found = read_sealed(place, _RECORD, written_files.REMEDY)
        files = {f"tiles/{self.content.id}/{name}": one for name, one in found["files"].items()}
        return files, found["measured_bytes"]


def stage_tile_step(
    out_folder: OutFolder,
    plan: Plan,
    *,
    index: Mapping[str, str],
    tile: Tile,
    tables: Mapping[str, ObjectTable],
) -> WriteStageTile:
    """Return the step of one tile.

    index   the units' keys, by `<tile>/<channel>`
    tables  of all objects, by the ID of their label map
    """

    def part(channel_id: str, paint: PaintColors | None = None) -> UnitPart:
        name = f"{tile.id}/{channel_id}"
        return UnitPart(channel_id, out_folder.unit_dir(name, index[name]), paint)

    units = [
        part(channel.id, PaintColors(channel.color, painter.color) if painter else None)
        for channel in plan.channels
        for painter in [plan.painter(channel)]
    ]
    lattice = tile.lattice(plan.region)
    content = TileContent(
        id=tile.id,
        spacing_um=plan.spacing_um,
        first_um=plan.position_um(lattice.start),
        last_um=plan.position_um([end - 1 for end in lattice.stop]),
        own_shape=tile.box.shape,
        channels=(),
    )
    own = tuple(
        TableOfTile(id_, table.of_tile(tile.id), table.touching(tile.id))
        for id_, table in tables.items()
    )
    units += [part(labels.id) for labels in plan.labels]
    return WriteStageTile(content, tuple(units), plan.shared_volumes, own)


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


def _stage_of(place: Path) -> Path:
    """Return the folder of the stage, of the record of a tile: OUT/units/<tile>/stage.json."""
    return OutFolder(place.parents[2]).stage_dir


def _write(step: WriteStageTile, stage_dir: Path) -> tuple[FileList, int]:
    """Write a tile; return its files and the bytes of its voxels as measured."""
    tables = {one.labels_id: (one.table, one.touching) for one in step.tables}
    no_volume = step.shared | tables.keys()
    with cached(*(unit.folder for unit in step.units)):
        channels = tuple(
            ChannelContent(
                unit.channel_id,
                load_lods(unit.folder),
                None if unit.channel_id in no_volume else load_volume(unit.folder),
                unit.paint,
                find_closed(unit.folder),
                None if unit.channel_id in no_volume else load_measured(unit.folder),
                *tables.get(unit.channel_id, (None, None)),
            )
            for unit in step.units
        )
        files = stage_writer.write_tile(stage_dir, replace(step.content, channels=channels))
        folder = stage_dir / "tiles" / step.content.id
        grids = [grid for file in folder.glob("*.vdb") for grid in read_vdb_head(file)]
    return files, sum(grid.end - grid.start for grid in grids if grid.name == MEASURED_NAME)
