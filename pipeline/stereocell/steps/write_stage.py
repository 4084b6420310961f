"""The step that writes the stage over its tiles. The stage's phase runs it (see phases.py)."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from stereocell.engine.run import Engine
from stereocell.engine.step import Keyed
from stereocell.model.channel import Appearance
from stereocell.model.object_table import ObjectTable
from stereocell.model.spacing import Spacing
from stereocell.steps.write_stage_tile import WriteStageTile, digest_of_table
from stereocell.storage.file_list import FileList
from stereocell.usd.write_previews import PREVIEWS, write_previews
from stereocell.usd.write_stage import TileExtent, write_stage
from stereocell.usd.write_usdz import write_usdz
from stereocell.usd.written_files import (
    CONTENTS_NAME,
    DISPLAY_NAME,
    NVINDEX_NAME,
    STAGE_NAME,
    USDZ_NAME,
    AsWritten,
    write_list,
)


@dataclass(frozen=True, slots=True)
class Tables:
    """The tables of objects, by the ID of their label map."""

    of_labels: Mapping[str, ObjectTable]

    def key_content(self) -> dict[str, str]:
        """Return the content for a key: a digest of each table."""
        return {id_: digest_of_table(table) for id_, table in self.of_labels.items()}


@dataclass(frozen=True, slots=True)
class WriteStage(Keyed):
    """Write the layers that all tiles of a stage share.

    The fields are those of `usd.write_stage`.
    """

    VERSION: ClassVar[int] = 7

    name: str
    tiles: tuple[WriteStageTile, ...]
    spacing_um: Spacing
    appearances: tuple[Appearance, ...]
    provenance: Mapping[str, Any]
    modality: str
    placement: tuple[tuple[float, ...], ...]
    has_sides: bool
    opens_cut: bool
    tables: Tables

    def write(self, stage_dir: Path) -> str:
        """Write the layers of the stage and looks/ beside the tiles.

        Returns a line on the specimen's physical size.
        """
        extents = [
            TileExtent(tile.id, tile.first_um, tile.last_um, self.spacing_um)
            for tile in (step.content for step in self.tiles)
        ]
        return write_stage(
            stage_dir,
            self.name,
            appearances=self.appearances,
            tiles=extents,
            provenance=dict(self.provenance),
            modality=self.modality,
            placement=self.placement,
            has_sides=self.has_sides,
            opens_cut=self.opens_cut,
            tables=self.tables.of_labels,
        )

    def write_list(self, stage_dir: Path, tiles: FileList, engine: Engine) -> None:
        """Write specimen.usdz and the previews, and at last the list of all files.

        tiles   list of the tiles' files
        engine  workers that draw the previews
        """
        stage, small = stage_dir / STAGE_NAME, stage_dir / USDZ_NAME
        as_written = AsWritten({stage_dir.resolve(): tiles})
        write_usdz(stage, small, as_written=as_written)
        write_previews(stage_dir, as_written, partial(engine.run, "previews"))
        others = (
            stage_dir / name
            for name in ("looks", PREVIEWS, CONTENTS_NAME, DISPLAY_NAME, NVINDEX_NAME)
        )
        write_list(stage_dir, tiles, *others, stage, small)
