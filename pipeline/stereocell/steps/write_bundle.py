"""The steps that write the bundle from the composed stage: its tiles, then the whole."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from stereocell.bundle.manifest import require_bundle
from stereocell.bundle.tile_part import read_part
from stereocell.bundle.write import Composed, fill_bundle
from stereocell.bundle.write_tile import write_tile
from stereocell.engine.run import Engine
from stereocell.engine.run_steps import Task, run_missing
from stereocell.engine.step import Keyed, Work
from stereocell.model.errors import OutputError
from stereocell.storage.atomic_write import replacing_folder
from stereocell.usd.composed_appearance import ComposedAppearance
from stereocell.usd.typed_values import usd_boundary


@dataclass(frozen=True, slots=True)
class WriteBundle(Keyed):
    """Write the bundle.

    stage    path, size and time of each file that the stage consists of; of one on object storage
             key, bytes and mark of each object
    page     the same of the viewer's files
    encoder  version of the package that encodes images; None: there is no image to encode
    """

    VERSION: ClassVar[int] = 1

    stage: tuple[object, ...]
    page: tuple[object, ...]
    encoder: str | None


@dataclass(frozen=True, slots=True)
class WriteBundleTile(Work):
    """Write the part of a bundle that one tile brings: the work of workers for `WriteBundle`.

    A part has no key of its own. It lies in a folder that the bundle's key names, and is removed
    with it when the bundle is whole.

    stage        the layer to export
    appearances  see `Composed`
    step_m       see `Composed`
    """

    stage: Path
    appearances: tuple[ComposedAppearance, ...]
    step_m: float

    def is_whole(self, place: Path) -> bool:
        """Return whether all files of the part lie at a place."""
        try:
            read_part(place)
        except OutputError:
            return False
        return True

    def keep(self, place: Path) -> None:
        """Write the part. Raises StageError and OutputError."""
        write_tile(self.stage, place, appearances=self.appearances, step_m=self.step_m)


def write_bundle(
    stage: Path,
    bundle_dir: Path,
    viewer_dist: Path | None,
    *,
    engine: Engine,
    parts: Path | None = None,
    report_line: Callable[[str], None] = lambda _: None,
) -> None:
    """Write the bundle of a stage, or of a layer over it, in place of an older one.

    viewer_dist  the built viewer, copied into the bundle; None: no viewer
    engine       the workers, which share the tiles; the bytes don't depend on their number
    parts        a folder for finished tiles, named by the key of the bundle's step: those that are
                 in it are taken, and all are left there; None: none are kept if this fails
    report_line  is given a line on each layer that is not as it was written, on each surface that
                 was edited by hand, on each material that is bound above the channels, and on units
                 that the layer does not state

    Raises StageError where the stage lacks something or a file of it is damaged, naming prim and
    file (TasksFailedError where a tile does); OutputError where `bundle_dir` can't be written, or
    is something else.
    """
    require_bundle(bundle_dir)
    if viewer_dist is not None and not (viewer_dist / "index.html").is_file():
        raise OutputError(f"{viewer_dist}: no index.html, expected the built viewer")
    with usd_boundary(stage), replacing_folder(bundle_dir) as folder:
        composed = Composed.open(stage)
        for note in composed.notes():
            report_line(note)
        parts = parts or folder / ".parts"
        tiles = [_tile_task(composed, parts / tile_id) for tile_id in composed.tile_ids]
        run_missing(engine, "bundle", tiles)
        for note in fill_bundle(composed, [tile.place for tile in tiles], folder, viewer_dist):
            report_line(note)
        shutil.rmtree(folder / ".parts", ignore_errors=True)


def _tile_task(composed: Composed, part: Path) -> Task:
    """Return the task that writes a tile's part into a folder of the tile's name."""
    step = WriteBundleTile(composed.path, composed.appearances, composed.step_m)
    return Task(part.name, step, part)
