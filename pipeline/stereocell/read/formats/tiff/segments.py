"""Check that the strips and tiles of pages can belong to one file.

tifffile reads the bytes at each stated offset, wherever that is. So a damaged offset or size would
read a part of another plane, or rows of a directory, as voxels. Two segments of a sound file don't
overlap, unless a writer stores equal segments once. The size of an uncompressed segment follows
from its samples; the last strip may be stated as large as the others.

References: TIFF 6.0 sections 3 and 15
"""

from collections import defaultdict
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tifffile import TiffPage

from stereocell.model.errors import SourceError

_UNCOMPRESSED = 1  # value of the tag Compression
_ENTRY_BYTES, _BIG_ENTRY_BYTES = 12, 20  # bytes of a directory's entry, in TIFF and in BigTIFF
_AGAIN = "copy or download it again"


def require_segments(where: str, tiff: Any, pages: Iterable[Any]) -> None:
    """Raise SourceError where segments overlap, or don't have the size of their samples.

    tiff   the TiffFile that `where` names; pages of other files are named after those files
    pages  TiffPage or TiffFrame of tifffile. LSM and STK are not checked, since tifffile replaces
           their offsets and sizes
    """
    of_files: defaultdict[Any, list[Any]] = defaultdict(list)
    for page in pages:
        if page.dataoffsets and not (page.keyframe.is_lsm or page.keyframe.is_stk):
            of_files[page.parent].append(page)
    for parent, some in of_files.items():
        named = where if parent is tiff else f"{where}: {parent.filename!r:.100}"
        for page in some:
            _require_size(named, page)
        _require_apart(named, np.concatenate([_places(page) for page in some]))


def _require_size(where: str, page: Any) -> None:
    key = page.keyframe
    if key.compression != _UNCOMPRESSED or page.is_contiguous:
        return
    counts = np.array(page.databytecounts, np.int64)
    needed = _sizes(key, len(counts))
    is_other = (counts > 0) & ((counts < needed) | (counts > needed.max(initial=0)))
    if is_other.any():
        index = int(is_other.argmax())
        tag = "TileByteCounts" if key.is_tiled else "StripByteCounts"
        raise SourceError(
            f"{where}: {tag}[{index}]: found {counts[index]}, expected {needed[index]} bytes, "
            f"since Compression states no compression ({_AGAIN})"
        )


def _sizes(key: Any, count: int) -> NDArray[np.int64]:
    """Return the bytes of each segment of an uncompressed page, int64 (count,)."""
    samples = key.samplesperpixel if key.planarconfig == 1 else 1
    width = key.tilewidth if key.is_tiled else key.imagewidth
    row = -(-width * samples * key.bitspersample // 8)
    if key.is_tiled:
        return np.full(count, key.tiledepth * key.tilelength * row, np.int64)
    strips = -(-key.imagelength // key.rowsperstrip)  # number of strips of one plane
    first_row = np.arange(count) % strips * key.rowsperstrip
    return np.minimum(key.rowsperstrip, key.imagelength - first_row) * row


def _places(page: Any) -> NDArray[np.int64]:
    """Return where a page's directory and segments begin and end in the file, int64 (n, 2)."""
    if page.is_contiguous:
        start = page.dataoffsets[0]
        segments = [(start, start + page.keyframe.nbytes)]
    else:
        pairs = zip(page.dataoffsets, page.databytecounts, strict=False)
        segments = [(start, start + count) for start, count in pairs if count]
    entry = _BIG_ENTRY_BYTES if page.parent.is_bigtiff else _ENTRY_BYTES
    if page.offset:  # pages that tifffile makes up have no directory, and frames keep no tags
        count = len(page.tags) if isinstance(page, TiffPage) else 1
        segments.append((page.offset, page.offset + entry * count))
    return np.array(segments, np.int64).reshape(-1, 2)


def _require_apart(where: str, places: NDArray[np.int64]) -> None:
    places = np.unique(places, axis=0)  # sorted, with shared segments only once
    reach = np.maximum.accumulate(places[:, 1])
    if (overlaps := np.flatnonzero(places[1:, 0] < reach[:-1])).size:
        first = int(places[overlaps[0] + 1, 0])
        raise SourceError(
            f"{where}: StripOffsets or TileOffsets: found two planes or directories that share the "
            f"bytes from {first} on, expected none that overlap ({_AGAIN})"
        )
