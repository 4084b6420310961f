"""An array whose decoded chunks are kept for a while, because a build reads each of them often.

The passes of a build read the same tiles, and an estimate reads small blocks that share chunks.
Decompression takes most of the time of these reads.
"""

from collections import OrderedDict
from collections.abc import Sequence
from itertools import count, product
from math import prod
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

MOST_BYTES = 48_000_000  # bytes of decoded chunks that a process keeps, of all arrays together

_numbers = count()  # a number for each array
_kept: OrderedDict[tuple[int, tuple[int, ...]], NDArray[Any]] = OrderedDict()  # oldest use first
_lock = Lock()


def forget_chunks() -> None:
    """Free the memory of all kept chunks."""
    with _lock:
        _kept.clear()


class DecodedChunks:
    """An array whose chunks are kept after they were read.

    array  decodes the chunks that it is asked for; it is not changed while it is open
    """

    def __init__(self, array: Any) -> None:
        self._array, self._number = array, next(_numbers)
        self.shape: tuple[int, ...] = tuple(array.shape)
        self.chunks: tuple[int, ...] = tuple(array.chunks)
        self.dtype = np.dtype(array.dtype)

    def __getitem__(self, key: Sequence[int | slice]) -> NDArray[Any]:
        """Return voxels by whole numbers and slices without steps, one for each axis."""
        ends = [
            one.indices(n)[:2] if isinstance(one, slice) else (one, one + 1)
            for one, n in zip(key, self.shape, strict=True)
        ]
        cells = [
            range(start // size, -(-stop // size))
            for (start, stop), size in zip(ends, self.chunks, strict=True)
        ]
        number = prod(map(len, cells))
        # Until they are cut apart, the chunks of a window are in memory twice.
        if not 0 < number * prod(self.chunks) * self.dtype.itemsize <= MOST_BYTES // 2:
            return np.asarray(self._array[tuple(key)])
        out = np.empty([stop - start for start, stop in ends], self.dtype)
        for cell, chunk in self._chunks(cells).items():
            first = [c * size for c, size in zip(cell, self.chunks, strict=True)]
            both = [
                (max(a, start), min(b, start + n))
                for (a, b), start, n in zip(ends, first, chunk.shape, strict=True)
            ]
            inner = tuple(slice(a - f, b - f) for (a, b), f in zip(both, first, strict=True))
            outer = tuple(slice(a - s, b - s) for (a, b), (s, _) in zip(both, ends, strict=True))
            out[outer] = chunk[inner]
        return out[tuple(slice(None) if isinstance(one, slice) else 0 for one in key)]

    def _chunks(self, cells: Sequence[range]) -> dict[tuple[int, ...], NDArray[Any]]:
        """Return the chunks of a block of cells. Missing ones are read at once."""
        wanted = list(product(*cells))
        with _lock:
            found = {
                cell: _kept[self._number, cell] for cell in wanted if (self._number, cell) in _kept
            }
            for cell in found:
                _kept.move_to_end((self._number, cell))
        missing = [cell for cell in wanted if cell not in found]
        if missing:
            low, high = np.min(missing, axis=0), np.max(missing, axis=0) + 1
            sizes = np.array(self.chunks)
            block = np.asarray(
                self._array[
                    tuple(
                        slice(int(a), int(b))
                        for a, b in zip(
                            low * sizes, np.minimum(high * sizes, self.shape), strict=True
                        )
                    )
                ]
            )
            for cell in missing:
                start = (np.array(cell) - low) * sizes
                place = tuple(slice(int(a), int(a + n)) for a, n in zip(start, sizes, strict=True))
                found[cell] = block[place].copy()
            self._keep({cell: found[cell] for cell in missing})
        return found

    def _keep(self, chunks: dict[tuple[int, ...], NDArray[Any]]) -> None:
        with _lock:
            held = sum(chunk.nbytes for chunk in (*_kept.values(), *chunks.values()))
            while held > MOST_BYTES:
                held -= _kept.popitem(last=False)[1].nbytes
            for cell, chunk in chunks.items():
                _kept[self._number, cell] = chunk
