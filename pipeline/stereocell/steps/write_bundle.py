"""The steps that write the bundle from the composed stage: first its tiles, then the rest."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from stereocell.bundle.manifest import require_bundle
from stereocell.bundle.tile_part import read_part
from stereocell.bundle.write import Composed, fill_bundle
from stereocell.bundle.write_tile import write_tile
from stereocell.engine.run_steps import Task
from stereocell.engine.step import Keyed, Work
from stereocell.model.errors import OutputError
from stereocell.storage.atomic_write import replacing_folder
from stereocell.usd.composed_appearance import ComposedAppearance
from stereocell.usd.typed_values import usd_boundary


@dataclass(frozen=True, slots=True)
class WriteBundle(Keyed):
    """Write the bundle.

    stage    path, size and time of each file of the stage; on object storage key, bytes and mark of
             each object
    page     path, size and time of each file of the viewer
    encoder  version of the package that encodes images; None: there is no image to encode
    """

    VERSION: ClassVar[int] = 7

    stage: tuple[object, ...]
    page: tuple[object, ...]
    encoder: str | None


@dataclass(frozen=True, slots=True)
class WriteBundleTile(Work):
    """Write one tile's part of a bundle. Workers do this for `WriteBundle`.

    A part has no key of its own. It lies in a folder named by the bundle's key, which is removed
    when the bundle is complete.

    stage        layer to export
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


@contextmanager
def opened_stage(stage: Path) -> Iterator[Composed]:
    """Yield a stage, or a layer over it, opened for export.

    Raises StageError, which names prim and file, if the stage lacks something or a file of it is
    damaged. Errors that USD raises inside the block become StageErrors.
    """
    with usd_boundary(stage):
        yield Composed.open(stage)


def bundle_tile_tasks(composed: Composed, parts: Path) -> list[Task]:
    """Return a task for each tile, which writes the tile's part into a folder in `parts`."""
    step = WriteBundleTile(composed.path, composed.appearances, composed.step_m)
    return [Task(tile_id, step, parts / tile_id) for tile_id in composed.tile_ids]


def write_bundle(
    composed: Composed, parts: Sequence[Path], bundle_dir: Path, viewer_dist: Path | None
) -> Iterator[str]:
    """Write the bundle over its finished tiles, in place of an older one, and yield notes.

    parts        folders of the tiles' parts; see `fill_bundle`
    viewer_dist  folder of the built viewer, which is copied into the bundle; None: no viewer

    Raises OutputError if `bundle_dir` can't be written, or holds something other than a bundle.
    """
    require_bundle(bundle_dir)
    if viewer_dist is not None and not (viewer_dist / "index.html").is_file():
        raise OutputError(f"{viewer_dist}: found no index.html, expected the built viewer")
    with replacing_folder(bundle_dir) as folder:
        yield from fill_bundle(composed, parts, folder, viewer_dist)
