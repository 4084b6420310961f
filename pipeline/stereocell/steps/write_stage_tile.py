"""The task that writes one tile of the stage from its units."""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

from stereocell.engine.step import Keyed, content_of
from stereocell.model.channel import PaintColors
from stereocell.model.object_table import ObjectTable, SharedWalls
from stereocell.model.tile_content import ChannelContent, TileContent
from stereocell.steps.unit_files import (
    find_closed,
    is_whole,
    load_lods,
    load_measured,
    load_volume,
)
from stereocell.storage.file_list import FileList
from stereocell.storage.json_files import find_sealed, read_sealed, write_sealed
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
class WriteStageTile(Keyed):
    """The key of one tile of the stage: its fields are all that the tile depends on.

    content  the tile without its channels
    shared   IDs of the channels whose volume is another channel's: they have surfaces alone
    """

    VERSION: ClassVar[int] = 1

    content: TileContent
    units: tuple[UnitPart, ...]
    shared: frozenset[str] = frozenset()
    tables: tuple[TableOfTile, ...] = ()


@dataclass(frozen=True, slots=True)
class StageTile:
    """The task that writes one tile of the stage.

    place      the tile's record in OUT, which lists its files as they were written
    stage_dir  the folder with these files, where an artist may edit them
    """

    step: WriteStageTile
    place: Path
    stage_dir: Path

    @property
    def name(self) -> str:
        """The tile's ID, for progress and errors."""
        return self.step.content.id

    @property
    def inputs(self) -> list[Path]:
        """The folders of the tile's units."""
        return [unit.folder for unit in self.step.units]

    def is_whole(self) -> bool:
        """Return whether the tile and its units are whole, and its inputs are unchanged."""
        found = find_sealed(self.place, _RECORD)
        if found is None or found["key"] != self.step.key:
            return False
        folder = self.stage_dir / "tiles" / self.name
        are_whole = all(map(is_whole, self.inputs))
        return are_whole and written_files.is_kept(folder, found["files"], since=self.place)

    def keep(self) -> None:
        """Write the tile and its record. Raises OutputError where a unit is damaged."""
        files, measured = _write(self.step, self.stage_dir)
        record = {"key": self.step.key, "files": files, "measured_bytes": measured}
        write_sealed(self.place, record)

    def listed(self) -> tuple[FileList, int]:
        """Return the files of the finished tile, by their paths from the stage's folder, and the
        bytes of its voxels as measured.
        """
        found = read_sealed(self.place, _RECORD, written_files.REMEDY)
        files = {f"tiles/{self.name}/{name}": one for name, one in found["files"].items()}
        return files, found["measured_bytes"]


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


def _write(step: WriteStageTile, stage_dir: Path) -> tuple[FileList, int]:
    """Write a tile; return its files and the bytes of its voxels as measured."""
    tables = {one.labels_id: (one.table, one.touching) for one in step.tables}
    no_volume = step.shared | tables.keys()
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
    return stage_writer.write_tile(stage_dir, replace(step.content, channels=channels))
