"""Single values of a DICOM header: from functional groups, from private blocks, as numbers.

These values describe an image and don't affect its place, so an unreadable value counts as absent.

References: DICOM PS3.3 C.7.6.16 (Multi-frame Functional Groups module); PS3.5 7.8 (private tags).
"""

import math
import struct
from collections.abc import Sequence
from typing import Any

from stereocell.read.formats.dicom.silence_logs import DICOM_FAULTS

_BLOCKS = (0x10, 0x11, 0x12)  # blocks of a private group that are searched for a creator
_CONVERTED = (
    "UnassignedPerFrameConvertedAttributesSequence",
    "UnassignedSharedConvertedAttributesSequence",
)
_PACKED = {"SS": "h", "FL": "f", "FD": "d"}  # VR of a binary number -> code of `struct`


def first_item(sequence: Any) -> Any:
    """Return the first item of a sequence, or None."""
    return sequence[0] if sequence else None


def find_value(header: Any, groups: Sequence[Any], sequence: str, key: str) -> Any:
    """Return a value from the frame's group, the shared group or the header; None: not stated.

    An enhanced image states the values of its frames in functional groups. An image that was
    converted from single frames keeps their other attributes in special groups. Raises
    DICOM_FAULTS.
    """
    stated = [group for group in groups if group is not None]
    for name in (sequence, *_CONVERTED) if stated else ():
        for group in stated:
            item = first_item(group.get(name))
            if item is not None and item.get(key) is not None:
                return item[key].value
    return header.get(key)


def find_words(header: Any, groups: Sequence[Any], key: str) -> tuple[str, ...]:
    """Return the words of a coded attribute, in capitals; empty: it can't be read."""
    return tuple(word.upper() for word in find_texts(header, groups, "", key))


def find_texts(header: Any, groups: Sequence[Any], sequence: str, key: str) -> tuple[str, ...]:
    """Return the values of an attribute that may have several; empty: it can't be read."""
    try:
        found = find_value(header, groups, sequence, key) or ()
        texts = (found,) if isinstance(found, str) else tuple(found)
        return tuple(str(text).strip() for text in texts)
    except DICOM_FAULTS:
        return ()


def find_number(header: Any, groups: Sequence[Any], sequence: str, key: str) -> float | None:
    """Return a finite number, the first of several; None: absent or unreadable."""
    try:
        return as_number(find_value(header, groups, sequence, key))
    except DICOM_FAULTS:
        return None


def find_text(header: Any, groups: Sequence[Any], sequence: str, key: str) -> str:
    """Return a text without surrounding spaces; empty: absent or unreadable."""
    try:
        value = find_value(header, groups, sequence, key)
        return "" if value is None else str(value).strip()
    except DICOM_FAULTS:
        return ""


def as_number(value: Any) -> float | None:
    """Return a finite number, the first of several; None: not a number. Raises DICOM_FAULTS."""
    if value is None or (isinstance(value, str) and not value.strip()):
        return None
    if not isinstance(value, str | int | float) and hasattr(value, "__len__"):
        return as_number(value[0]) if len(value) else None
    number = float(value)
    return number if math.isfinite(number) else None


def private_tags(group: int, element: int) -> list[int]:
    """Return the tags of a private element and of its possible creators, to ask pydicom for."""
    creators = [(group << 16) + block for block in _BLOCKS]
    return creators + [(group << 16) + (block << 8) + element for block in _BLOCKS]


def private_number(header: Any, group: int, element: int, creator: str, vr: str) -> float | None:
    """Return a number from a private block; None: there is none.

    creator  start of the name of the block's creator
    vr       `SS`, `FL` or `FD`, or `IS` for text, where the file states no VR
    """
    try:
        for block in _BLOCKS:
            named = header.get((group << 16) + block)
            element_found = header.get((group << 16) + (block << 8) + element)
            if named is None or element_found is None:
                continue
            if not _text(named.value).upper().startswith(creator.upper()):
                continue
            return as_number(_unpacked(header, element_found.value, vr))
    except DICOM_FAULTS:
        pass
    return None


def _text(value: Any) -> str:
    return value.decode("ascii", "replace") if isinstance(value, bytes) else str(value)


def _unpacked(header: Any, value: Any, vr: str) -> Any:
    """Return an element's value, unpacked if its VR is unknown and it is bytes."""
    if not isinstance(value, bytes):
        return value
    code = _PACKED.get(vr)
    if code is None:
        return value.decode("ascii").strip(" \0").split("\\")
    order = "<" if header.original_encoding[1] else ">"
    return struct.unpack_from(order + code, value)[0]
