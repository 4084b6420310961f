"""The manifest of a bundle, which holds a hash of itself: the one place where commands read it.

It names files.json, which names every other file. So whoever reads the manifest here knows that
the whole bundle can be trusted, wherever it lies, once each file fits its hash.
"""

import re
from pathlib import Path
from typing import Any

from stereocell.model.errors import OutputError
from stereocell.storage.contents import is_ignored, words_for
from stereocell.storage.file_list import read_list, sizes_of
from stereocell.storage.json_files import read_sealed
from stereocell.storage.overwriting import or_force

MANIFEST = "manifest.json"
FILES = "files.json"
SCHEMA = "bundle.schema.json"
REMEDY = "run `stereocell bundle OUT`"
# paths of the files that bundles have, where no list says which: its own, and those of the viewer
_PATHS = re.compile(
    r"(channels|volumes|luts|assets|environments)/.*|manifest\.json|files\.json|specimen\.usdz|additions\.glb|room\.exr"
    r"|(index\.html|sw\.js)(\.br|\.gz)?|app\.webmanifest|icon[\w-]*\.(png|svg)"
)


def read_manifest(bundle: Path, remedy: str = REMEDY) -> dict[str, Any]:
    """Return the manifest of a bundle, without its hash.

    Raises OutputError where it is missing, breaks its schema, or was changed since it was written.
    """
    return read_sealed(bundle / MANIFEST, SCHEMA, remedy)


def find_others(bundle: Path) -> list[str]:
    """Return the files in a bundle's folder that are none of its own, by their relative paths.

    Its list says which are its own; where that is lost or damaged, their paths do.
    """
    names = {path for path in sizes_of(bundle) if not is_ignored(path.rpartition("/")[2])}
    try:
        return sorted(names - read_list(bundle / FILES, "").keys() - {MANIFEST, FILES})
    except OutputError:
        return sorted(name for name in names if not _PATHS.fullmatch(name))


def require_bundle(place: Path) -> None:
    """Raise OutputError if something else than a bundle lies there. Its manifest may be lost."""
    is_other = place.exists() and not place.is_dir()
    if MANIFEST in sizes_of(place) or not (is_other or (others := find_others(place))):
        return
    words = "a file" if is_other else f"{words_for(others)}, and no {MANIFEST}"
    raise OutputError(
        f"{place}: exists and is no bundle: found {words}: {or_force('move it elsewhere')}"
    )
