"""The manifest of a bundle, which holds a hash of itself: the one place where commands read it.

It names files.json, which names every other file. So whoever reads the manifest here knows that
the whole bundle can be trusted, wherever it lies, once each file fits its hash.
"""

from pathlib import Path
from typing import Any

from stereocell.storage.json_files import read_sealed

MANIFEST = "manifest.json"
FILES = "files.json"
SCHEMA = "bundle.schema.json"
REMEDY = "run `stereocell bundle OUT`"


def read_manifest(bundle: Path, remedy: str = REMEDY) -> dict[str, Any]:
    """Return the manifest of a bundle, without its hash.

    Raises OutputError where it is missing, breaks its schema, or was changed since it was written.
    """
    return read_sealed(bundle / MANIFEST, SCHEMA, remedy)
