"""The header values that the files of a series share, which are decoded once.

Slices of a series differ in their places and numbers. All else in their headers is mostly the same,
byte by byte, and pydicom takes longer to turn it into values than to read it. Headers are compared
by digests, so that nothing of a file is kept.
"""

import hashlib
import struct
from collections.abc import Callable
from typing import Any, TypeVar

from pydicom.dataelem import RawDataElement
from pydicom.tag import Tag

T = TypeVar("T")

# elements that differ from slice to slice; no value that is found `once` may depend on one of them
OF_A_SLICE = ("SOPInstanceUID", "InstanceNumber", "ImagePositionPatient", "SliceLocation")
_OF_A_SLICE = frozenset(map(Tag, OF_A_SLICE))


class KnownHeaders:
    """Values of headers by what the headers state, for the time in which a folder is read."""

    def __init__(self) -> None:
        self._values: dict[tuple[bytes, str], Any] = {}

    def once(self, key: bytes | None, name: str, find: Callable[[], T]) -> T:
        """Return what `find` returns: at its first call for headers of that key.

        key   see `digest_of`; None: the header is compared with no other
        name  of the value, with all that it depends on beside the header
        """
        if key is None:
            return find()
        place = (key, name)
        if place not in self._values:
            self._values[place] = find()
        found: T = self._values[place]
        return found


def digest_of(header: Any) -> bytes | None:
    """Return a digest of all elements of a header that was just read, but for OF_A_SLICE.

    None: an element is a sequence or was converted, so that its bytes are not at hand.
    """
    digest = hashlib.sha256(repr(header.original_encoding).encode())
    for tag in header.keys():  # noqa: SIM118  (the items would be converted)
        element = header.get_item(tag)
        if not isinstance(element, RawDataElement) or element.VR == "SQ":
            return None
        if tag in _OF_A_SLICE:
            continue
        value = element.value or b""
        digest.update(struct.pack("<I2sI", tag, (element.VR or "").encode(), len(value)))
        digest.update(value)
    return digest.digest()
