"""Notes in a file on the objects of its label map: names, colours and other properties.

References: OME-Zarr 0.5, https://ngff.openmicroscopy.org/0.5/#labels-metadata (image-label);
NIfTI label tables, written by TotalSegmentator as an XML header extension in CaretExtension's style
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Mapping
from typing import Any

from stereocell.model.color import linear_color
from stereocell.model.object_notes import ObjectNotes
from stereocell.read.stated_numbers import number_of

_MAX_LABELS = 1_000_000  # objects; notes on further objects are not read
_MAX_XML = 1 << 22  # bytes of a header extension; longer ones are not parsed
_LONGEST = 200  # characters; longer names and texts are cut


def notes_of_ngff(image_label: Any) -> ObjectNotes:
    """Return the notes in an image's `image-label`; malformed entries are left out."""
    found = ObjectNotes()
    for entry in _entries(image_label, "colors"):
        rgba, label = entry.get("rgba"), _label(entry)
        if label is not None and isinstance(rgba, list) and len(rgba) >= 3 and _are_bytes(rgba[:3]):
            found.colors[label] = linear_color((rgba[0], rgba[1], rgba[2]))
    for entry in _entries(image_label, "properties"):
        label = _label(entry)
        for key, value in entry.items():
            if label is None or key == "label-value" or not _cut(key):
                continue
            if isinstance(value, str):
                found.columns.setdefault(_cut(key), {})[label] = _cut(value)
            elif isinstance(value, bool | int | float):
                found.columns.setdefault(_cut(key), {})[label] = number_of(value)
    return found


def notes_of_nifti(extensions: Iterable[bytes]) -> ObjectNotes:
    """Return the names and colours of the label tables in NIfTI header extensions."""
    found = ObjectNotes()
    for content in extensions:
        text = content.rstrip(b"\0")
        # A document type could name other files and multiply entities without end.
        if b"<Label" not in text or b"<!DOCTYPE" in text or len(text) > _MAX_XML:
            continue
        try:
            root = ElementTree.fromstring(text)
        except ElementTree.ParseError:
            continue
        for element in root.iter("Label"):
            key, name = element.get("Key", ""), _cut(element.text or "")
            if not key.isdecimal() or int(key) == 0 or not name:
                continue
            found.names[int(key)] = name
            try:
                parts = [
                    round(255 * float(element.get(part, ""))) for part in ("Red", "Green", "Blue")
                ]
            except (ValueError, OverflowError):
                continue
            if _are_bytes(parts):
                found.colors[int(key)] = linear_color((parts[0], parts[1], parts[2]))
    return found


def _entries(image_label: Any, key: str) -> list[Mapping[str, Any]]:
    listed = image_label.get(key) if isinstance(image_label, Mapping) else None
    entries = listed[:_MAX_LABELS] if isinstance(listed, list) else []
    return [entry for entry in entries if isinstance(entry, Mapping)]


def _label(entry: Mapping[str, Any]) -> int | None:
    value = entry.get("label-value")
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value // 1:
        return None
    return int(value)


def _are_bytes(values: Iterable[Any]) -> bool:
    return all(isinstance(value, int) and 0 <= value <= 255 for value in values)


def _cut(text: str) -> str:
    clean = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return clean[:_LONGEST]
