"""The step that writes the bundle from the composed stage. The bundle's phase runs it."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from stereocell.bundle.write import Run, write_bundle
from stereocell.engine.run import console
from stereocell.engine.step import Keyed


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

    def write(
        self, bundle_dir: Path, stage: Path, viewer: Path | None, *, parts: Path, run: Run
    ) -> None:
        """Write the bundle into a folder.

        stage   the layer to export
        parts   a folder that keeps finished tiles until the bundle is whole
        viewer  the folder of the page; None: the bundle has none
        run     runs tasks, as `Engine.run`
        """
        write_bundle(
            stage,
            bundle_dir,
            viewer,
            run=run,
            parts=parts,
            report_line=_print_line,
        )


def _print_line(line: str) -> None:
    console.print(f"bundle: {line}", markup=False, soft_wrap=True)
