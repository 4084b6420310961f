"""Split a multipart answer (RFC 2046), by which WADO-RS sends instances, while it arrives."""

import re
from collections.abc import Iterator
from email.message import Message

from stereocell.model.errors import SourceError
from stereocell.read.addresses.resolved import wrong_answer

_HEADER_BYTES = 1 << 16  # bytes of the largest header of a part
_BOUNDARY = re.compile(r"[0-9A-Za-z'()+_,\-./:=? ]{0,69}[0-9A-Za-z'()+_,\-./:=?]")


def boundary_of(content_type: str, shown: str) -> bytes:
    """Return the separator of the parts. Raises SourceError for an answer of another type."""
    message = Message()
    message["Content-Type"] = content_type.replace("\r", " ").replace("\n", " ")
    found = message.get_content_type()
    if found != "multipart/related":
        words = "a web page" if found == "text/html" else f"{content_type or 'no type'!r:.80}"
        raise wrong_answer(shown, words, "multipart/related; type=application/dicom")
    boundary = message.get_boundary() or ""
    if not _BOUNDARY.fullmatch(boundary):
        raise wrong_answer(shown, "parts without a boundary", "multipart/related; boundary=...")
    return boundary.encode("ascii")


def split_parts(blocks: Iterator[bytes], boundary: bytes, shown: str) -> Iterator[bytes | None]:
    """Yield the bytes of each part in pieces, and None after each part.

    The headers of a part are skipped, and none of their names is used. Raises SourceError where the
    answer ends before its last part does.
    """
    delimiter = b"\r\n--" + boundary
    held = _Held(blocks, shown)
    held.bytes += b"\r\n"  # a delimiter starts with a line break, which the first one may lack
    for _ in held.until(delimiter):
        pass  # text before the first delimiter has no meaning
    while not held.starts_with(b"--"):
        skipped = 0
        for piece in held.until(b"\r\n"):  # the delimiter's line may end with spaces
            skipped += len(piece)
            _require_short(skipped, shown)
        if held.starts_with(b"\r\n"):
            del held.bytes[:2]
        else:
            for piece in held.until(b"\r\n\r\n"):
                skipped += len(piece)
                _require_short(skipped, shown)
        yield from held.until(delimiter)
        yield None


def _require_short(count: int, shown: str) -> None:
    if count > _HEADER_BYTES:
        raise wrong_answer(shown, "a part with an endless header", "DICOM parts")


class _Held:
    """The bytes of an answer that have arrived and are not used yet."""

    def __init__(self, blocks: Iterator[bytes], shown: str) -> None:
        self._blocks, self._shown = blocks, shown
        self.bytes = bytearray()

    def starts_with(self, mark: bytes) -> bool:
        """Return whether the next bytes are those of `mark`. They stay in the buffer."""
        while len(self.bytes) < len(mark):
            self._fill()
        return self.bytes.startswith(mark)

    def until(self, mark: bytes) -> Iterator[bytes]:
        """Yield the bytes before a mark in pieces, and drop the mark."""
        while (at := self.bytes.find(mark)) < 0:
            safe = len(self.bytes) - len(mark) + 1
            if safe > 0:
                yield bytes(self.bytes[:safe])
                del self.bytes[:safe]
            self._fill()
        if at:
            yield bytes(self.bytes[:at])
        del self.bytes[: at + len(mark)]

    def _fill(self) -> None:
        block = next(self._blocks, b"")
        if not block:
            raise SourceError(
                f"{self._shown}: the server's answer ends within a part, expected all parts: "
                "run the same command again"
            )
        self.bytes += block
