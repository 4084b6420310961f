"""Count the blocks of an N5 dataset that are not stored."""

from typing import Any

from stereocell.read.bigdataviewer.absent import count_in_views
from stereocell.read.chunk_counts import (
    MOST_COUNTED,
    Absent,
    Spans,
    count_keys,
    number_of,
    places_of,
)
from stereocell.storage.file_states import FileStates


def count_absent(stored: Any, spans: Spans, states: FileStates) -> Absent | None:
    """Return how many blocks of a part are absent; None: they can't be counted."""
    if hasattr(stored, "view"):
        return count_in_views(stored, spans, states, count_absent)
    if not hasattr(stored, "path_of") or number_of(stored.chunks, spans) > MOST_COUNTED:
        return None
    names = states.names()
    # With BigDataViewer's XML as the source, the files lie beside it, not below it.
    outside = "" if stored.folder == states.location.source else f"{stored.folder.lstrip('/')}/"
    paths = (outside + stored.path_of(place) for place in places_of(stored.chunks, spans))
    return count_keys(paths, names, "block", 0)
