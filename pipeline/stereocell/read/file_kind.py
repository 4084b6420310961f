"""Check that a file has the format that its name suggests, before the format's library reads it.

A library would describe a pointer of Git LFS, an HTML page or an unfinished copy in terms of its
own format. This module describes them in the same way for all formats.
"""

import os

from stereocell.model.errors import SourceError
from stereocell.read.foreign_files import foreign_words
from stereocell.read.format import Format
from stereocell.read.known_formats import identify, known_formats
from stereocell.storage.first_bytes import Content, unpacked
from stereocell.storage.location import Location, first_bytes

_HEAD_BYTES = 1 << 13  # bytes to look at; a gzip file's own header may be long


def require_kind(location: Location, format: Format) -> None:
    """Raise SourceError where a file on this machine does not have the expected format.

    The reader itself handles files that can't be opened, and formats that state nothing about the
    first bytes of their files.
    """
    path, title = location.path, format.short_title
    if location.is_local and os.path.isdir(path) and format.endings and not format.folder_endings:
        raise SourceError(f"{location.shown}: found a folder, expected a file")
    if not location.is_local or not os.path.isfile(path):
        return
    head = first_bytes(path, count=_HEAD_BYTES)
    if not head and os.path.getsize(path):
        return  # the reader reports a file that can't be read
    content = identify(head)
    if format.folder_endings:
        if format.holds is None or not format.holds(location):
            raise SourceError(
                f"{location.shown}: found a file ({content.words}), expected a folder of {title}"
            )
    elif path.lower().endswith(format.packed_endings):
        if not _is_packed(head, format):
            raise refused(location, content, f"{title}, packed by gzip")
    elif format.marks or format.is_unmarked is not None:
        is_unmarked = format.is_unmarked is not None and format.is_unmarked(path, head)
        if content.format != format.name and not is_unmarked:
            raise refused(location, content, title)


def _is_packed(head: bytes, format: Format) -> bool:
    """Return whether a gzip file holds the format's marks, or bytes of no known format."""
    inside = unpacked(head) if head.startswith(b"\x1f\x8b") else None
    within = identify(inside) if inside else None
    return within is not None and (within.format == format.name or not within.is_known)


def refused(location: Location, content: Content, title: str) -> SourceError:
    """Return the error for a file whose content differs from the format that its name suggests.

    title  name of the format that the file name suggests
    """
    words = content.words
    if not content.is_known:  # without a mark, the name may reveal more than the bytes
        words = foreign_words(location.parts[-1]) or words
    name, dot, packed = content.format.partition(".")
    remedy = ""
    if format := known_formats().get(name):
        ending = next(iter((*format.endings, *format.loose_endings)))
        remedy = f": if it really is that, rename it to end in {ending}{dot}{packed}"
    return SourceError(f"{location.shown}: found {words}, expected {title}{remedy}")
