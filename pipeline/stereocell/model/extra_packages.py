"""Packages that an extra of StereoCell installs, such as `pip install 'stereocell[draco]'`.

They are imported by name, where they are used. So the cache keys of results that do not use them do
not depend on them. A result that uses one puts its version into its own key.
"""

from importlib import import_module
from typing import Any

from stereocell.model.errors import UsageError

# packages of extras that change bytes of a result: workers of a cluster must have the same versions
MAKERS = ("alktx2", "pymeshlab", "xatlas")


def import_extra(module: str, *, extra: str, wanted_by: str) -> Any:
    """Return a module of an extra.

    wanted_by  the flag or the work that needs it, the subject of the error's sentence

    Raises UsageError, with the command that installs the extra, where the import fails.
    """
    try:
        return import_module(module)
    except (ImportError, OSError):  # OSError: a library that the package itself loads is missing
        raise UsageError(
            f"{wanted_by} takes the package {module}: pip install 'stereocell[{extra}]'"
        ) from None


def version_of(package: str) -> str:
    """Return the version of an installed package; empty: it is not installed."""
    from importlib.metadata import PackageNotFoundError, version  # imports 40 more modules

    try:
        return version(package)
    except PackageNotFoundError:
        return ""
