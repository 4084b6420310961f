"""Copy the built viewer into a bundle."""

from pathlib import Path

from stereocell.bundle.manifest import FILES, MANIFEST
from stereocell.bundle.tile_part import FileRef, write_file
from stereocell.model.errors import OutputError


def copy_viewer(viewer_dist: Path, root: Path) -> list[FileRef]:
    """Copy the built viewer; return its files. Raises OutputError on a clash of names."""
    refs = []
    for source in sorted(viewer_dist.rglob("*")):
        if not source.is_file():
            continue
        path = source.relative_to(viewer_dist).as_posix()
        if path in (MANIFEST, FILES) or (root / path).exists():
            raise OutputError(f"{source}: the bundle has a {path} of its own")
        refs.append(write_file(root, path, source.read_bytes()))
    return refs
