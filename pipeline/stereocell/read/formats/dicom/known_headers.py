"""Header values that the files of a series share, which are decoded only once.

Slices of a series differ in their places and numbers. Everything else in their headers is mostly
the same, byte by byte, and pydicom takes longer to decode it than to read it. Headers are compared
by digests, so that no content of a file is stored.
"""

import hashlib
import struct
from collections.abc import Callable
from typing import Any, TypeVar

from pydicom.dataelem import RawDataElement
from pydicom.tag import Tag

T = TypeVar("T")

# Elements that differ from slice to slice. No value that is found with `once` may depend on them.
OF_A_SLICE = ("SOPInstanceUID", "InstanceNumber", "ImagePositionPatient", "SliceLocation")
_OF_A_SLICE = frozenset(map(Tag, OF_A_SLICE))


class KnownHeaders:
    """Decoded values by the content of headers, while a folder is read."""

    def __init__(self) -> None:
        self._values: dict[tuple[bytes, str], Any] = {}

    def once(self, key: bytes | None, name: str, find: Callable[[], T]) -> T:
        """Return the result of `find`, which is called once for all headers with the same key.

        key   result of `digest_of`; None: the header is not compared with others
        name  name of the value, including everything that it depends on beside the header
        """
        if key is None:
            return find()
        place = (key, name)
        if place not in self._values:
            self._values[place] = find()
        found: T = self._values[place]
        return found


def digest_of(header: Any) -> bytes | None:
    """Return a digest of a header that was just read, without the elements in OF_A_SLICE.

    None: an element is a sequence or was converted, so its bytes are not available.
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
