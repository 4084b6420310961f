"""Unpack a stream of gzip, zlib, bzip2 or xz to its end, where its checksum stands.

A reader that stops at the last voxel never compares the checksum (CRC-32 of gzip and bzip2,
Adler-32 of zlib, CRC-64 of xz). It would build a damaged file with wrong voxels. Therefore all
readers unpack streams with this module. Bytes behind the voxels are unpacked in pieces and dropped.

A gzip stream may consist of several members, and zeros or other bytes may follow the last member,
as gzip's own tools allow.
"""

import bz2
import io
import lzma
import zlib
from typing import IO, Protocol

PACKINGS = ("zlib", "gzip", "bzip2", "xz")
_PIECE = 1 << 24  # bytes that are unpacked at a time
_MOST_BEHIND = 1 << 32  # bytes unpacked behind the last voxel; a stream with more is refused
_MEMBER = b"\x1f\x8b"  # first bytes of each member of a gzip stream
_AGAIN = "copy or download it again"


class _Stream(Protocol):
    def read(self, size: int, /) -> bytes: ...


def unpack(
    file: IO[bytes] | bytes,
    size: int,
    packing: str,
    *,
    skip: int = 0,
    most_behind: int = _MOST_BEHIND,
) -> bytes:
    """Return `size` unpacked bytes once the checksum of the whole stream has been verified.

    file         an open file at the stream's first byte, or the bytes of the stream
    packing      one of PACKINGS
    skip         unpacked bytes before those that are returned
    most_behind  largest number of unpacked bytes allowed behind them

    Raises OSError, worded for the user, for a stream that is damaged, cut short or too long.
    """
    stream = _opened(io.BytesIO(file) if isinstance(file, bytes) else file, packing)
    parts: list[bytes] = []
    found = passed = behind = 0
    try:
        while passed < skip and (piece := stream.read(min(skip - passed, _PIECE))):
            passed += len(piece)
        while found < size and (piece := stream.read(min(size - found, _PIECE))):
            parts.append(piece)
            found += len(piece)
        while piece := stream.read(min(most_behind + 1, _PIECE)):
            behind += len(piece)
            if behind > most_behind:
                raise OSError(
                    f"the {packing} stream unpacks to over {most_behind} bytes more than the "
                    f"{skip + size} that its header states"
                )
    except EOFError:
        raise OSError(_short(packing, found, size)) from None
    except (zlib.error, lzma.LZMAError) as error:
        raise OSError(_damaged(packing, str(error))) from error
    except OSError as error:
        if str(error) != _BZIP2_FAULT:
            raise
        raise OSError(_damaged(packing, str(error))) from error
    if found < size:
        raise OSError(_short(packing, found, size))
    return b"".join(parts)


# Python's message for damaged data, also where a checksum of bzip2 differs
_BZIP2_FAULT = "Invalid data stream"


def _short(packing: str, found: int, size: int) -> str:
    reason = f"found {found} of {size} bytes"
    if found == size:
        reason = f"it ends before its checksum, after {size} bytes"
    return f"the {packing} stream is cut short: {reason} ({_AGAIN})"


def _damaged(packing: str, reason: str) -> str:
    return f"the {packing} stream is damaged: {reason.rpartition(': ')[2]} ({_AGAIN})"


def _opened(file: IO[bytes], packing: str) -> _Stream:
    if packing == "bzip2":
        return bz2.BZ2File(file)
    if packing == "xz":
        return lzma.LZMAFile(file)
    return _Deflated(file, is_gzip=packing == "gzip")


class _Deflated:
    """A stream of zlib or gzip. zlib itself verifies the checksum of each member."""

    def __init__(self, file: IO[bytes], *, is_gzip: bool) -> None:
        self._file, self._is_gzip = file, is_gzip
        self._stream = self._begun()

    def _begun(self) -> "zlib._Decompress":
        return zlib.decompressobj(zlib.MAX_WBITS + (16 if self._is_gzip else 0))

    def read(self, size: int, /) -> bytes:
        """Return up to `size` unpacked bytes; none at the end. Raises EOFError or zlib.error."""
        packed = self._stream.unconsumed_tail
        while True:
            if self._stream.eof:
                packed = self._next_member()
                if not packed:
                    return b""
                self._stream = self._begun()
            else:
                packed = packed or self._file.read(_PIECE)
            if found := self._stream.decompress(packed, size):
                return found
            if not packed and not self._stream.eof:
                raise EOFError
            packed = self._stream.unconsumed_tail

    def _next_member(self) -> bytes:
        """Return the first bytes of the next gzip member; empty: there is no further member."""
        if not self._is_gzip:
            return b""
        rest = self._stream.unused_data.lstrip(b"\0")
        while len(rest) < len(_MEMBER) and (more := self._file.read(_PIECE)):
            rest = (rest + more).lstrip(b"\0")
        return rest if rest.startswith(_MEMBER) else b""
