"""Commands in messages become lines that can be pasted into a shell.

Most remedies are worded where OUT is not known: in a worker, or for a part of OUT. They name a
command as `stereocell units OUT` in backticks. The command line and the Python API know the real
places, and put them in before a message is shown.

INPUT becomes the path that was given to the same command or function. A path that an earlier
command recorded in the plan may name a patient, so it is not printed.
"""

import re
import shlex
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from stereocell.model.errors import StereoCellError
from stereocell.storage.contents import Contents
from stereocell.storage.kinds import Kind
from stereocell.storage.location import Location

_COMMAND = re.compile(r"`stereocell [^`]*`")
_PLACE = re.compile(r"\b(?:OUT|INPUT|TARGET)\b")


def fill_in(message: str, places: Mapping[str, str]) -> str:
    """Return a message with real paths in its commands, quoted for a shell where they need it.

    places  paths or addresses by the words that stand for them: OUT, INPUT, TARGET

    >>> fill_in("run `stereocell units OUT` first", {"OUT": "my build"})
    "run `stereocell units 'my build'` first"
    """

    def quoted(word: re.Match[str]) -> str:
        return shlex.quote(places[word[0]]) if word[0] in places else word[0]

    return _COMMAND.sub(lambda command: _PLACE.sub(quoted, command[0]), message)


@contextmanager
def filling_in(places: Mapping[str, str]) -> Iterator[None]:
    """Put real paths into the commands that errors of the block name."""
    try:
        yield
    except StereoCellError as error:
        error.args = (fill_in(str(error), places),)
        raise


def as_shown(place: str) -> str:
    """Return a path as it is, and an address without its secrets (user, password, signature)."""
    return Location.of(place).shown if "://" in place else place


def places_of(found: Contents, shown: str) -> dict[str, str]:
    """Return the places that are known from what lies at the path that a command was given.

    shown  the path or address, as messages show it
    """
    if found.kind is Kind.SITE:
        return {"TARGET": shown}
    if found.kind in (Kind.BUILD, Kind.NOTHING):
        return {"OUT": shown}
    return {} if found.build is None else {"OUT": str(found.build)}
