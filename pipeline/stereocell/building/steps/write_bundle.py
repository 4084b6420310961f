"""The step that writes the bundle from the composed stage. The bundle's phase runs it."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from stereocell.building.out_folder import OutFolder
from stereocell.bundle.write import Run, write_bundle
from stereocell.engine.run import console
from stereocell.engine.step import Step


@dataclass(frozen=True, slots=True)
class WriteBundle(Step[None]):
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

    def write(self, out_folder: OutFolder, stage: Path, viewer: Path | None, run: Run) -> None:
        """Write OUT/bundle; its finished tiles are kept until it is whole.

        stage   the layer to export
        viewer  the folder of the page; None: the bundle has none
        run     runs tasks, as `Engine.run`
        """
        out_folder.remove_other_folders(out_folder.parts_dir, {self.key})
        write_bundle(
            stage,
            out_folder.bundle_dir,
            viewer,
            run=run,
            parts=out_folder.parts_dir / self.key,
            report_line=_print_line,
        )


def _print_line(line: str) -> None:
    console.print(f"bundle: {line}", markup=False, soft_wrap=True)
