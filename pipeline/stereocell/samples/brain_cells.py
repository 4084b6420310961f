"""The sample `brain-cells`: a crop of a light-sheet stack of a mouse brain (see its README.md)."""

from contextlib import ExitStack
from importlib.resources import files
from pathlib import Path

from stereocell.model.errors import UsageError
from stereocell.samples.place import is_there
from stereocell.storage.atomic_write import replacing

SUFFIX = ".ome.tif"
_FOLDER = files("stereocell.samples") / "brain-cells"


def write_brain_cells(path: Path) -> None:
    """Copy the sample to `path` (NAME.ome.tif), and its licence to NAME.LICENSE beside it.

    An existing equal sample stays. Raises UsageError for a name with another ending, OutputError if
    the path holds other content or can't be written.
    """
    if not path.name.endswith(SUFFIX) or path.name == SUFFIX:
        raise UsageError(f"{path}: the sample is an OME-TIFF, expected a name like NAME{SUFFIX}")
    licence = path.with_name(path.name.removesuffix(SUFFIX) + ".LICENSE")
    contents = {
        licence: (_FOLDER / "LICENSE").read_bytes(),
        path: (_FOLDER / "brain_cells.ome.tif").read_bytes(),
    }
    missing = [place for place, content in contents.items() if not is_there(place, content)]
    with ExitStack() as stack:
        for place in missing:
            stack.enter_context(replacing(place)).write_bytes(contents[place])
