"""The store through which Zarr reads. It checks paths, file lengths and decoded sizes.

The array's metadata give the size of a chunk, but the decoders ignore it. gzip and zstd unpack
until the stream ends or memory runs out. Blosc trusts the length in the chunk's header and reads
past the end of the buffer, so a truncated file would be read as noise. For a shard that is read
whole, only the size of the file is known here, not the decoded size of its inner chunks.
"""

import bz2
import lzma
import math
import struct
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import zarr
import zstandard
from zarr.abc.buffer import Buffer
from zarr.abc.store import ByteRequest, RangeByteRequest, Store
from zarr.core.buffer import BufferPrototype
from zarr.errors import NodeNotFoundError
from zarr.storage import FsspecStore, LocalStore, WrapperStore

from stereocell.model.errors import SourceError
from stereocell.read import zarr_ending  # noqa: F401  (it registers a function for Python's end)
from stereocell.read.formats.ome_zarr.chunk_names import OtherNames, names_on_disk, possible_names
from stereocell.read.formats.ome_zarr.zip_file import ZippedStore, is_zipped, open_zipped
from stereocell.read.repeats import record_json
from stereocell.storage.first_bytes import HEAD_BYTES, pointer_words
from stereocell.storage.library_errors import (
    DamagedError,
    damage_words,
    is_undecoded,
    one_line,
    without_warning,
)
from stereocell.storage.location import Location, require_own, require_own_key

_METADATA = ("zarr.json", ".zarray", ".zattrs", ".zgroup", ".zmetadata")
_METADATA_BYTES = 64 << 20  # bytes; largest metadata file
_ROOM = 1 << 20  # bytes beyond a chunk's decoded size, for poor compression, checksums and an index
_MOST_MISSES = 8  # absent chunks at an address after which other names are no longer tried
_BLOSC_HEADER = struct.Struct("<4B3I")  # last three, in bytes: decoded, of a block, encoded


@dataclass(frozen=True, slots=True)
class Chunks:
    """The chunks of one array.

    codecs  names of the bytes-to-bytes codecs, in the order of encoding
    size    bytes of a decoded chunk; None: only metadata are read
    array   path of the array's metadata file; if that is gone, a missing chunk doesn't mean empty
    others  other names of chunks than the stated ones: on this machine the names that were found,
            at an address the names that are tried
    """

    codecs: tuple[str, ...] = ()
    size: int | None = None
    array: str = ""
    others: tuple[OtherNames, ...] = ()


