"""Count the blocks that a BigDataViewer container does not store.

Here a view is one setup at one time point, an array of its own.
"""

from collections.abc import Callable
from typing import Any

from stereocell.read.chunk_counts import Absent, Spans
from stereocell.storage.file_states import FileStates


def count_in_views(
    stored: Any,
    spans: Spans,
    states: FileStates,
    count: Callable[[Any, Spans, FileStates], Absent | None],
) -> Absent | None:
    """Return how many blocks of the views in `spans` are absent; None: they can't be counted.

    count  function that counts the absent blocks of one view
    """
    times, channels, *place = spans
    found = []
    for time in (n for one in times for n in one):
        for channel in (n for one in channels for n in one):
            found.append(count(stored.view(time, channel), place, states))
    known = [one for one in found if one is not None]
    if not known or len(known) < len(found):
        return None
    return Absent(
        sum(one.count for one in known), sum(one.total for one in known), known[0].noun, 0
    )
