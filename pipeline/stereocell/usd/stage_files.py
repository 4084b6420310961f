"""Find the files that a stage refers to: layers, also those of unselected variants, and assets."""

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

from pxr import Ar, Sdf, Tf, UsdUtils

from stereocell.model.errors import StageError
from stereocell.storage.location import Location, require_own


def dependencies(path: Path, stage_dir: Path) -> list[Path]:
    """Return every file of a stage: layers, also those of unselected variants, and assets.

    path       layer to open, which may be an artist's layer over a stage
    stage_dir  folder of the stage that the build wrote

    Only files in the folder of `path`, in `stage_dir` or below are opened. Raises StageError for a
    file outside them. Layers that can't be opened are not searched: `open_stage` reports them.
    """
    folders = [Location.of(path).folder, Location.of(stage_dir).folder]
    files, names, waiting = {path}, {str(path)}, [str(path)]
    quiet = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        while waiting:
            for asset, name in _named_in(waiting.pop()):
                # For a file inside a .usdz archive, `file` is the path of the archive.
                file = Path(Ar.SplitPackageRelativePathOuter(name)[0])
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
    """Return whether a file of a stage may be an image for a surface, or an archive with images.

    Layers hold no images, and .vdb and .exr files are volumes and transfer functions. `read_image`
    can't read .exr either.
    """
    return file.suffix.lower() not in (".usd", ".usda", ".usdc", ".vdb", ".exr")


def _named_in(name: str) -> Iterator[tuple[str, str]]:
    """Yield the files that a layer refers to: a name for messages, and the path that USD opens."""
    try:
        layer = Sdf.Layer.FindOrOpen(name)
        named = chain(*UsdUtils.ExtractExternalReferences(name)) if layer else ()
    except Tf.ErrorException:
        return
    # A stronger layer could give the expression variables other values, and so change paths.
    if layer and layer.expressionVariables:
        raise StageError(
            f"{name}: found expressionVariables, expected none, because they change paths: write "
            "plain paths"
        )
    for asset in named:
        path = Sdf.ComputeAssetPathRelativeToLayer(layer, Sdf.Layer.SplitIdentifier(asset)[0])
        found = str(Ar.GetResolver().Resolve(path))
        if found:
            yield f"{name}: {asset!r}", found
