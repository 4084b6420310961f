"""Put real paths into the commands that messages name, so that they can be pasted into a shell.

Most messages are written where OUT is not known, for example in a worker. They name a command as
`stereocell units OUT` in backticks. The command line and the Python API know the real paths, and
put them in before a message is shown.

INPUT becomes the path that was given to the same command or function. The path in the plan is not
printed, because it may name a patient.
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
    """Return a message with real paths in its commands, quoted for a shell if necessary.

    places  paths or addresses, by the words that stand for them: OUT, INPUT, TARGET

    >>> fill_in("run `stereocell units OUT` first", {"OUT": "my build"})
    "run `stereocell units 'my build'` first"
    """

    def quoted(word: re.Match[str]) -> str:
        return shlex.quote(places[word[0]]) if word[0] in places else word[0]

    return _COMMAND.sub(lambda command: _PLACE.sub(quoted, command[0]), message)


@contextmanager
def filling_in(places: Mapping[str, str]) -> Iterator[None]:
    """Put real paths into the commands in the messages of the block's errors."""
    try:
        yield
    except StereoCellError as error:
        error.args = (fill_in(str(error), places),)
        raise


def as_shown(place: str) -> str:
    """Return a path unchanged, or an address without its secrets (user, password, signature)."""
    return Location.of(place).shown if "://" in place else place


def places_of(found: Contents, shown: str) -> dict[str, str]:
    """Return the places for `fill_in` that follow from the path that a command was given.

    found  contents of that path
    shown  the path or address as messages show it
    """
    if found.kind is Kind.SITE:
        return {"TARGET": shown}
    if found.kind in (Kind.BUILD, Kind.NOTHING):
        return {"OUT": shown}
    return {} if found.build is None else {"OUT": str(found.build)}
