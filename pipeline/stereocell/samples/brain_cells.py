"""The sample `brain-cells`: a crop of a light-sheet stack of a mouse brain (see its README.md)."""

import os
import shutil
from importlib.resources import as_file, files
from pathlib import Path

from stereocell.errors import OutputError, UsageError

SUFFIX = ".ome.tif"
_FOLDER = files("stereocell.samples") / "brain-cells"


def write_brain_cells(path: Path) -> None:
    """Copy the sample to `path` (NAME.ome.tif), its licence to NAME.LICENSE beside it.

    Where it is already, nothing is done. Raises UsageError for another kind of name, OutputError
    if something else lies there or it can't be written.
    """
    if not path.name.endswith(SUFFIX) or path.name == SUFFIX:
        raise UsageError(f"{path}: the sample is an OME-TIFF, expected a name like NAME{SUFFIX}")
    licence = path.with_name(path.name.removesuffix(SUFFIX) + ".LICENSE")
    for name, target in (("LICENSE", licence), ("brain_cells.ome.tif", path)):
        with as_file(_FOLDER / name) as source:
            _copy(source, target)


def _copy(source: Path, target: Path) -> None:
    try:
        if target.exists():
            if target.is_file() and target.read_bytes() == source.read_bytes():
                return
            raise OutputError(
                f"{target}: holds something else, expected nothing or this very sample: "
                "remove it or choose another name"
            )
        target.parent.mkdir(parents=True, exist_ok=True)
        temporary = target.with_name(f".{target.name}.{os.getpid()}")
        try:
            shutil.copyfile(source, temporary)
            os.replace(temporary, target)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{target}: can't be written: {error.strerror or error}") from error
