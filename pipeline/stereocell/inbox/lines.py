"""One line for each error of an item, without a name, a tag or an address of its upload."""

import re

from stereocell.inbox.item import Item
from stereocell.inbox.refused import RefusedError
from stereocell.model.errors import StereoCellError
from stereocell.read.image import printable
from stereocell.storage.child_process import ChildError
from stereocell.storage.location import Location
from stereocell.storage.processes import shortage

_LONGEST = 600  # characters of a line
# names of files that are words of messages, and of nobody
_WORDS = frozenset(
    ("image", "volume", "scan", "specimen", "file", "folder", "source", "dicom", "zarr", "data")
)
_SHORTEST_NAME = 3  # characters of a part of a name that is replaced: shorter ones are words, too


def line_of(item: Item, error: BaseException) -> str:
    """Return the line of an error that an item has caused."""
    if isinstance(error, ChildError):
        return f"reading was ended: {error}"
    if isinstance(error, StereoCellError):
        return without_identity(item, str(error))
    if isinstance(error, Exception) and (words := shortage(error)):
        return words
    if isinstance(error, OSError):
        return f"the server: {error.strerror or type(error).__name__}"
    return f"a fault of the program ({type(error).__name__}): please report it"


def without_identity(item: Item, text: str) -> str:
    """Return a text, in one line, without places and names of an upload."""
    for place in (item.upload_folder / "source", item.upload_folder, item.folder):
        for shown in {str(place), str(place.absolute())}:
            text = text.replace(f"{shown}/", "").replace(shown, "the upload")
    if item.upload is not None:
        if address := item.address:
            for shown in {address, Location.of(address).shown}:
                text = text.replace(shown, "the address")
        own = {part for parts in item.upload.announced.parts for part in parts}
        stems = {one.partition(".")[0] for one in own} - _WORDS
        names = [one for one in own | stems if len(one) >= _SHORTEST_NAME and not one.isdecimal()]
        if names:
            any_name = "|".join(map(re.escape, sorted(names, key=len, reverse=True)))
            text = re.sub(rf"(?<!\w)(?:{any_name})(?!\w)", "...", text)
    line = " ".join(printable(text).split())
    return line if len(line) <= _LONGEST else f"{line[: _LONGEST - 4]} ..."


def status_of(error: StereoCellError) -> int:
    """Return the status of HTTP for an error."""
    return error.status if isinstance(error, RefusedError) else 422
