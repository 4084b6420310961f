"""`stereocell.show`: show a build, a source or an array in a notebook.

Imports are lazy, so that `import stereocell` stays quick.
"""

import atexit
import io
import re
import shlex
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr
from filecmp import cmp
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stereocell.api import build
from stereocell.model.errors import UsageError
from stereocell.model.extra_packages import import_extra

if TYPE_CHECKING:
    from stereocell.notebook.arrays import ArraySource
    from stereocell.notebook.widget import Viewer

_MANIFEST = "manifest.json"
_QUALITIES = ("auto", "full")


def show(
    source: Any,
    *,
    spacing_um: Sequence[float] | None = None,
    channels: Sequence[str] | None = None,
    name: str = "",
    quality: str = "auto",
    out: str | Path | None = None,
    preset: str | None = None,
    settings: Mapping[str, Any] | None = None,
    force: bool = False,
    height: int = 520,
    **state: Any,
) -> "Viewer":
    """Show a build, a source or an array in Jupyter, JupyterLab, Colab, VS Code or marimo.

    source      OUT of a build, its bundle, a path that `build` reads, or an array (z, y, x) or
                (c, z, y, x) of numpy, dask, zarr or xarray
    spacing_um  voxel spacing (z, y, x), um; not needed if an xarray has coordinates
    channels    names of an array's channels; the channels to build of any other source
    name        name of an array's specimen
    quality     `auto` reduces a large array by averaging blocks of voxels; `full` uses all voxels
    out         folder that keeps the build of a source or an array; None for a temporary folder
                that is removed when Python ends
    preset, settings  preset and settings of the build, as for `stereocell.build`
    force       replace anything in `out`; without it, only a build of the same source or array
    height      height of the viewer, CSS pixels
    state       initial `link`, `channels`, `view` and `picked` of the viewer

    Returns a widget, which the last line of a cell displays. Its traits `channels`, `view`,
    `picked` and `link` follow the user's actions in the viewer, and may be set; see
    `stereocell.notebook.widget.Viewer`. Raises StereoCellError, whose text is one line.

    >>> import numpy as np
    >>> z, y, x = np.ogrid[-16:16:2, -16:16, -16:16]  # um
    >>> ball = (1000 / (1 + np.exp(np.sqrt(z**2 + y**2 + x**2) - 10))).astype(np.uint16)
    >>> viewer = show(ball, spacing_um=(2, 1, 1), channels=["DNA"], name="ball")
    >>> viewer.set_channel("DNA", color="#00ff00")  # the last line of a cell would be `viewer`
    >>> viewer.name, viewer.channels["DNA"]["color"]
    ('ball', '#00ff00')
    """
    import_extra("anywidget", extra="notebook", wanted_by="a notebook's viewer")
    from stereocell.bundle.blob_page import find_page
    from stereocell.notebook.arrays import is_array
    from stereocell.storage.location import Location
    from stereocell.storage.overwriting import IN_PYTHON, forcing

    if quality not in _QUALITIES:
        raise UsageError(f"quality is {quality!r:.40}, expected one of {', '.join(_QUALITIES)}")
    if unknown := sorted(state.keys() - {"link", "channels", "view", "picked"}):
        raise UsageError(f"show has no argument {unknown[0]!r:.40}")
    find_page()  # raise before the build if the viewer is missing
    if not is_array(source):
        if not isinstance(source, str | Path):
            raise UsageError(f"source is {source!r:.60}, expected an array or a path")
        Location.of(source)  # this refuses an empty path, which would mean the current folder
        if spacing_um is None and channels is None and (found := _find_bundle(Path(source))):
            return _viewer(*found, height=height, state=state)
    kept = None if out is None else Path(out)
    folder = kept or Path(tempfile.mkdtemp(prefix="stereocell-"))
    try:
        with forcing(force, IN_PYTHON):
            chosen, printed = _build(
                source,
                folder,
                spacing_um=spacing_um,
                channels=channels,
                name=name,
                is_full=quality == "full",
                preset=preset,
                settings=settings or {},
            )
        bundle = folder / "bundle"
        viewer = _viewer(bundle, folder, quality=chosen, notes=printed, height=height, state=state)
    except BaseException:
        if kept is None:
            shutil.rmtree(folder, ignore_errors=True)
        raise
    if kept is None:
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return viewer


