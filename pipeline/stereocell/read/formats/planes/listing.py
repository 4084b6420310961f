"""List the images in a folder: those that are planes, and those that are left out."""

import os

from stereocell.model.counted import agreeing, counted
from stereocell.read.formats.planes.endings import BMP, JPEG, PNG, TIFF
from stereocell.read.formats.planes.files import join
from stereocell.storage.location import Location, require_own

_KINDS = {"TIFF": TIFF, "PNG": PNG, "JPEG": JPEG, "BMP": BMP}


def list_images(location: Location) -> list[str]:
    """Return the images in the folder and below, relative to it, with `/`. Raises SourceError."""
    root = location.source
    found = []
    for at, folders, names in os.walk(root):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in names:
            if name.lower().endswith(TIFF + PNG + JPEG + BMP) and not name.startswith("."):
                found.append(os.path.relpath(os.path.join(at, name), root).replace(os.sep, "/"))
    for path in found:
        named = f"{location.shown}: {path!r:.200}"
        require_own(join(root, path), [location.folder], named=named)
    return found


def of_one_kind(found: list[str]) -> tuple[list[str], list[str]]:
    """Return the files on which the guess is based, and notes on the others.

    Images in the folder itself take precedence over those in folders below, the commonest kind over
    others, and planes over thumbnails and over MetaXpress's projections (`ZStep_0`).
    """
    notes = []
    top = [path for path in found if "/" not in path]
    if any("zstep_" in path.lower().rpartition("/")[0] for path in found):
        top = []  # MetaXpress stores projections in the folder and planes below it
    paths = top or found
    if top and len(top) < len(found):
        notes.append(f"{counted(len(found) - len(top), 'image')} in folders below left out")
    by_kind = {
        kind: [path for path in paths if path.lower().endswith(suffixes)]
        for kind, suffixes in _KINDS.items()
    }
    kind = max(by_kind, key=lambda one: len(by_kind[one]))  # the first of equally common ones
    if len(by_kind[kind]) < len(paths):
        count = len(by_kind[kind])
        notes.append(
            f"images of several kinds: {counted(count, kind, kind)} "
            f"{agreeing(count, 'is', 'are')} read, "
            f"{counted(len(paths) - len(by_kind[kind]), 'other')} left out"
        )
    paths = by_kind[kind]
    for is_other, noun in ((_is_thumb, "thumbnail"), (_is_projection, "projection")):
        kept = [path for path in paths if not is_other(path)]
        if kept and len(kept) < len(paths):
            notes.append(f"{counted(len(paths) - len(kept), noun)} left out")
            paths = kept
    return paths, notes


def _is_thumb(path: str) -> bool:
    return "_thumb" in path.rpartition("/")[2].lower()


def _is_projection(path: str) -> bool:
    return "zstep_0/" in f"/{path.lower()}"
