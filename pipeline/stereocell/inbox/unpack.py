"""Unpack a stranger's archive, and check it before and during unpacking.

Members become files with the neutral names `000000`, `000001`, ... Their own names are checked and
returned. The sizes that an archive states are checked first; the bytes that come out are counted
again. An archive inside the archive stays packed, like any other file.
"""

import lzma
import stat
import tarfile
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from stereocell.inbox.limits import ALWAYS_BYTES, PACKED_RATIO, InboxLimits
from stereocell.inbox.names import Parts, check_names, is_of_system
from stereocell.inbox.refused import RefusedError
from stereocell.inbox.upload import not_written
from stereocell.read.formats.ome_zarr.archive import zarr_root_in

_BLOCK_BYTES = 1 << 20
_ENCRYPTED = 0x1
_TAR_MARK, _TAR_AT = b"ustar", 257
_PACKED_MARKS = (b"\x1f\x8b", b"BZh", b"\xfd7zXZ\x00")
_TAR_ENDINGS = (".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tbz2", ".tar.xz", ".txz")


@dataclass(frozen=True, slots=True)
class Unpacked:
    """An unpacked file, with the parts of its original name."""

    parts: Parts
    path: Path


def is_zip(path: Path) -> bool:
    """Return whether a file is a zip archive, by its first bytes alone."""
    with path.open("rb") as file:
        return file.read(4) in (b"PK\x03\x04", b"PK\x05\x06")


def is_tar(path: Path, name: str) -> bool:
    """Return whether a file is a tar archive, compressed or not, by its name and first bytes."""
    with path.open("rb") as file:
        head = file.read(_TAR_AT + len(_TAR_MARK))
    is_plain = head[_TAR_AT:] == _TAR_MARK
    return is_plain or (name.lower().endswith(_TAR_ENDINGS) and head.startswith(_PACKED_MARKS))


def is_archive(path: Path, name: str) -> bool:
    """Return whether a file is an archive that the inbox unpacks."""
    return is_zip(path) or is_tar(path, name)


def holds_zarr(path: Path, limits: InboxLimits) -> bool:
    """Return whether a zip archive holds an OME-Zarr group, which readers open without unpacking.

    The members pass the same checks as for unpacking. Raises RefusedError.
    """
    with _whole(), zipfile.ZipFile(path) as archive:
        members = _checked_zip(archive, path, limits)
    return zarr_root_in({"/".join(parts) for _, parts in members}) is not None


def unpack(path: Path, folder: Path, limits: InboxLimits) -> list[Unpacked]:
    """Unpack an archive into a new folder. Raises RefusedError; some files may then remain."""
    folder.mkdir(parents=True)
    with _whole():
        if is_zip(path):
            with zipfile.ZipFile(path) as archive:
                return list(_unpack_zip(archive, path, folder, limits))
        return _unpack_tar(path, folder, limits)


def _unpack_zip(
    archive: zipfile.ZipFile, path: Path, folder: Path, limits: InboxLimits
) -> Iterator[Unpacked]:
    allowed = _Allowance(path, limits)
    for index, (info, parts) in enumerate(_checked_zip(archive, path, limits)):
        if is_of_system(parts):
            continue
        target = folder / f"{index:06d}"
        with archive.open(info) as member:
            allowed.copy(member, target)
        yield Unpacked(parts, target)


def _checked_zip(
    archive: zipfile.ZipFile, path: Path, limits: InboxLimits
) -> list[tuple[zipfile.ZipInfo, Parts]]:
    """Return the files of a zip archive and their names. Raises RefusedError."""
    infos = archive.infolist()
    _require_count(len(infos), limits)
    for info in infos:
        kind = stat.S_IFMT(info.external_attr >> 16)
        if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
            raise _refused("a link or a device", "files and folders")
        if info.flag_bits & _ENCRYPTED:
            raise _refused("members with a password", "none: unpack it and upload the files")
    # zipfile cuts names at a NUL and replaces Windows' separators; the original name counts.
    if any(info.orig_filename != info.filename for info in infos):
        check_names([info.orig_filename.rstrip("/") for info in infos], "archive")
    files = [info for info in infos if not info.is_dir()]
    names = check_names([info.filename for info in files], "archive")
    check_names([info.filename.rstrip("/") for info in infos if info.is_dir()], "archive")
    _Allowance(path, limits).take(sum(info.file_size for info in infos))
    return list(zip(files, names, strict=True))


def _unpack_tar(path: Path, folder: Path, limits: InboxLimits) -> list[Unpacked]:
    allowed, found = _Allowance(path, limits), []
    names: list[str] = []
    with tarfile.open(path, "r|*") as archive:
        for index, info in enumerate(archive):
            _require_count(index + 1, limits)
            if info.isdir():
                if info.name.strip("./"):
                    check_names([info.name.removeprefix("./")], "archive")
                continue
            if not info.isreg() or info.issparse():
                raise _refused("a link, a device or a file with holes", "files and folders")
            names.append(info.name.removeprefix("./"))
            (parts,) = check_names(names[-1:], "archive")
            member = archive.extractfile(info)
            if member is None or is_of_system(parts):
                continue
            found.append(Unpacked(parts, folder / f"{index:06d}"))
            allowed.copy(member, found[-1].path)
    check_names(names, "archive")
    return found


class _Allowance:
    """Counts the bytes that come out of an archive, up to a limit that its own size sets."""

    def __init__(self, path: Path, limits: InboxLimits) -> None:
        packed = path.stat().st_size
        self._most = min(limits.bytes, max(ALWAYS_BYTES, PACKED_RATIO * packed))
        self._taken = 0

    def take(self, count: int) -> None:
        """Count bytes. Raises RefusedError if the sum exceeds the limit."""
        self._taken += count
        if self._taken > self._most:
            raise RefusedError(
                413,
                f"archive: found {self._taken:,} bytes or more in it, expected at most "
                f"{self._most:,}: upload the files instead",
            )

    def copy(self, member: IO[bytes], target: Path) -> None:
        """Write a member's bytes into a new file."""
        try:
            with target.open("xb") as file:
                while block := member.read(_BLOCK_BYTES):
                    self.take(len(block))
                    file.write(block)
        except OSError as error:
            if error.errno is None:  # this error is the archive library's, not the system's
                raise
            raise not_written(error) from None


@contextmanager
def _whole() -> Iterator[None]:
    """Turn the errors of damaged archives into one line."""
    try:
        yield
    except NotImplementedError:
        raise _refused("an unknown compression", "deflate or none") from None
    except (
        zipfile.BadZipFile,
        tarfile.TarError,
        zlib.error,
        lzma.LZMAError,
        EOFError,
        OSError,
        ValueError,
        RuntimeError,
        OverflowError,
    ) as error:
        if isinstance(error, RefusedError):
            raise
        raise _refused("damage", "an undamaged archive: pack it again") from None


def _require_count(count: int, limits: InboxLimits) -> None:
    if count > limits.files:
        raise RefusedError(
            413,
            f"archive: found {count:,} members or more, expected at most {limits.files:,}: "
            "split it",
        )


def _refused(found: str, expected: str) -> RefusedError:
    return RefusedError(400, f"archive: found {found}, expected {expected}")
