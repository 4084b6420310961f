"""Look up the libraries that steps and readers use, in the record that ships with the package.

`make record-steps` writes step_record.json. For each step and reader it holds the VERSION, a digest
of the code that it reaches, and the libraries that this code imports. The digests are for
`make lint`, the libraries for the provenance of results. No key of a result depends on the record.
"""

import json
from collections.abc import Mapping
from fnmatch import fnmatch
from functools import cache
from importlib.metadata import PackageNotFoundError, distributions, version
from pathlib import Path
from typing import Any

RECORD = Path(__file__).with_name("step_record.json")


def libraries_of(*names: str) -> dict[str, str]:
    """Return the version of each installed library that steps or readers use.

    names  names of step classes and of formats (read/known_formats.py)

    A new step or reader has no libraries until `make record-steps` has run; `make lint` asks for
    that.
    """
    found: dict[str, str] = {}
    for name in names:
        for library in _record().get(name, {"libraries": ""})["libraries"].split():
            found |= _versions(library)
    return found


def all_libraries() -> dict[str, str]:
    """Return the version of each installed library that any step or reader uses."""
    return libraries_of(*_record())


@cache
def _versions(library: str) -> Mapping[str, str]:
    """Return the versions of a library, or of all libraries that match a pattern like `bioio_*`."""
    if "*" in library:
        names = {one.metadata["Name"] for one in distributions()}
        fitting = sorted(one for one in names if fnmatch(one.replace("-", "_"), library))
        return {one: version(one) for one in fitting}
    try:
        return {library: version(library)}
    except PackageNotFoundError:
        return {}


@cache
def _record() -> Mapping[str, Any]:
    steps: Mapping[str, Any] = json.loads(RECORD.read_bytes())["steps"]
    return steps
