"""Import packages that an extra installs, such as `pip install 'stereocell[draco]'`.

They are imported by name where they are used, so keys of other results do not depend on them. A
result that uses such a package has the package's version in its key.
"""

from importlib import import_module
from typing import Any

from stereocell.model.errors import UsageError

# Packages of extras that change the bytes of a result. All workers of a cluster must have the same
# versions.
MAKERS = ("alktx2", "pymeshlab", "xatlas")


def import_extra(module: str, *, extra: str, wanted_by: str) -> Any:
    """Return a module of an extra.

    wanted_by  flag or work that needs it; the error's sentence begins with it

    Raises UsageError, with the command that installs the extra, if the import fails.
    """
    try:
        return import_module(module)
    except (ImportError, OSError):  # OSError: the package can't load one of its libraries
        raise UsageError(
            f"{wanted_by} needs the package {module}: pip install 'stereocell[{extra}]'"
        ) from None


def version_of(package: str) -> str:
    """Return the version of a package; empty: it is not installed."""
    from importlib.metadata import PackageNotFoundError, version  # slow: imports 40 more modules

    try:
        return version(package)
    except PackageNotFoundError:
        return ""
