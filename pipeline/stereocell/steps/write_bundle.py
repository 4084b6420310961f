"""The steps that write the bundle from the composed stage: first its parts, then the rest."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from stereocell.bundle.manifest import require_bundle
from stereocell.bundle.tile_part import part_of, read_part
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

    VERSION: ClassVar[int] = 8

    stage: tuple[object, ...]
    page: tuple[object, ...]
    encoder: str | None


@dataclass(frozen=True, slots=True)
class WriteBundlePart(Work):
    """Write the part of a bundle for one channel of a tile. Workers do this for `WriteBundle`.

    A part has no key of its own. It lies in a folder named by the bundle's key, which is removed
    when the bundle is complete.

    stage        layer to export
    appearances  see `Composed`
    step_m       see `Composed`
    """

    stage: Path
    tile_id: str
    channel_id: str
    appearances: tuple[ComposedAppearance, ...]
    step_m: float

    def is_whole(self, place: Path) -> bool:
        """Return whether all files of the part lie at a place."""
        try:
            part = read_part(place, self.tile_id)
        except OutputError:
            return False
        return [channel.channel_id for channel in part.channels] == [self.channel_id]

    def keep(self, place: Path) -> None:
        """Write the part. Raises StageError and OutputError."""
        write_tile(
            self.stage,
            self.tile_id,
            place,
            appearances=self.appearances,
            step_m=self.step_m,
            only=self.channel_id,
        )


@contextmanager
def opened_stage(stage: Path) -> Iterator[Composed]:
    """Yield a stage, or a layer over it, opened for export.

    Raises StageError, which names prim and file, if the stage lacks something or a file of it is
    damaged. Errors that USD raises inside the block become StageErrors.
    """
    with usd_boundary(stage):
        yield Composed.open(stage)


def bundle_part_tasks(composed: Composed, parts: Path) -> list[Task]:
    """Return a task for each channel of each tile, which writes their part into `parts`."""
    looks, step_m = composed.appearances, composed.step_m
    return [
        Task(
            f"{tile_id}/{look.id}",
            WriteBundlePart(composed.path, tile_id, look.id, looks, step_m),
            part_of(parts, tile_id, look.id),
        )
        for tile_id in composed.tile_ids
        for look in looks
    ]


def write_bundle(
    composed: Composed, parts: Path, bundle_dir: Path, viewer_dist: Path | None
) -> Iterator[str]:
    """Write the bundle over its finished parts, in place of an older one, and yield notes.

    parts        folder of the parts; see `fill_bundle`
    viewer_dist  folder of the built viewer, which is copied into the bundle; None: no viewer

    Raises OutputError if `bundle_dir` can't be written, or holds something other than a bundle.
    """
    require_bundle(bundle_dir)
    if viewer_dist is not None and not (viewer_dist / "index.html").is_file():
        raise OutputError(f"{viewer_dist}: found no index.html, expected the built viewer")
    with replacing_folder(bundle_dir) as folder:
        yield from fill_bundle(composed, parts, folder, viewer_dist)
