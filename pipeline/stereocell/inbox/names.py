"""Check the names of uploaded or archived files. A name is never used as a path unchecked."""

import re
import unicodedata
from collections.abc import Iterable, Sequence

from stereocell.inbox.limits import MAX_FOLDERS, NAME_BYTES, NAME_CHARS
from stereocell.inbox.refused import RefusedError

Parts = tuple[str, ...]
_DRIVE = re.compile(r"[A-Za-z]:")
_WHERE_NOT = "expected a plain name with folders, such as scan/001.dcm"
# Files that operating systems add to folders.
_OF_SYSTEMS = re.compile(
    r"(\._.*|\.DS_Store|Thumbs\.db|desktop\.ini|\.localized|\.Spotlight-V100|\.fseventsd)",
    re.IGNORECASE,
)


def check_name(name: object, where: str) -> Parts:
    """Return the folders and the file of a name. Raises RefusedError for a forbidden name.

    where  the kind of list that contains the name; messages show it, and never the name itself
    """
    if not isinstance(name, str) or not name:
        raise _refused(where, "an empty or missing name")
    if len(name) > NAME_CHARS:
        raise _refused(where, f"{len(name):,} characters", f"at most {NAME_CHARS:,}")
    if not name.isprintable():
        raise _refused(where, "control characters, or half a character")
    if "\\" in name:
        raise _refused(where, "a backslash")
    if name.startswith("/") or _DRIVE.match(name):
        raise _refused(where, "an absolute name")
    parts = tuple(name.split("/"))
    if any(not part.strip(" .") for part in parts):
        raise _refused(where, "a part that is empty or consists of dots")
    if len(parts) > MAX_FOLDERS + 1:
        raise _refused(where, f"{len(parts) - 1} folders", f"at most {MAX_FOLDERS}")
    if any(len(part.encode()) > NAME_BYTES for part in parts):
        raise _refused(where, "a long part", f"at most {NAME_BYTES} bytes each")
    return parts


def check_names(names: Sequence[object], where: str) -> list[Parts]:
    """Return the parts of names that shall lie in one folder together. Raises RefusedError.

    Two names must differ by more than case or the encoding of accents: on some systems they would
    be the same file.
    """
    checked = [check_name(name, where) for name in names]
    files: set[Parts] = set()
    folders: set[Parts] = set()
    for parts in checked:
        folded = tuple(_folded(part) for part in parts)
        if folded in files:
            raise _refused(where, "two names that differ only in case", "each name once")
        files.add(folded)
        folders.update(folded[:end] for end in range(1, len(folded)))
    if files & folders:
        raise _refused(where, "a name that is both a file and a folder", "one of them")
    return checked


def is_of_system(parts: Parts) -> bool:
    """Return whether an operating system has added a file, so that no specimen contains it."""
    return "__MACOSX" in parts or _OF_SYSTEMS.fullmatch(parts[-1]) is not None


def without_shared_folders(names: Iterable[Parts]) -> list[Parts]:
    """Return names without the leading folders that all of them share."""
    found = list(names)
    while found and all(len(parts) > 1 and parts[0] == found[0][0] for parts in found):
        found = [parts[1:] for parts in found]
    return found


def _folded(part: str) -> str:
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", part).casefold())


def _refused(where: str, found: str, expected: str = _WHERE_NOT) -> RefusedError:
    expected = expected if expected.startswith("expected") else f"expected {expected}"
    return RefusedError(400, f"{where}: a file's name: found {found}, {expected}")
