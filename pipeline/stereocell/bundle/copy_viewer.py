"""Copy the built viewer into a bundle."""

from pathlib import Path

from stereocell.bundle.manifest import FILES, MANIFEST
from stereocell.bundle.tile_part import FileRef, write_file
from stereocell.model.errors import OutputError

# Files of the page of `stereocell serve --inbox`, which does not show a bundle
_INBOX = ("inbox.html", "inbox.html.br", "inbox.html.gz", "inbox_assets")


def copy_viewer(viewer_dist: Path, root: Path) -> list[FileRef]:
    """Copy the built viewer without the inbox page, and return its files.

    Raises OutputError if the bundle already has a file of the same name.
    """
    refs = []
    for source in sorted(viewer_dist.rglob("*")):
        inside = source.relative_to(viewer_dist)
        if not source.is_file() or inside.parts[0] in _INBOX:
            continue
        path = inside.as_posix()
        if path in (MANIFEST, FILES) or (root / path).exists():
            raise OutputError(
                f"{source}: found the name of a file of the bundle, {path}, expected another: "
                "rename the viewer's file"
            )
        refs.append(write_file(root, path, source.read_bytes()))
    return refs
