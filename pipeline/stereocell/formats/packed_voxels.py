"""Pack a volume losslessly and fast, for files that only this package reads.

The file is numpy's .npz: Blosc frames one after the other, and where each ends. Three stains of
16 bits, 311 MB, become 168 MB in .4 s of CPU, with bits of equal weight side by side. Others: LZ4
with bytes side by side 187 MB and .4 s; zstd 159 MB and .9 s.
"""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numcodecs import blosc
from numpy.typing import NDArray

_FRAME = 1 << 20  # voxels in a frame
_LEVEL, _BITS_TOGETHER = 5, blosc.BITSHUFFLE


def pack_voxels(voxels: NDArray[Any]) -> bytes:
    """Return the content of a file with voxels of any shape and number type.

    The same voxels give the same bytes.
    """
    flat = np.ascontiguousarray(voxels).reshape(-1)
    with _one_thread():
        frames = [
            blosc.compress(flat[start : start + _FRAME], b"lz4", _LEVEL, _BITS_TOGETHER)
            for start in range(0, len(flat), _FRAME)
        ]
    file = io.BytesIO()  # numpy's own writer does not report a full disk
    np.savez(
        file,
        frames=np.frombuffer(b"".join(frames), np.uint8),
        ends=np.cumsum([0, *map(len, frames)]),
        shape=np.array(voxels.shape),
        dtype=np.array(voxels.dtype.str),
    )
    return file.getvalue()


@contextmanager
def _one_thread() -> Iterator[None]:
    """Let Blosc compress in the calling thread.

    With several threads it writes the blocks of a frame in the order in which they get ready.
    """
    before, blosc.use_threads = blosc.use_threads, False
    try:
        yield
    finally:
        blosc.use_threads = before


def unpack_voxels(path: Path) -> NDArray[Any]:
    """Return the voxels of a file.

    Raises OSError, ValueError, LookupError, EOFError, RuntimeError or BadZipFile for a damaged one.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "voxels.npz"
    ...     _ = file.write_bytes(pack_voxels(np.arange(6, dtype=np.int16).reshape(1, 2, 3)))
    ...     unpack_voxels(file).tolist()
    [[[0, 1, 2], [3, 4, 5]]]
    """
    with path.open("rb") as file, np.load(file) as arrays:
        frames, ends = arrays["frames"], arrays["ends"].tolist()
        voxels = np.empty(arrays["shape"], str(arrays["dtype"]))
    flat = voxels.reshape(-1)
    for k, (start, end) in enumerate(pairwise(ends)):
        part = flat[k * _FRAME : (k + 1) * _FRAME]
        part[:] = np.frombuffer(blosc.decompress(frames[start:end]), voxels.dtype)
    return voxels
