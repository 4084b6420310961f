"""Find a Zarr array's chunks if their files are named differently than the metadata state.

A copy through another program or an edited `.zarray` leaves chunks `0.0.0` with metadata that state
`0/0/0`, or the reverse. Zarr would then read each chunk as absent, and the volume as empty. So both
separators of both encodings are searched, and a chunk without a file of the stated name is read
from a file with another name. On this machine the folder or the zip file is listed when it is
opened. At an address the other names are tried only when a chunk is absent, so a sound source costs
no further request.

References: Zarr 3 specification, section on chunk key encodings; Zarr 2, `dimension_separator`
"""

import os
import re
from collections.abc import Set
from dataclasses import dataclass
from itertools import islice
from typing import Any

import zarr
from zarr.core.chunk_key_encodings import (
    ChunkKeyEncoding,
    DefaultChunkKeyEncoding,
    V2ChunkKeyEncoding,
)

from stereocell.storage.location import Location

_ENCODINGS: tuple[ChunkKeyEncoding, ...] = (
    V2ChunkKeyEncoding("/"),
    V2ChunkKeyEncoding("."),
    DefaultChunkKeyEncoding("/"),
    DefaultChunkKeyEncoding("."),
)
_KEY = re.compile(r"c?[./]?(\d+(?:[./]\d+)*)")  # name of a chunk below its array
_MOST_LISTED = 100_000  # entries of an array's folder that are looked at


@dataclass(frozen=True, slots=True)
class OtherNames:
    """Names of an array's files that differ from those that its metadata state.

    array   path of the array below the source; empty: the source itself
    stated  name of the first chunk according to the metadata
    found   encoding by which the files are named
    """

    array: str
    stated: str
    found: ChunkKeyEncoding

    def key_of(self, key: str) -> str | None:
        """Return the file's name for the stated name of a chunk; None: it is not a chunk's name."""
        prefix = f"{self.array}/" if self.array else ""
        match = _KEY.fullmatch(key.removeprefix(prefix)) if key.startswith(prefix) else None
        if match is None:
            return None
        place = tuple(int(number) for number in re.split(r"[./]", match[1]))
        return prefix + self.found.encode_chunk_key(place)

    def note(self, dimensions: int) -> str:
        """Return the sentence for the user."""
        first = self.found.encode_chunk_key((0,) * dimensions)
        level = f" of level {self.array!r:.60}" if self.array else ""
        return (
            f"chunks{level}: the metadata name them like {self.stated}, but the files are named "
            f"like {first}: the files are read"
        )


def possible_names(array: "zarr.Array[Any]") -> tuple[OtherNames, ...]:
    """Return the names that chunks may have other than the stated ones."""
    count = len(array.shape)
    if count < 2:
        return ()
    first = array.metadata.encode_chunk_key((0,) * count)
    others = (one for one in _ENCODINGS if _form(one, count) != first)
    return tuple(OtherNames(array.path, first, one) for one in others)


def names_on_disk(
    location: Location, array: "zarr.Array[Any]", members: Set[str] | None
) -> OtherNames | None:
    """Return the other names under which chunks are stored; None: there are none.

    The array is on this machine, in a folder that can be listed or in a zip file.

    members  names in the zip file; None: it is a folder
    """
    count = len(array.shape)
    forms = _listed(location, array) if members is None else _among(members, array)
    return next((one for one in possible_names(array) if _form(one.found, count) in forms), None)


def _form(encoding: ChunkKeyEncoding, dimensions: int) -> str:
    """Return the name of the first chunk, which identifies an encoding."""
    return encoding.encode_chunk_key((0,) * dimensions)


def _among(members: Set[str], array: "zarr.Array[Any]") -> set[str]:
    """Return the first chunk's name for each encoding found among the members of a zip file."""
    prefix, count = f"{array.path}/" if array.path else "", len(array.shape)
    below = (name.removeprefix(prefix) for name in members if name.startswith(prefix))
    found = filter(None, map(_KEY.fullmatch, islice(below, _MOST_LISTED)))
    forms: set[str] = set()
    for name in found:
        parts = re.split(r"[./]", name[1])
        between = name[1][len(parts[0])] if len(parts) > 1 else ""
        if len(parts) == count and between:
            forms.add(between.join(["c"] * name[0].startswith("c") + ["0"] * count))
    return forms


def _listed(location: Location, array: "zarr.Array[Any]") -> set[str]:
    """Return the first chunk's name for each encoding found in an array's folder."""
    folder, count = f"{location.source}/{array.path}".rstrip("/"), len(array.shape)
    dotted = re.compile(rf"(c\.)?\d+(\.\d+){{{count - 1}}}")
    forms: set[str] = set()
    try:
        with os.scandir(folder) as entries:
            for _, entry in zip(range(_MOST_LISTED), entries, strict=False):
                if dotted.fullmatch(entry.name):
                    forms.add(".".join(["c"] * entry.name.startswith("c") + ["0"] * count))
                elif entry.is_dir() and (entry.name == "c" or entry.name.isdecimal()):
                    forms.add("/".join(["c"] * (entry.name == "c") + ["0"] * count))
    except OSError:  # the reader reports a folder that can't be listed
        return set()
    return forms
