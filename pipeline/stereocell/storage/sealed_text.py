"""Texts of a build that hold a hash of themselves, in a comment on their last line.

They are settings in TOML and pages in HTML. Nothing is built from them, but a person who reads them
must know that they are as they were written; and a file with another last line is somebody's own.
"""

import hashlib
import re
from pathlib import Path

from stereocell.model.errors import OutputError
from stereocell.storage.atomic_write import write_bytes
from stereocell.storage.seals import damaged
from stereocell.storage.workspace import fetch

# ending of the name -> how a comment begins and ends
_COMMENTS = {".toml": ("# ", ""), ".html": ("<!-- ", " -->")}
_WORDS = "SHA-256 of the lines above, as StereoCell wrote them: "
_SEAL = re.compile(re.escape(_WORDS) + r"([0-9a-f]{64})( -->)?\Z")


def write_sealed_text(path: Path, text: str) -> None:
    """Write a text and its hash, whole or not at all. Raises OutputError."""
    begin, end = _COMMENTS[path.suffix]
    lines = text if text.endswith("\n") else text + "\n"
    digest = hashlib.sha256(lines.encode()).hexdigest()
    write_bytes(path, f"{lines}{begin}{_WORDS}{digest}{end}\n".encode())


def require_sealed_text(path: Path, remedy: str) -> None:
    """Raise OutputError where a text is missing, changed, or was not written by StereoCell."""
    fetch(path)
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise OutputError(f"{path} is missing: {remedy}") from None
    except OSError as error:
        raise OutputError(f"{path}: can't be read ({error.strerror})") from None
    lines, last = _split(data)
    found = _SEAL.search(last)
    if found is None:
        raise OutputError(
            f"{path}: has no hash of its content in its last line: it is of an earlier version, or "
            f"was written or changed by hand: {remedy}"
        )
    digest = hashlib.sha256(lines).hexdigest()
    if found[1] != digest:
        raise OutputError(damaged(path, digest, found[1], remedy))


def is_sealed_text(path: Path) -> bool:
    """Return whether a text is as StereoCell wrote it."""
    try:
        require_sealed_text(path, "")
    except OutputError:
        return False
    return True


def _split(data: bytes) -> tuple[bytes, str]:
    """Return all lines but the last, and the last one."""
    lines, mark, last = data.removesuffix(b"\n").rpartition(b"\n")
    return lines + mark, last.decode("utf-8", "replace")
