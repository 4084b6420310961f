"""Libraries of formats that are installed only with an extra of StereoCell."""

from importlib.util import find_spec

from stereocell.model.errors import SourceError


def require_installed(library: str, extra: str, where: str, title: str) -> None:
    """Raise SourceError, with the command that installs the library, if it is missing."""
    try:
        is_there = find_spec(library) is not None
    except ValueError:  # a loaded module without a spec counts as missing
        is_there = False
    if not is_there:
        raise SourceError(
            f"{where}: the library for {title} is not installed, expected the extra {extra}: "
            f'pip install "stereocell[{extra}]"'
        )
