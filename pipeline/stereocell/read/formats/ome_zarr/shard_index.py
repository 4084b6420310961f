"""Count the chunks that the index of a Zarr shard lists as absent.

References: Zarr 3, codec `sharding_indexed`
"""

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from zarr.abc.store import RangeByteRequest, SuffixByteRequest
from zarr.codecs import ShardingCodec
from zarr.core.buffer import default_buffer_prototype
from zarr.core.sync import sync

_ABSENT = np.uint64(2**64 - 1)  # offset and length of a chunk that is not stored
_ENTRY = 16  # bytes of a chunk's offset and length
_CHECKSUM = 4  # bytes of CRC-32C after the index
_MOST_SHARDS = 2000  # shards whose index is read at most


def absent_in_shards(
    stored: Any, touched: Sequence[Sequence[int]], is_present: Any
) -> tuple[int, int, bool] | None:
    """Return the numbers of absent and of all chunks, and whether a stored shard lacks a chunk.

    stored      a sharded Zarr array, in a store that checks its reads
    touched     chunks along each axis that are read
    is_present  returns whether the file of a shard at an index is stored

    None: the index has another form, or there are too many shards.
    """
    if (codec := _codec_of(stored)) is None:
        return None
    per = [shard // chunk for shard, chunk in zip(stored.shards, stored.chunks, strict=True)]
    groups = [_grouped(chunks, n) for chunks, n in zip(touched, per, strict=True)]
    if np.prod([len(group) for group in groups], dtype=float) > _MOST_SHARDS:
        return None
    absent = total = 0
    is_within = False
    for places in product(*(group.items() for group in groups)):
        shard, inner = tuple(at for at, _ in places), [chunks for _, chunks in places]
        count = int(np.prod([len(chunks) for chunks in inner]))
        total += count
        if not is_present(shard):
            absent += count
            continue
        index = _index_of(stored, shard, codec, per)
        if index is None:
            return None
        lacking = int(np.count_nonzero(index[np.ix_(*inner)] == _ABSENT))
        absent, is_within = absent + lacking, is_within or lacking > 0
    return absent, total, is_within


def _codec_of(stored: Any) -> ShardingCodec | None:
    """Return the codec of an array whose index is little-endian, with or without a checksum."""
    codecs: Iterator[Any] = (c for c in stored.metadata.codecs if isinstance(c, ShardingCodec))
    codec = next(codecs, None)
    if codec is None:
        return None
    names = [str(one.to_dict().get("name")) for one in codec.index_codecs]
    order = str(codec.index_codecs[0].to_dict().get("configuration", {}))
    is_known = names in (["bytes"], ["bytes", "crc32c"]) and "big" not in order
    return codec if is_known else None


def _grouped(chunks: Sequence[int], per: int) -> dict[int, list[int]]:
    """Return the indices of chunks inside their shards along one axis, by shard."""
    found: dict[int, list[int]] = {}
    for chunk in chunks:
        found.setdefault(chunk // per, []).append(chunk % per)
    return found


def _index_of(
    stored: Any, shard: tuple[int, ...], codec: ShardingCodec, per: Sequence[int]
) -> NDArray[np.uint64] | None:
    """Return the offsets of a shard's chunks, uint64 of shape `per`; None: they can't be read."""
    size = _ENTRY * int(np.prod(per))
    stored_size = size + _CHECKSUM * (len(codec.index_codecs) > 1)
    at_end = str(getattr(codec.index_location, "value", codec.index_location)) == "end"
    where = SuffixByteRequest(stored_size) if at_end else RangeByteRequest(0, stored_size)
    key = f"{stored.path}/{stored.metadata.encode_chunk_key(shard)}".lstrip("/")
    found = sync(stored.store.get(key, default_buffer_prototype(), where))
    content = found.to_bytes()[:size] if found is not None else b""
    if len(content) < size:
        return None
    return np.frombuffer(content, "<u8").reshape(*per, 2)[..., 0]
