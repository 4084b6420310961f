"""The files that a stage names: its layers, selected or not, and its assets."""

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

from pxr import Ar, Sdf, Tf, UsdUtils

from stereocell.model.errors import StageError
from stereocell.storage.location import Location, require_own


def dependencies(path: Path, stage_dir: Path) -> list[Path]:
    """Return every file of a stage: layers, including unselected ones, and assets.

    path       the stage's layer; `stage_dir` is the folder of the stage below it

    Only files in the folder of `path`, in `stage_dir` or below are opened. Raises StageError for a
    file outside them. Files that can't be opened are skipped: `open_stage` reports them.
    """
    folders = [Location.of(path).folder, Location.of(stage_dir).folder]
    files, names, waiting = {path}, {str(path)}, [str(path)]
    quiet = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        while waiting:
            for asset, name in _named_in(waiting.pop()):
                file = Path(Ar.SplitPackageRelativePathOuter(name)[0])  # of an entry: its .usdz
                if name in names or not require_own(file, folders, named=asset, raised=StageError):
                    continue
                files.add(file)
                names.add(name)
                if Sdf.FileFormat.FindByExtension(name) is not None:
                    waiting.append(name)
    finally:
        del quiet
    return sorted(file for file in files if file.is_file())


def may_be_image(file: Path) -> bool:
    """Return whether a file of a stage may be, or hold, an image that feeds a surface.

    Layers hold none, .vdb and .exr are volumes and transfer functions, and `read_image` reads no
    .exr.
    """
    return file.suffix.lower() not in (".usd", ".usda", ".usdc", ".vdb", ".exr")


def _named_in(name: str) -> Iterator[tuple[str, str]]:
    """Yield the references of one layer: their names for messages, and the paths that USD opens."""
    try:
        layer = Sdf.Layer.FindOrOpen(name)
        named = chain(*UsdUtils.ExtractExternalReferences(name)) if layer else ()
    except Tf.ErrorException:
        return
    if layer and layer.expressionVariables:  # layers above can change the paths
        raise StageError(f"{name}: expressionVariables: found some, expected paths without them")
    for asset in named:
        path = Sdf.ComputeAssetPathRelativeToLayer(layer, Sdf.Layer.SplitIdentifier(asset)[0])
        found = str(Ar.GetResolver().Resolve(path))
        if found:
            yield f"{name}: {asset!r}", found
