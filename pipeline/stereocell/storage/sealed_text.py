"""Write and check texts of a build that hold their own hash, in a comment on the last line.

They are settings in TOML and pages in HTML. No result depends on them, but readers must know that
they have not been changed. A file with another last line is a user's own file.
"""

import hashlib
import re
from pathlib import Path

from stereocell.model.errors import OutputError
from stereocell.storage.atomic_write import write_bytes
from stereocell.storage.seals import read_record, require_seal

# Begin and end of a comment, by the ending of the file's name
_COMMENTS = {".toml": ("# ", ""), ".html": ("<!-- ", " -->")}
_WORDS = "SHA-256 of the lines above, as StereoCell wrote them: "
_SEAL = re.compile(re.escape(_WORDS) + r"([0-9a-f]{64})( -->)?\Z")


def write_sealed_text(path: Path, text: str) -> None:
    """Write a text and its hash, completely or not at all. Raises OutputError."""
    begin, end = _COMMENTS[path.suffix]
    lines = text if text.endswith("\n") else text + "\n"
    digest = hashlib.sha256(lines.encode()).hexdigest()
    write_bytes(path, f"{lines}{begin}{_WORDS}{digest}{end}\n".encode())


def require_sealed_text(path: Path, remedy: str) -> None:
    """Raise OutputError if a text is missing, changed, or was not written by StereoCell."""
    lines, last = _split(read_record(path, remedy))
    found = _SEAL.search(last)
    require_seal(
        path,
        found and found[1],
        hashlib.sha256(lines).hexdigest(),
        place="it in the last line",
        remedy=remedy,
    )


def is_sealed_text(path: Path) -> bool:
    """Return whether StereoCell wrote a text, and nobody has changed it."""
    try:
        require_sealed_text(path, "")
    except OutputError:
        return False
    return True


def _split(data: bytes) -> tuple[bytes, str]:
    """Return all lines except the last, and the last line."""
    lines, mark, last = data.removesuffix(b"\n").rpartition(b"\n")
    return lines + mark, last.decode("utf-8", "replace")
