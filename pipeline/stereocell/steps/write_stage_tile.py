"""The step that writes one tile of the stage from its units."""

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

from stereocell.engine.step import Document, Step, content_of
from stereocell.model.channel import PaintColors
from stereocell.model.object_table import ObjectTable, SharedInterfaces
from stereocell.model.tile_content import ChannelContent, TileContent
from stereocell.steps.unit_files import (
    find_closed,
    is_whole,
    load_lods,
    load_voxels,
)
from stereocell.storage.file_list import FileList
from stereocell.usd import write_stage as stage_writer
from stereocell.usd import written_files


@dataclass(frozen=True, slots=True)
class UnitPart:
    """The unit of one channel in a tile.

    color  colour of the channel, linear RGB, 0..1
    paint  colours of its painted surface; None: it is not painted
    """

    channel_id: str
    folder: Path
    color: tuple[float, float, float]
    paint: PaintColors | None = None

    def key_content(self) -> list[object]:
        """Return the content for a key. The unit counts by its folder's name, which is its key."""
        return [self.channel_id, self.folder.name, self.color, content_of(self.paint)]


@dataclass(frozen=True, slots=True)
class TableOfTile:
    """The objects of a label map in a tile, and which of them touch."""

    labels_id: str
    table: ObjectTable
    touching: SharedInterfaces

    def key_content(self) -> list[object]:
        """Return the content for a key: digests of the table and of the interfaces."""
        return [self.labels_id, digest_of_table(self.table), _digest(self.touching)]


@dataclass(frozen=True, slots=True)
class StageTile:
    """The record of one tile of the stage.

    key             key of its step
    files           list of its files, by path relative to the tile's folder
    measured_bytes  bytes of its voxels as measured
    """

    key: str
    files: FileList
    measured_bytes: int


def _from_json(content: Mapping[str, Any]) -> StageTile:
    return StageTile(content["key"], content["files"], content["measured_bytes"])


@dataclass(frozen=True, slots=True)
class WriteStageTile(Step[StageTile]):
    """Write one tile of the stage. The result is a record of its files, beside the units.

    content    the tile without its channels
    has_vdb    whether the volumes are written for other programs, too
    shared     IDs of channels that only have a surface, because their volume is another channel's
    stage_dir  folder of the stage, where an artist may edit the tile's files
    """

    VERSION: ClassVar[int] = 3
    FORM: ClassVar[Document[StageTile]] = Document(
        "units.schema.json#StageTile", asdict, _from_json, written_files.REMEDY
    )

    content: TileContent
    units: tuple[UnitPart, ...]
    shared: frozenset[str] = frozenset()
    tables: tuple[TableOfTile, ...] = ()
    has_vdb: bool = True
    stage_dir: Path = field(kw_only=True, compare=False)

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The folders of the tile's units."""
        return tuple(unit.folder for unit in self.units)

    def is_whole(self, place: Path) -> bool:
        """Return whether the tile and its units are undamaged, and its inputs have not changed."""
        found = self.FORM.find(place)
        if found is None or found.key != self.key:
            return False
        folder = self.stage_dir / "tiles" / self.content.id
        are_whole = all(map(is_whole, self.inputs))
        return are_whole and written_files.is_kept(folder, found.files, since=place)

    def run(self) -> StageTile:
        """Write the tile. Raises OutputError if a unit is damaged."""
        tables = {one.labels_id: one for one in self.tables}
        channels = tuple(self._content_of(unit, tables.get(unit.channel_id)) for unit in self.units)
        content = replace(self.content, channels=channels)
        return StageTile(
            self.key, *stage_writer.write_tile(self.stage_dir, content, has_vdb=self.has_vdb)
        )

    def _content_of(self, unit: UnitPart, table: TableOfTile | None) -> ChannelContent:
        has_volume = table is None and unit.channel_id not in self.shared
        volume, measured = load_voxels(unit.folder) if has_volume else (None, None)
        return ChannelContent(
            unit.channel_id,
            load_lods(unit.folder),
            volume,
            unit.paint,
            find_closed(unit.folder),
            measured,
            table.table if table else None,
            table.touching if table else None,
            unit.color,
        )


def _digest(interfaces: SharedInterfaces) -> str:
    return hashlib.sha256(interfaces.labels.tobytes() + interfaces.area_um2.tobytes()).hexdigest()


def digest_of_table(table: ObjectTable) -> str:
    """Return a digest of the whole content of a table."""
    digest = hashlib.sha256(table.labels.tobytes() + table.boxes.tobytes())
    for rows in table.rows.values():
        digest.update(rows.tobytes())
    for column in table.columns:
        digest.update(repr([getattr(column, name) for name in _DESCRIBED]).encode())
        digest.update(column.values.tobytes())
    digest.update(repr((sorted(table.rows), table.names, table.default)).encode())
    return digest.hexdigest()


_DESCRIBED = ("id", "name", "about", "unit", "categories", "colors")
