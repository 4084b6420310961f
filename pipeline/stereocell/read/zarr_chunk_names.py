"""The names of a Zarr array's chunks, where the files are not named as the metadata state.

A copy through another program or an edited `.zarray` leaves chunks `0.0.0` behind metadata that
state `0/0/0`, or the reverse. Zarr then reads each chunk as absent, and the volume as empty. Both
separators of both encodings are looked for, and a chunk without a file of the stated name is read
from a file of the other name.

References: Zarr 3 specification, section on chunk key encodings; Zarr 2, `dimension_separator`
"""

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import zarr
from zarr.core.chunk_key_encodings import (
    ChunkKeyEncoding,
    DefaultChunkKeyEncoding,
    V2ChunkKeyEncoding,
)
from zarr.core.sync import sync

from stereocell.storage.location import Location

_ENCODINGS: tuple[ChunkKeyEncoding, ...] = (
    V2ChunkKeyEncoding("/"),
    V2ChunkKeyEncoding("."),
    DefaultChunkKeyEncoding("/"),
    DefaultChunkKeyEncoding("."),
)
_KEY = re.compile(r"c?[./]?(\d+(?:[./]\d+)*)")  # name of a chunk below its array
_MOST_LISTED = 100_000  # most entries of an array's folder that are looked at


@dataclass(frozen=True, slots=True)
class OtherNames:
    """The names that the files of an array have, beside those that its metadata state.

    array   path of the array below the source; empty: the source itself
    stated  the name of the first chunk by the metadata
    found   the encoding by which files are named
    """

    array: str
    stated: str
    found: ChunkKeyEncoding

    def key_of(self, key: str) -> str | None:
        """Return the name that the chunk of a stated name has; None: no chunk has this name."""
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
            f"chunks{level}: the metadata name them as {self.stated}, the files are named as "
            f"{first}: the files are read"
        )


def find_other_names(location: Location, array: "zarr.Array[Any]") -> OtherNames | None:
    """Return the names by which chunks lie that the metadata name otherwise; None: there are none.

    On this machine the folder is listed. At an address the first, the middle and the last chunk are
    looked for, and only where none of them has its stated name.
    """
    sizes = array.shards or array.chunks
    counts = [max(-(-n // size), 1) for n, size in zip(array.shape, sizes, strict=True)]
    if len(counts) < 2:
        return None
    first = array.metadata.encode_chunk_key((0,) * len(counts))
    others = [one for one in _ENCODINGS if one.encode_chunk_key((0,) * len(counts)) != first]
    has_files = _listed(location, array) if location.is_local else _probed(array, counts, others)
    found = next((one for one in others if _form(one, len(counts)) in has_files), None)
    return None if found is None else OtherNames(array.path, first, found)


def _form(encoding: ChunkKeyEncoding, dimensions: int) -> str:
    """Return the name that identifies an encoding."""
    return encoding.encode_chunk_key((0,) * dimensions)


def _listed(location: Location, array: "zarr.Array[Any]") -> set[str]:
    """Return the forms of the names in an array's folder on this machine."""
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
    except OSError:  # the reader reports it
        return set()
    return forms


def _probed(
    array: "zarr.Array[Any]", counts: Sequence[int], others: Sequence[ChunkKeyEncoding]
) -> set[str]:
    """Return the forms of the names that some chunks have at an address."""
    if any(_is_there(array, array.metadata.encode_chunk_key(at)) for at in _places(counts)):
        return set()
    return {
        _form(one, len(counts))
        for one in others
        if any(_is_there(array, one.encode_chunk_key(at)) for at in _places(counts))
    }


def _places(counts: Sequence[int]) -> Iterator[tuple[int, ...]]:
    """Yield the first, the middle and the last chunk, each once."""
    ends = [(0,) * len(counts), tuple(n // 2 for n in counts), tuple(n - 1 for n in counts)]
    yield from dict.fromkeys(ends)


def _is_there(array: "zarr.Array[Any]", key: str) -> bool:
    return bool(sync(array.store.exists(f"{array.path}/{key}".lstrip("/"))))
