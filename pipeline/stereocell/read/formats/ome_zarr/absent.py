"""Count the chunks of a Zarr array that are not stored."""

from typing import Any

from stereocell.read.chunk_counts import (
    MOST_COUNTED,
    Absent,
    Spans,
    number_of,
    places_of,
    touched_along,
)
from stereocell.read.formats.ome_zarr.shard_index import absent_in_shards
from stereocell.read.formats.ome_zarr.store import GuardedStore
from stereocell.storage.file_states import FileStates


def count_absent(stored: Any, spans: Spans, states: FileStates) -> Absent | None:
    """Return how many chunks or shards of a part are absent; None: they can't be counted."""
    if not isinstance(getattr(stored, "store", None), GuardedStore):
        return None
    sizes, noun = (stored.shards, "shard") if stored.shards else (stored.chunks, "chunk")
    if number_of(sizes, spans) > MOST_COUNTED:
        return None
    others, members = stored.store.other_names, stored.store.members
    names = members or states.names()
    # If a container's only image was opened, its path starts below the source that was listed.
    below = stored.store.source.removeprefix(states.location.source).strip("/")
    outside = f"{below}/" if below and members is None else ""

    def is_present(place: tuple[int, ...]) -> bool:
        key = f"{stored.path}/{stored.metadata.encode_chunk_key(place)}".lstrip("/")
        if outside + key in names:
            return True
        return others is not None and outside + others.key_of(key) in names

    is_listed = stored.store.is_local and number_of(stored.chunks, spans) <= MOST_COUNTED
    if stored.shards and is_listed:  # at an address, each shard's index would need a request
        pairs = zip(stored.chunks, spans, strict=True)
        touched = [touched_along(size, ranges) for size, ranges in pairs]
        inner = absent_in_shards(stored, touched, is_present)
        if inner is not None and inner[2]:
            return Absent(inner[0], inner[1], "chunk", stored.fill_value)
    found = [is_present(place) for place in places_of(sizes, spans)]
    return Absent(found.count(False), len(found), noun, stored.fill_value)
