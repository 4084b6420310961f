"""Find keys that a JSON text states twice, and XML elements that are repeated against the schema.

Parsers silently use the last of equal keys, and readers use the first of several elements. `open`
collects a note on each repeat whose values differ. `load_json`, `record_json` and `record_xml` add
their notes to the current collection, if there is one, and change no result.

References: RFC 8259, section 4 (names within an object should be unique); OME-XML schema 2016-06.
"""

import json
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import takewhile
from typing import Any
from xml.etree import ElementTree

from stereocell.read.statements import Statement, Subject, Trust, Value, settle

_MOST_BYTES = 4 << 20  # bytes; longer texts are not searched for repeats
_MOST_SHOWN = 60  # characters of a value in a note
# parent -> children that it may have once at most, in OME-XML and BigDataViewer's XML
_SINGLE = {
    "OME": ("BinaryOnly",),
    "Image": ("Pixels",),
    "TiffData": ("UUID",),
    "SequenceDescription": ("ImageLoader", "ViewSetups", "Timepoints"),
    "ViewSetup": ("id", "name", "size", "voxelSize", "attributes"),
    "voxelSize": ("unit", "size"),
}
# element -> attributes that identify it: no two siblings may agree in all of them
_UNIQUE = {
    "Plane": ("TheZ", "TheC", "TheT"),
    "Channel": ("ID",),
    "Distance": ("Id",),
    "ViewRegistration": ("timepoint", "setup"),
}
_FIRST = "the first one"
_found: ContextVar[dict[tuple[str, str], str] | None] = ContextVar("repeats", default=None)


@contextmanager
def collected() -> Iterator[dict[tuple[str, str], str]]:
    """Collect the notes on repeats, by the source and the name of the repeated field."""
    notes: dict[tuple[str, str], str] = {}
    token = _found.set(notes)
    try:
        yield notes
    finally:
        _found.reset(token)


def load_json(text: str | bytes, source: str) -> Any:
    """Return the value of a JSON text, and record its repeats. Raises ValueError."""
    record_json(text, source)
    return json.loads(text)


def record_json(text: str | bytes, source: str) -> None:
    """Record keys that one object of a JSON text states several times, with different values."""
    notes = _found.get()
    if notes is None or len(text) > _MOST_BYTES:
        return

    def pairs(members: list[tuple[str, Any]]) -> dict[str, Any]:
        table = dict(members)
        if len(table) < len(members):
            for name in table:
                values = [value for key, value in members if key == name]
                _record(notes, (source, f"key {name}"), values[-1], values[:-1], "its last value")
        return table

    try:
        json.loads(text, object_pairs_hook=pairs)
    except (ValueError, RecursionError):
        return  # the reader refuses invalid JSON with its own message


def record_xml(root: ElementTree.Element, source: str) -> None:
    """Record elements that occur several times where the schema permits one."""
    notes = _found.get()
    if notes is None:
        return
    for parent in root.iter():
        alike: dict[tuple[str, ...], list[ElementTree.Element]] = defaultdict(list)
        for child in parent:
            name = _local(child)
            if name in _SINGLE.get(_local(parent), ()):
                alike[name,].append(child)
            elif all(key in child.attrib for key in _UNIQUE.get(name, ("",))):
                alike[name, *(child.get(key, "") for key in _UNIQUE[name])].append(child)
        for (name, *_), (first, *others) in alike.items():
            where = f"element {name} in {_local(parent)}"
            values = [_text(one) for one in others]
            _record(notes, (source, where), _text(first), values, _FIRST)


def _record(
    notes: dict[tuple[str, str], str],
    key: tuple[str, str],
    used: Any,
    others: Sequence[Any],
    place: str,
) -> None:
    other = "an earlier value" if place != _FIRST else "another one"
    source, name = key
    subject = Subject(f"{name} of {source}, which is there {len(others) + 1} times")
    for found in others:
        ours, theirs = _values(used, found)
        statements = [Statement(ours, place), Statement(theirs, other, Trust.REPEATED)]
        for note in settle(subject, statements).notes:
            notes.setdefault(key, note)


def _values(used: Any, other: Any) -> tuple[Value, Value]:
    """Return two values for a note; long texts are cut to the part where they differ."""
    numbers = [float(one) for one in (used, other) if isinstance(one, int | float)]
    if len(numbers) == len((used, other)):
        return numbers[0], numbers[1]
    texts = [one if isinstance(one, str) else json.dumps(one) for one in (used, other)]
    if max(map(len, texts)) <= _MOST_SHOWN:
        return texts[0], texts[1]
    first = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(*texts, strict=False)))
    begin = max(first - _MOST_SHOWN // 3, 0)
    ours, theirs = (f"...{text[begin : begin + _MOST_SHOWN]}..." for text in texts)
    return ours, theirs


def _text(element: ElementTree.Element) -> str:
    """Return an element's attributes, its text, and the names and texts of its children."""
    words = [f"{name}={value}" for name, value in element.attrib.items()]
    words.append((element.text or "").strip())
    words += [f"{_local(child)} {(child.text or '').strip()}" for child in element]
    return " ".join(filter(None, words))


def _local(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""
