"""Turn errors of items into one line each, without names, tags or addresses of the upload."""

import re
from functools import cache

from stereocell.inbox.item import Item
from stereocell.inbox.refused import RefusedError
from stereocell.model.errors import StereoCellError
from stereocell.model.modality import MODALITIES
from stereocell.planning.settings import preset_names
from stereocell.read.image import printable
from stereocell.read.known_formats import known_formats
from stereocell.storage.child_process import ChildError
from stereocell.storage.location import Location
from stereocell.storage.processes import shortage

_LONGEST = 600  # characters; the end of a longer line is cut
# Common names of files that are also words of messages, and nobody's name; see `_own_words`.
_WORDS = "image volume scan specimen file folder source data level series channel tile head brain"
_LETTERS = re.compile(r"[^\W\d_]+")
_SHORTEST_NAME = 3  # characters; shorter parts of a name stay, since they are often words


def line_of(item: Item, error: BaseException) -> str:
    """Return the line of an error that an item has caused."""
    if isinstance(error, ChildError):
        return f"reading was stopped: {error}"
    if isinstance(error, StereoCellError):
        return without_identity(item, str(error))
    if isinstance(error, Exception) and (words := shortage(error)):
        return words
    if isinstance(error, OSError):
        return f"the server had an error: {error.strerror or type(error).__name__}"
    return f"this is a bug of StereoCell ({type(error).__name__}): please report it"


def without_identity(item: Item, text: str) -> str:
    """Return a text, in one line, without the paths, names and address of an upload."""
    for place in (item.upload_folder / "source", item.upload_folder, item.folder):
        for shown in {str(place), str(place.absolute())}:
            text = text.replace(f"{shown}/", "").replace(shown, "the upload")
    if item.upload is not None:
        if address := item.address:
            shown = Location.of(address).shown.rstrip("/")
            places = sorted({address, shown}, key=len, reverse=True)
            one_of = "|".join(map(re.escape, places))
            # A message may show the expected form of an address, with `ID` in it. It may begin
            # like the pasted address, and stays.
            text = re.sub(rf"(?:{one_of})(?!\S*\bID\b)", "the address", text)
        own = {part for parts in item.upload.announced.parts for part in parts}
        named = own | {one.partition(".")[0] for one in own}
        names = [
            one
            for one in named
            if len(one) >= _SHORTEST_NAME and not one.isdecimal() and not _is_own(one)
        ]
        if names:
            any_name = "|".join(map(re.escape, sorted(names, key=len, reverse=True)))
            text = re.sub(rf"(?<!\w)(?:{any_name})(?!\w)", "...", text)
    line = " ".join(printable(text).split())
    return line if len(line) <= _LONGEST else f"{line[: _LONGEST - 4]} ..."


def _is_own(name: str) -> bool:
    """Return whether a name consists of the program's own words, such as `mri` or `ct_head_2`."""
    words = _LETTERS.findall(name.lower())
    return bool(words) and _own_words().issuperset(words)


@cache
def _own_words() -> frozenset[str]:
    """Return words of messages, in lower case, that are nobody's name.

    They are the names of presets, modalities and formats, and some common words of messages. The
    names of settings are excluded: `max` is also a person's name.
    """
    formats = known_formats()
    texts = [_WORDS, *preset_names(), *MODALITIES, *formats]
    texts += [one.title for one in formats.values()]
    return frozenset(_LETTERS.findall(" ".join(texts).lower()))


def status_of(error: StereoCellError) -> int:
    """Return the HTTP status for an error."""
    return error.status if isinstance(error, RefusedError) else 422
