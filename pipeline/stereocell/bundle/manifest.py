"""Read the manifest of a bundle. All commands that read it use this module.

The manifest holds a hash of itself and the hash of files.json, which holds the hashes of all other
files. So a bundle is undamaged if its manifest can be read here and each file has its hash.
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
# Paths that belong to a bundle or its viewer, in case files.json can't be read
_PATHS = re.compile(
    r"(channels|volumes|luts|assets|environments)/.*|manifest\.json|files\.json|specimen\.usdz|additions\.glb|room\.exr"
    r"|(index\.html|sw\.js)(\.br|\.gz)?|app\.webmanifest|icon[\w-]*\.(png|svg)"
)


def read_manifest(bundle: Path, remedy: str = REMEDY) -> dict[str, Any]:
    """Return the manifest of a bundle, without its hash.

    Raises OutputError if it is missing, violates its schema, or has changed since it was written.
    """
    return read_sealed(bundle / MANIFEST, SCHEMA, remedy)


def find_others(bundle: Path) -> list[str]:
    """Return the relative paths of files in a bundle's folder that do not belong to the bundle.

    The bundle's own files are those of files.json. If that is missing or damaged, they are known by
    their paths.
    """
    names = {path for path in sizes_of(bundle) if not is_ignored(path.rpartition("/")[2])}
    try:
        return sorted(names - read_list(bundle / FILES, "").keys() - {MANIFEST, FILES})
    except OutputError:
        return sorted(name for name in names if not _PATHS.fullmatch(name))


def require_bundle(place: Path) -> None:
    """Raise OutputError unless a path holds a bundle or nothing.

    A folder with a manifest is a bundle. Without a manifest, it may hold only a bundle's files.
    """
    is_other = place.exists() and not place.is_dir()
    if MANIFEST in sizes_of(place) or not (is_other or (others := find_others(place))):
        return
    words = "a file" if is_other else f"{words_for(others)}, but no {MANIFEST}"
    raise OutputError(
        f"{place}: found {words}, expected nothing or a bundle: {or_force('move it elsewhere')}"
    )
