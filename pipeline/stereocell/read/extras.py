"""Libraries of formats that are not installed with StereoCell but by an extra of it."""

from importlib import import_module
from typing import Any

from stereocell.model.errors import SourceError


def load(module: str, extra: str, where: str, title: str) -> Any:
    """Return a module of an extra. Raises SourceError, with the command that installs it."""
    try:
        return import_module(module)
    except ImportError:
        raise SourceError(
            f'{where}: {title}: its library is not installed, expected: pip install "stereocell'
            f'[{extra}]"'
        ) from None
