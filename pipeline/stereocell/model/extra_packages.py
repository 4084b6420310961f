"""Packages that an extra of StereoCell installs, such as `pip install 'stereocell[draco]'`.

They are imported by name, where they are used. So results that do not use them have names (cache
keys) that do not depend on them; a result that does puts the version into its own key.
"""

from importlib import import_module
from typing import Any

from stereocell.model.errors import UsageError

# packages of extras that change bytes of a result: workers of a cluster must have the same versions
MAKERS = ("alktx2", "pymeshlab", "xatlas")


def import_extra(module: str, *, extra: str, wanted_by: str) -> Any:
    """Return a module of an extra.

    wanted_by  the flag or the work that needs it, the subject of the error's sentence

    Raises UsageError, with the command that installs it, where it can't be imported.
    """
    try:
        return import_module(module)
    except (ImportError, OSError):  # OSError: a library that the package itself loads is missing
        raise UsageError(
            f"{wanted_by} takes the package {module}: pip install 'stereocell[{extra}]'"
        ) from None


def version_of(package: str) -> str:
    """Return the version of an installed package; empty: it is not installed."""
    from importlib.metadata import PackageNotFoundError, version  # brings 40 modules more

    try:
        return version(package)
    except PackageNotFoundError:
        return ""
