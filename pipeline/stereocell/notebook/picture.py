"""A picture of a build, for a notebook that no browser has opened: drawn as the report draws."""

import tempfile
from pathlib import Path

from stereocell.building.out_folder import OutFolder
from stereocell.export.chosen import Chosen
from stereocell.export.options import ExportOptions
from stereocell.export.pictures import write_picture
from stereocell.model.errors import StageError

_WIDTH = 800  # pixels
_TRIANGLES = 100_000  # more take seconds, and show no finer


def draw(out: Path) -> bytes:
    """Return a PNG of OUT's surfaces; empty where there are none: the viewer draws volumes."""
    options = ExportOptions(width=_WIDTH)
    with tempfile.TemporaryDirectory(prefix="stereocell-") as folder:
        file = Path(folder) / "picture.png"
        try:
            chosen = Chosen(OutFolder(out).stage_file, options, lambda _: None)
            write_picture(chosen, file, chosen.levels(_TRIANGLES)[0])
        except StageError:
            return b""
        return file.read_bytes()
