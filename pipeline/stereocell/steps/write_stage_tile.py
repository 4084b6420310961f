"""The step that writes one tile of the stage from its units."""

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

from stereocell.engine.run_steps import Task
from stereocell.engine.step import Document, Step, Work, content_of
from stereocell.model.channel import PaintColors
from stereocell.model.object_table import ObjectTable, SharedInterfaces
from stereocell.model.tile_content import ChannelContent, TileContent
from stereocell.steps.unit_files import (
    find_closed,
    is_whole,
    load_lods,
    load_voxels,
)
from stereocell.storage.atomic_write import replacing_folder
from stereocell.storage.file_list import FileList, find_faults
from stereocell.usd import written_files
from stereocell.usd.write_tile import Written, write_channel, write_tile

_RECORD = "part.json"  # record of a part


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

    def content(self, *, has_volume: bool) -> ChannelContent:
        """Return what the unit's folder holds. Raises OutputError if a file is damaged.

        has_volume  whether the voxels are loaded
        """
        volume, measured = load_voxels(self.folder) if has_volume else (None, None)
        return ChannelContent(
            self.channel_id,
            load_lods(self.folder),
            volume,
            self.paint,
            find_closed(self.folder),
            measured,
            color=self.color,
        )


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
    parts_dir  folder in which `part_tasks` wrote the channels' files; None: `run` writes them
    """

    VERSION: ClassVar[int] = 4
    FORM: ClassVar[Document[StageTile]] = Document(
        "units.schema.json#StageTile", asdict, _from_json, written_files.REMEDY
    )

    content: TileContent
    units: tuple[UnitPart, ...]
    shared: frozenset[str] = frozenset()
    tables: tuple[TableOfTile, ...] = ()
    has_vdb: bool = True
    stage_dir: Path = field(kw_only=True, compare=False)
    parts_dir: Path | None = field(default=None, kw_only=True, compare=False)

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The folders of the tile's units."""
        return tuple(unit.folder for unit in self.units)

    def part_tasks(self) -> list[Task]:
        """Return a task for each channel, which writes the channel's files as a part."""
        return [
            Task(
                f"{self.content.id}/{unit.channel_id}",
                WriteStagePart(self, unit),
                self._part_of(unit),
                (unit.folder,),
            )
            for unit in self.units
        ]

    def _part_of(self, unit: UnitPart) -> Path:
        assert self.parts_dir is not None
        return self.parts_dir / self.key / unit.channel_id

    def has_volume(self, unit: UnitPart) -> bool:
        """Return whether the tile has the volume of a unit."""
        is_labels = any(table.labels_id == unit.channel_id for table in self.tables)
        return not is_labels and unit.channel_id not in self.shared

    def is_whole(self, place: Path) -> bool:
        """Return whether the tile and its units are undamaged, and its inputs have not changed."""
        found = self.FORM.find(place)
        if found is None or found.key != self.key:
            return False
        folder = self.stage_dir / "tiles" / self.content.id
        are_whole = all(map(is_whole, self.inputs))
        return are_whole and written_files.is_kept(folder, found.files, since=place)

    def run(self) -> StageTile:
        """Write the tile. Raises OutputError if a unit or a part is damaged."""
        tables = {one.labels_id: one for one in self.tables}
        parts = None
        if self.parts_dir is not None:
            for task in self.part_tasks():
                if not task.is_whole():  # its files were moved when this step ran before, and died
                    task.step.keep(task.place)
            places = [self._part_of(unit) for unit in self.units]
            parts = {place: _written(self.FORM.read(place / _RECORD)) for place in places}
        channels = []
        for unit in self.units:
            # voxels lie in the parts already
            one = unit.content(has_volume=parts is None and self.has_volume(unit))
            if (table := tables.get(unit.channel_id)) is not None:
                one = replace(one, objects=table.table, touching=table.touching)
            channels.append(one)
        content = replace(self.content, channels=tuple(channels))
        written = write_tile(self.stage_dir, content, has_vdb=self.has_vdb, parts=parts)
        return StageTile(self.key, written.files, written.measured_bytes)


@dataclass(frozen=True, slots=True)
class WriteStagePart(Work):
    """Write the files of one channel of a tile. Workers do this for `WriteStageTile`.

    A part has no key of its own. It lies in a folder named by the tile's key, which is removed when
    the stage is complete. Its record has the form of the tile's.
    """

    tile: WriteStageTile
    unit: UnitPart

    def is_whole(self, place: Path) -> bool:
        """Return whether all files of the part lie at a place."""
        found = WriteStageTile.FORM.find(place / _RECORD)
        if found is None or found.key != self.tile.key:
            return False
        return not find_faults(place, found.files, since=place / _RECORD)

    def keep(self, place: Path) -> None:
        """Write the part. Raises OutputError."""
        tile = self.tile
        channel = self.unit.content(has_volume=tile.has_volume(self.unit))
        with replacing_folder(place) as folder:
            written = write_channel(folder, tile.content, channel, has_vdb=tile.has_vdb)
            record = StageTile(tile.key, written.files, written.measured_bytes)
            WriteStageTile.FORM.write(folder / _RECORD, record)


def _written(part: StageTile) -> Written:
    return Written(part.files, part.measured_bytes)


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