class GuardedStore(WrapperStore[Store]):
    """Refuses files outside the group, truncated chunks and chunks that decode to too many bytes.

    location  place of the group
    chunks    chunks of the array that is read; None: only metadata are read

    Raises OSError for truncated or oversized chunks, SourceError for a path outside the group.
    """

    def __init__(self, store: Store, location: Location, chunks: Chunks | None = None) -> None:
        super().__init__(store)
        self._location, self._folder = location, location.folder
        self._chunks = chunks or Chunks()
        self._tried, self._misses = self._chunks.others, 0

    def _with_store(self, store: Store) -> "GuardedStore":
        return type(self)(store, self._location, self._chunks)

    @property
    def source(self) -> str:
        """The path or address of the group."""
        return self._location.source

    @property
    def is_local(self) -> bool:
        """Whether the files are on this machine."""
        return self._location.is_local

    @property
    def members(self) -> Set[str] | None:
        """The names of all files in a zip file; None: the source is not a zip file."""
        return self._store.sizes.keys() if isinstance(self._store, ZippedStore) else None

    @property
    def other_names(self) -> OtherNames | None:
        """The names of chunks that differ from the stated ones; None: there are none."""
        others = self._chunks.others
        return others[0] if self._location.is_local and others else None

    async def get(
        self, key: str, prototype: BufferPrototype, byte_range: ByteRequest | None = None
    ) -> Buffer | None:
        """Return the bytes at a key, or at another name of its chunk; None: no such file."""
        value = await self._checked(key, prototype, byte_range)
        tried = self._tried
        for names in self._tried if value is None else ():
            if other := names.key_of(key):
                value = await self._checked(other, prototype, byte_range)
            if value is not None:
                self._tried = (names,)
                return value
        if value is None and len(tried) > 1:
            self._misses += 1
            self._tried = tried if self._misses < _MOST_MISSES else ()
        return value

    async def _checked(
        self, key: str, prototype: BufferPrototype, byte_range: ByteRequest | None
    ) -> Buffer | None:
        is_metadata = key.rsplit("/", 1)[-1] in _METADATA
        size, array = self._chunks.size, self._chunks.array
        most = _METADATA_BYTES if is_metadata or size is None else self._most(2)
        self._require_own(key, most)
        value = await self._store.get(key, prototype, byte_range)
        if value is None and array and not await self._store.exists(array):
            raise OSError(f"{array} was removed after it was opened")
        if value is not None and is_metadata and byte_range is None:
            record_json(value.to_bytes(), key)
        elif value is not None and byte_range is None and size is not None:
            if words := pointer_words(value[:HEAD_BYTES].to_bytes()):
                raise OSError(f"chunk {key}: found {words}")
            self._require_fit(key, value)
        if value is not None and isinstance(byte_range, RangeByteRequest):
            asked = byte_range.end - byte_range.start
            if len(value) < asked:  # the shard's index leads beyond the end of its file
                raise OSError(
                    f"shard {key} is cut short ({len(value)} of {asked} bytes of a chunk)"
                )
        return value

    async def get_partial_values(
        self,
        prototype: BufferPrototype,
        key_ranges: Iterable[tuple[str, ByteRequest | None]],
    ) -> list[Buffer | None]:
        """Return the bytes of each key and range, checked as in `get`."""
        return [await self.get(key, prototype, byte_range) for key, byte_range in key_ranges]

    def _require_own(self, key: str, most: int) -> None:
        named = f"{self._location.shown}: {key!r:.200}"
        if not self._location.is_local:
            require_own_key(key, named)
            return
        found = require_own(f"{self._location.source}/{key}", [self._folder], named=named)
        size = found.st_size if found is not None else 0
        if isinstance(self._store, ZippedStore):
            size = self._store.sizes.get(key, 0)
        if size > most:
            raise OSError(f"{key}: found {size} bytes, more than {most}")

    def _most(self, times: int) -> int:
        return times * (self._chunks.size or 0) + _ROOM

    def _require_fit(self, key: str, value: Buffer) -> None:
        codecs = list(self._chunks.codecs)
        end = len(value)
        while codecs and codecs[-1] == "crc32c":
            codecs.pop()
            end -= 4
        measure = _UNPACKED.get(codecs[-1]) if codecs else None
        if measure is None:
            return
        most = self._most(1)
        try:
            size = measure(value.to_bytes()[: max(end, 0)], most)
        except Exception as error:
            if is_undecoded(error):
                raise DamagedError(f"chunk {key}: {damage_words(error)}") from error
            raise
        if size > most:
            raise OSError(
                f"chunk {key} unpacks to over {most} bytes, more than its array's metadata state"
            )


def _of_zstd(data: bytes, most: int) -> int:
    size: int = zstandard.get_frame_parameters(data).content_size
    if 0 <= size < 1 << 62:  # any other value means that the size is not stated
        return size
    total = 0
    reader = zstandard.ZstdDecompressor().stream_reader(data)
    while total <= most and (part := reader.read(1 << 20)):
        total += len(part)
    return total


def _of_blosc(data: bytes, most: int) -> int:
    if len(data) < _BLOSC_HEADER.size:
        raise OSError(f"a chunk is cut short ({len(data)} bytes)")
    *_, unpacked, _, packed = _BLOSC_HEADER.unpack_from(data)
    if len(data) < packed:
        raise OSError(f"a chunk is cut short ({len(data)} of {packed} bytes)")
    return int(unpacked)


def _of_lz4(data: bytes, most: int) -> int:
    return int(struct.unpack_from("<I", data)[0])


def _streamed(make: Callable[[], Any]) -> Callable[[bytes, int], int]:
    """Return a measure that decodes up to its limit in bytes and discards the result."""

    def measure(data: bytes, most: int) -> int:
        total = 0
        while data and total <= most:
            stream = make()
            total += len(stream.decompress(data, most + 1 - total))
            data = stream.unused_data if stream.eof else b""
        return total

    return measure