def _find_bundle(path: Path) -> tuple[Path, Path | None] | None:
    """Return the folders of a bundle and of its OUT, if a path is one of them.

    Raises UsageError for a build that has no bundle.
    """
    if (path / "bundle" / _MANIFEST).is_file():
        return path / "bundle", path
    if (path / _MANIFEST).is_file() and (path / "files.json").is_file():
        return path, None
    if (path / "plan.json").is_file():
        raise UsageError(
            f"{path}: found a build without a bundle, expected {path / 'bundle' / _MANIFEST}: "
            f"run `stereocell bundle {shlex.quote(str(path))}` first"
        )
    return None


def _viewer(
    bundle: Path,
    out: Path | None,
    *,
    height: int,
    state: Mapping[str, Any],
    quality: str = "",
    notes: str = "",
) -> "Viewer":
    from stereocell.notebook.bundle_files import NotebookBundle
    from stereocell.notebook.picture import draw, no_picture
    from stereocell.notebook.widget import Viewer
    from stereocell.storage.shell_commands import filling_in

    with filling_in({} if out is None else {"OUT": str(out)}):
        files = NotebookBundle(bundle)
    viewer = Viewer(
        files,
        quality=quality,
        notes=notes,
        draw=no_picture if out is None else partial(draw, out),
        height=height,
    )
    for trait, value in state.items():
        setattr(viewer, trait, value)
    return viewer


def _build(
    source: Any,
    folder: Path,
    *,
    spacing_um: Sequence[float] | None,
    channels: Sequence[str] | None,
    name: str,
    is_full: bool,
    preset: str | None,
    settings: Mapping[str, Any],
) -> tuple[str, str]:
    """Build a source or an array in a folder; return a sentence on its quality, and the output."""
    from stereocell.notebook import arrays
    from stereocell.storage.overwriting import is_forced

    chosen = ""
    wanted = {
        section: dict(keys) if isinstance(keys, Mapping) else keys
        for section, keys in settings.items()
    }
    if arrays.is_array(source):
        given = arrays.as_source(source, spacing_um, channels)
        blocks = (1, 1, 1) if is_full else arrays.find_blocks(given)
        chosen = arrays.describe_quality(given, blocks)
        source = folder / f"{_file_name(name)}.ome.tif"
        _write_source(given, source, blocks)
    else:
        plan = wanted.setdefault("plan", {})
        if spacing_um is not None:
            plan["spacing_um"] = arrays.check_spacing(spacing_um)
        if channels is not None:
            plan["channels"] = tuple(channels)
    with _captured_output() as output:
        build(source, folder, preset=preset, settings=wanted, force=is_forced())
    return chosen, output.getvalue()


def _file_name(name: str) -> str:
    """Return the name of an array's file, without an ending. The build is named after its file."""
    return re.sub(r"[^\w .-]", "_", name)[:60].strip(" .") or "array"


def _write_source(given: "ArraySource", source: Path, blocks: tuple[int, int, int]) -> None:
    """Write an array into the folder of its build.

    Raises OutputError if the folder holds anything but a build of exactly this array.
    """
    from stereocell.building.out_folder import require_build_or_nothing
    from stereocell.notebook.arrays import write_source
    from stereocell.storage.atomic_write import replacing
    from stereocell.storage.contents import contents_of
    from stereocell.storage.kinds import Kind
    from stereocell.storage.overwriting import require_free

    expected = "nothing or a build of this array"
    require_build_or_nothing(source.parent, source)
    if contents_of(source.parent).kind is Kind.BUILD and not source.exists():
        require_free(source.parent, expected=expected)
    with replacing(source) as file:
        write_source(given, file, blocks)
        is_same = source.is_file() and cmp(file, source, shallow=False)
        require_free(source, expected=expected, is_ours=is_same)


@contextmanager
def _captured_output() -> Iterator[io.StringIO]:
    """Capture the text that a build prints, which a notebook would store among its outputs."""
    from stereocell.engine.run import console

    output = io.StringIO()
    before, console.is_jupyter = console.is_jupyter, False
    try:
        with redirect_stderr(output):
            yield output
    finally:
        console.is_jupyter = before
