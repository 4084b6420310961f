"""Libraries of formats that are not installed with StereoCell but by an extra of it."""

from importlib.util import find_spec

from stereocell.model.errors import SourceError


def require_installed(library: str, extra: str, where: str, title: str) -> None:
    """Raise SourceError, with the command that installs it, where a library is missing."""
    try:
        is_there = find_spec(library) is not None
    except ValueError:  # a module without a spec
        is_there = False
    if not is_there:
        raise SourceError(
            f'{where}: {title}: its library is not installed, expected: pip install "stereocell'
            f'[{extra}]"'
        )
