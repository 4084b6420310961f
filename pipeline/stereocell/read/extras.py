"""Libraries of formats that are not installed with StereoCell but by an extra of it."""

from collections.abc import Iterator
from contextlib import contextmanager

from stereocell.model.errors import SourceError


@contextmanager
def required(extra: str, where: str, title: str) -> Iterator[None]:
    """Raise SourceError, with the command that installs it, where the block can't import it."""
    try:
        yield
    except ImportError:
        raise SourceError(
            f'{where}: {title}: its library is not installed, expected: pip install "stereocell'
            f'[{extra}]"'
        ) from None
