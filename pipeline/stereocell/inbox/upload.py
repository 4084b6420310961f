"""An upload: the bytes of all files as one stream, which may stop and continue at any byte.

    names.json      the announcement: the names and sizes of the files, or an address
    parts/000000    the bytes of the first file that have arrived, under a neutral name
    parts/000001    ...

The sizes of the parts tell how far the stream has come. An upload thus continues after a crash.
"""

import errno
import hashlib
import json
import os
import re
import time
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stereocell.inbox.limits import ADDRESS_CHARS, InboxLimits
from stereocell.inbox.names import Parts, check_names
from stereocell.inbox.refused import RefusedError
from stereocell.storage.json_files import compact_json

_NAMES, _PARTS = "names.json", "parts"
_LIST = "files"
_MARK = re.compile(r"([0-9a-f]{64})?")


@dataclass(frozen=True, slots=True)
class Announced:
    """The files or the address that a person announces before the upload.

    names, sizes  the files' names and sizes in bytes, in the order of the stream
    address       empty for files
    mark          a hash of samples of the files' bytes; it distinguishes files of equal names and
                  sizes, such as those of two patients. Empty if the client sent none.
    """

    names: tuple[str, ...] = ()
    sizes: tuple[int, ...] = ()
    address: str = ""
    mark: str = ""

    @property
    def total(self) -> int:
        """Number of bytes of all files."""
        return sum(self.sizes)

    @property
    def digest(self) -> str:
        """A hash by which an interrupted upload is found again."""
        content = [self.address, self.mark, list(zip(self.names, self.sizes, strict=True))]
        return hashlib.sha256(json.dumps(content).encode()).hexdigest()

    @property
    def parts(self) -> list[Parts]:
        """The names of the files, each split into its folders and the file's own name."""
        return [tuple(name.split("/")) for name in self.names]


def parse_announced(content: Any, limits: InboxLimits) -> Announced:
    """Return the announcement in a request's body. Raises RefusedError."""
    is_object = isinstance(content, dict)
    mark = content.pop("mark", "") if is_object and "files" in content else ""
    if not isinstance(mark, str) or not _MARK.fullmatch(mark):
        raise RefusedError(400, "mark: expected 64 hexadecimal digits in lower case")
    if not is_object or len(content) != 1:
        raise RefusedError(400, 'items: expected {"files": [[name, bytes], ...]} or {"address": A}')
    if isinstance(address := content.get("address"), str):
        if not 0 < len(address) <= ADDRESS_CHARS:
            raise RefusedError(400, f"address: expected 1 to {ADDRESS_CHARS} characters")
        return Announced(address=address)
    files = content.get("files")
    if not isinstance(files, list) or not files:
        raise RefusedError(400, "files: expected a list of names and sizes that is not empty")
    if len(files) > limits.files:
        raise RefusedError(
            413, f"files: found {len(files):,}, expected at most {limits.files:,}: zip them"
        )
    sizes = []
    for one in files:
        if not isinstance(one, list) or len(one) != 2:
            raise RefusedError(400, "files: expected a name and a size in bytes for each file")
        if type(one[1]) is not int or one[1] < 0:
            raise RefusedError(400, "files: expected a whole number from 0 as a file's size")
        sizes.append(one[1])
    names = ["/".join(parts) for parts in check_names([one[0] for one in files], "files")]
    if not sum(sizes):
        raise RefusedError(400, "files: found no bytes, expected files that are not empty")
    if sum(sizes) > limits.bytes:
        raise RefusedError(
            413, f"files: found {sum(sizes):,} bytes, expected at most {limits.bytes:,}"
        )
    return Announced(tuple(names), tuple(sizes), mark=mark)


class Upload:
    """The folder of one upload. Only one thread may write at a time."""

    def __init__(self, folder: Path, announced: Announced) -> None:
        self.folder, self.announced = folder, announced
        self._starts = _starts_of(announced.sizes)
        self.offset = self._find_offset()

    @classmethod
    def create(cls, folder: Path, announced: Announced) -> "Upload":
        """Create the folder, which only its owner may read. Raises RefusedError."""
        try:
            folder.mkdir(parents=True, mode=0o700)
            (folder / _PARTS).mkdir()
            files = list(zip(announced.names, announced.sizes, strict=True))
            content = {_LIST: files, "address": announced.address, "mark": announced.mark}
            (folder / _NAMES).write_bytes(compact_json(content))
        except OSError as error:
            raise not_written(error) from None
        return cls(folder, announced)

    @classmethod
    def open(cls, folder: Path) -> "Upload | None":
        """Return the upload of a folder; None if there is none."""
        try:
            content = json.loads((folder / _NAMES).read_bytes())
            names, sizes = zip(*content[_LIST], strict=True) if content[_LIST] else ((), ())
        except (OSError, ValueError, KeyError):
            return None
        address, mark = content["address"], content.get("mark", "")
        return cls(folder, Announced(tuple(names), tuple(sizes), address, mark))

    @property
    def is_whole(self) -> bool:
        """Whether all bytes have arrived."""
        return self.offset >= self.announced.total

    @property
    def age_h(self) -> float:
        """Hours since the last byte arrived."""
        newest = max(
            (path.stat().st_mtime for path in (self.folder, self.folder / _PARTS, *self._last())),
            default=0.0,
        )
        return (time.time() - newest) / 3600

    def part(self, index: int) -> Path:
        """Return the path of the part that holds a file."""
        return self.folder / _PARTS / f"{index:06d}"

    def write(self, data: bytes) -> None:
        """Append bytes to the stream. Raises RefusedError if the disk takes no more."""
        view = memoryview(data)[: self.announced.total - self.offset]
        while view:
            index = _index_at(self._starts, self.offset)
            room = self._starts[index + 1] - self.offset
            try:
                with self.part(index).open("ab") as file:
                    file.write(view[:room])
            except OSError as error:
                self.offset = self._find_offset()
                raise not_written(error) from None
            self.offset += min(room, len(view))
            view = view[room:]

    def finish(self) -> None:
        """Create the empty files, for which no byte arrives. Raises RefusedError."""
        try:
            for index, size in enumerate(self.announced.sizes):
                if not size:
                    self.part(index).touch()
        except OSError as error:
            raise not_written(error) from None

    def _last(self) -> list[Path]:
        index = _index_at(self._starts, max(0, self.offset - 1))
        return [path for path in [self.part(index)] if path.exists()]

    def _find_offset(self) -> int:
        """Return the number of bytes in the parts; cut a part that is longer than its file."""
        offset = 0
        for index, size in enumerate(self.announced.sizes):
            path = self.part(index)
            found = path.stat().st_size if path.exists() else 0
            if found > size:
                os.truncate(path, size)
            offset += min(found, size)
            if found < size:
                break
        return offset


def not_written(error: OSError) -> RefusedError:
    """Return the refusal for a disk that takes no more bytes."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return RefusedError(507, "the server's disk is full: free space to continue the upload")
    return RefusedError(507, f"the server can't write ({error.strerror}): inform its owner")


def _starts_of(sizes: Sequence[int]) -> list[int]:
    starts = [0]
    for size in sizes:
        starts.append(starts[-1] + size)
    return starts


def _index_at(starts: Sequence[int], offset: int) -> int:
    """Return the index of the file that contains the byte at an offset of the stream."""
    return min(max(0, bisect_right(starts, offset) - 1), max(0, len(starts) - 2))
