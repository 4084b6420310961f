"""Check tags that must be the same in all pages of an image, since all pages are read alike.

tifffile reads most tags only from the first page, and assumes them for the others.
"""

import struct
from collections import Counter
from collections.abc import Iterable
from typing import Any

from tifffile import TiffFile

from stereocell.model.errors import SourceError

_SHORT = 3  # TIFF's type of 16-bit numbers
# tag -> name, and value where the first page has none
_TAGS = {274: ("Orientation", 1), 262: ("PhotometricInterpretation", 1)}


def require_same_tags(where: str, tiff: TiffFile, pages: Iterable[Any]) -> None:
    """Raise SourceError where pages of one image would have to be read in different ways.

    A page without a tag is read like the first one, since some writers put tags only into that.

    pages  pages of the file; pages of other files of a set are not looked at
    """
    own = [page for page in pages if page is not None and page.parent is tiff and page.offset]
    found = [_tags_of(tiff, page.offset) for page in own]
    for tag, (name, default) in _TAGS.items():
        first = found[0].get(tag, default) if found else default
        counts = Counter(tags.get(tag, first) for tags in found)
        if len(counts) > 1:
            shown = " and ".join(f"{value} in {count}" for value, count in counts.most_common())
            raise SourceError(
                f"{where}: {name}: found {shown} of {len(own)} pages, expected the same in all: "
                "save each page in a separate file, since a folder of planes is read file by file"
            )


def _tags_of(tiff: TiffFile, offset: int) -> dict[int, int]:
    """Return the 16-bit values that the entries of a directory hold themselves."""
    order, handle = tiff.byteorder, tiff.filehandle
    number, form = ("Q", "HHQHHHH") if tiff.is_bigtiff else ("H", "HHIHH")
    entry = struct.Struct(order + form)
    handle.seek(offset)
    (count,) = struct.unpack(order + number, handle.read(struct.calcsize(order + number)))
    entries = handle.read(count * entry.size)
    return {
        tag: rest[0]
        for tag, kind, length, *rest in entry.iter_unpack(entries[: count * entry.size])
        if tag in _TAGS and kind == _SHORT and length == 1
    }