_UNPACKED: dict[str, Callable[[bytes, int], int]] = {
    "zstd": _of_zstd,
    "blosc": _of_blosc,
    "lz4": _of_lz4,
    "gzip": _streamed(lambda: zlib.decompressobj(47)),
    "zlib": _streamed(lambda: zlib.decompressobj(47)),
    "bz2": _streamed(bz2.BZ2Decompressor),
    "lzma": _streamed(lzma.LZMADecompressor),
}


def codec_name(codec: Any) -> str:
    """Return the name of a codec of Zarr v3 or of numcodecs, such as `gzip`."""
    name = type(codec).__name__.lower().removesuffix("codec").strip("_")
    return str(name)


@contextmanager
def zarr_boundary(where: str, expected: str) -> Iterator[None]:
    """Turn an error of zarr inside the block into a SourceError of one line: see `one_line`.

    zarr's warnings of metadata that other writers leave are silenced: a user can't change these.
    """
    starts = "Both zarr.json|Numcodecs codecs|Object at |Found an empty list of filters"
    with without_warning(starts, UserWarning), one_line(where, expected):
        try:
            yield
        except NodeNotFoundError as error:
            raise SourceError(
                f"{where}: zarr.json, .zgroup or .zarray: not found, or not reachable, expected "
                f"{expected}"
            ) from error


def open_store(location: Location) -> Store:
    """Return the store of a group or an array; read it only through a GuardedStore."""
    if is_zipped(location):
        return open_zipped(location)
    if location.is_local:
        return LocalStore(location.source, read_only=True)
    if location.shown.endswith((".ozx", ".zip")):
        raise SourceError(
            f"{location.shown}: found a zip file at an address, expected a path on this machine: "
            "copy it here first, or unpack it there"
        )
    with one_line(location.shown, "an address that fsspec opens"):
        return FsspecStore.from_url(
            location.source, storage_options=location.storage_options, read_only=True
        )


def notes_on_names(arrays: Iterable["zarr.Array[Any]"]) -> tuple[str, ...]:
    """Return a note for each array whose chunks are named differently than its metadata state."""
    found = ((array, getattr(array.store, "other_names", None)) for array in arrays)
    return tuple(names.note(array.ndim) for array, names in found if names is not None)


def files_of(location: Location, arrays: Sequence[str]) -> tuple[str, ...]:
    """Return all that is read of a group: the folders of its arrays, and its own metadata.

    A folder can't be listed over `http`, so the metadata files of the arrays stand in for it.
    """
    if is_zipped(location):
        return (location.path,)
    root = location.source.rstrip("/")
    metadata = [f"{root}/{name}" for name in _METADATA]
    folders = [f"{root}/{path}".rstrip("/") for path in arrays]
    if location.source.startswith("http"):
        folders = [f"{folder}/{name}" for folder in folders for name in ("zarr.json", ".zarray")]
    return tuple(dict.fromkeys([*folders, *metadata]))


def open_array(
    location: Location,
    store: Store,
    path: str,
    *,
    zarr_format: Any = None,
    title: str = "level",
    item_bytes: int | None = None,
) -> "zarr.Array[Any]":
    """Return the array at a path of a store, with checks on its chunks. Raises SourceError.

    title       name of the array's kind, for messages
    item_bytes  bytes of a value in a chunk, for texts, whose type doesn't state a length
    """
    where = f"{location.shown}: {title} {path!r:.80}" if path else location.shown
    with zarr_boundary(where, "a Zarr array"):
        guard = GuardedStore(store, location)
        array = zarr.open_array(guard, path=path, mode="r", zarr_format=zarr_format)
        # The codecs of a sharded array compress its inner chunks, not the shard as a whole.
        codecs = () if array.shards else tuple(codec_name(codec) for codec in array.compressors)
        size = math.prod(array.shards or array.chunks) * (item_bytes or array.dtype.itemsize)
        named = "zarr.json" if array.metadata.zarr_format == 3 else ".zarray"
        # `path` may end in a slash, so the array's own path is used.
        names = possible_names(array)
        if location.is_local:
            found = names_on_disk(location, array, guard.members)
            names = (found,) if found is not None else ()
        chunks = Chunks(codecs, size, f"{array.path}/{named}".lstrip("/"), names)
        guard = GuardedStore(store, location, chunks)
        return zarr.open_array(guard, path=path, mode="r", zarr_format=zarr_format)
