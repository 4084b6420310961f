"""Libraries of formats that are not installed with StereoCell but by an extra of it."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec

from stereocell.model.errors import SourceError


@contextmanager
def required(extra: str, where: str, title: str) -> Iterator[None]:
    """Raise SourceError, with the command that installs it, where the block can't import it."""
    try:
        yield
    except ImportError:
        raise _missing(extra, where, title) from None


def require_installed(library: str, extra: str, where: str, title: str) -> None:
    """Raise as `required` where a library is missing. A child process imports it later."""
    if find_spec(library) is None:
        raise _missing(extra, where, title)


def _missing(extra: str, where: str, title: str) -> SourceError:
    return SourceError(
        f'{where}: {title}: its library is not installed, expected: pip install "stereocell'
        f'[{extra}]"'
    )
