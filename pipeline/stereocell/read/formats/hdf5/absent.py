"""Count the chunks of an HDF5 dataset that are not stored."""

import math
from typing import Any

from stereocell.read.bigdataviewer.absent import count_in_views
from stereocell.read.chunk_counts import Absent, Spans
from stereocell.storage.file_states import FileStates


def count_absent(stored: Any, spans: Spans, states: FileStates) -> Absent | None:
    """Count the chunks of the whole dataset, because HDF5 gives their number at no cost."""
    if hasattr(stored, "view"):
        return count_in_views(stored, spans, states, count_absent)
    dataset = getattr(stored, "dataset", None)
    if dataset is None or dataset.chunks is None:
        return None
    pairs = zip(dataset.shape, dataset.chunks, strict=True)
    total = math.prod(-(-size // chunk) for size, chunk in pairs)
    return Absent(total - int(dataset.id.get_num_chunks()), total, "chunk", dataset.fillvalue)
