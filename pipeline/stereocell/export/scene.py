"""Write the viewer and a bundle as one file, .html, at the finest levels that fit a limit of size.

The page runs from a disk (file://). Its policy forbids requests to any host. Each file of the
viewer and the bundle is a block of base64 in the document, as gzip if that is shorter. `scene.js`
answers the viewer's requests from these blocks.
"""

from collections.abc import Callable
from dataclasses import replace
from math import ceil
from pathlib import Path

from stereocell.bundle import blob_page
from stereocell.bundle.scene_blocks import FILE, PAGE, VIEW, block, view_block
from stereocell.export.scene_files import Levels, SceneFiles
from stereocell.model.errors import UsageError
from stereocell.storage.atomic_write import write_bytes

MAX_MB = 25.0  # millions of bytes, default for --max-mb
MB_BYTES = 1_000_000
_SCRIPT = Path(__file__).with_name("scene.js")
_LONGEST_VIEW = 16_000  # characters; the viewer's links have at most 8000


def write_scene(
    bundle: Path,
    file: Path,
    *,
    channels: tuple[str, ...] = (),
    max_mb: float = MAX_MB,
    view: str = "",
) -> str:
    """Write the scene of a bundle; return a sentence about its size and levels.

    channels  names or IDs of the channels; empty: all channels
    max_mb    largest size of the file, in millions of bytes
    view      link of the viewer to a view, or the part from `#` on; empty: the default view

    Raises UsageError if the coarsest levels are too large, and OutputError for a damaged bundle.
    """
    opening = view_block(_view_of(view))
    files = SceneFiles(bundle, channels)
    page = [block(PAGE, name, data, False) for name, data in blob_page.files().items()]

    def render(levels: Levels) -> bytes:
        blocks = [
            block(FILE, path, one.data, one.is_packed) for path, one in files.at(levels).items()
        ]
        return blob_page.document(_SCRIPT, "".join([opening, *page, *blocks])).encode()

    document, levels = _finest_that_fits(files, render, round(max_mb * MB_BYTES))
    write_bytes(file, document)
    return _about(files, levels, len(document))


def _finest_that_fits(
    files: SceneFiles, render: Callable[[Levels], bytes], most: int
) -> tuple[bytes, Levels]:
    """Return the finest document of at most `most` bytes, and its levels.

    The search starts with the coarsest levels. In each step, either surfaces or volumes become
    finer by one level: the kind whose next level is smaller. A kind stops when its next level does
    not fit.
    """
    levels = Levels(max(0, files.surface_levels - 1), max(0, files.volume_levels - 1))
    document = render(levels)
    if len(document) > most:
        raise UsageError(
            f"--max-mb is {most / MB_BYTES:g}, expected at least "
            f"{ceil(len(document) / MB_BYTES * 100) / 100:.2f}, as the page with the coarsest "
            "surfaces and volumes needs: raise it, or choose fewer --channels"
        )
    growing = [kind for kind in ("surfaces", "volumes") if getattr(levels, kind) > 0]
    while growing:
        finer = {kind: replace(levels, **{kind: getattr(levels, kind) - 1}) for kind in growing}
        least = {kind: files.least_bytes(one) for kind, one in finer.items()}
        kind = min(growing, key=least.__getitem__)
        tried = render(finer[kind]) if least[kind] * 4 // 3 <= most else None
        if tried is not None and len(tried) <= most:
            document, levels = tried, finer[kind]
        else:
            growing.remove(kind)
        growing = [kind for kind in growing if getattr(levels, kind) > 0]
    return document, levels


def _about(files: SceneFiles, levels: Levels, size: int) -> str:
    """Return a sentence about the size of a file, its levels, and the parts that were left out."""
    holds, out = [], []
    if files.surface_levels:
        holds.append(f"surfaces at lod{levels.surfaces}")
        out += _finer(levels.surfaces, "level", "of detail")
    if files.volume_levels:
        voxels = " x ".join(map(str, files.largest_volume(levels)))
        holds.append(f"volumes at resolution level {levels.volumes} (up to {voxels} voxels a tile)")
        out += _finer(levels.volumes, "resolution level", "of volumes")
    if files.has_usdz:
        out.append("specimen.usdz")
    left = f"left out: {', '.join(out)}" if out else "nothing left out"
    return f"{size / MB_BYTES:.2f} MB with {' and '.join(holds) or 'no surface'}; {left}"


def _finer(count: int, kind: str, of: str) -> list[str]:
    """Return a list with a text on the finer levels that were left out; empty if there are none."""
    return [f"{count} finer {kind}{'s' if count > 1 else ''} {of}"] if count else []


def _view_of(link: str) -> str:
    """Return the part of a link from `#` on. Raises UsageError if it is not a link to a view."""
    if not link:
        return ""
    view = link[link.find("#") :]
    if len(view) > _LONGEST_VIEW or not VIEW.fullmatch(view):
        raise UsageError(
            f"--view is {link[:80]!r}, expected a link from the viewer, with #v=1 in it"
        )
    return view
