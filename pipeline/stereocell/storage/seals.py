"""Check a record of a build by the hash that it holds of its own content.

JSON and texts hold the hash in different places (json_files.py, sealed_text.py). Both are read and
checked here.
"""

from pathlib import Path

from stereocell.model.errors import OutputError
from stereocell.storage.workspace import fetch

_DIGITS = 12  # fewest digits that are shown of two different hashes


def read_record(path: Path, remedy: str) -> bytes:
    """Return the bytes of a record.

    remedy  what the user should do if the file is missing or damaged, for messages

    Raises OutputError if it is missing or can't be read.
    """
    fetch(path)
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise OutputError(f"{path} is missing: {remedy}") from None
    except OSError as error:
        raise OutputError(f"{path}: can't be read ({error.strerror})") from None


def require_seal(path: Path, stated: str | None, digest: str, *, place: str, remedy: str) -> None:
    """Raise OutputError unless a record states the hash of its content.

    stated  hash that the record states; None: it states none
    digest  hash of its content
    place   words for the place of the hash, for messages
    """
    if stated is None:
        raise OutputError(
            f"{path}: found no hash of its content, expected {place}: an earlier version wrote it, "
            f"or it was written or changed by hand: {remedy}"
        )
    if stated != digest:
        raise OutputError(damaged(path, digest, stated, remedy))


def damaged(path: Path, digest: str, expected: str, remedy: str) -> str:
    """Return the line on a record whose content does not match the hash that it states.

    Both hashes are shown up to the first different digit at least, so that they never look equal.
    """
    pairs = enumerate(zip(digest, expected, strict=False))
    differs = next((place for place, (a, b) in pairs if a != b), len(expected))
    shown = max(_DIGITS, differs + 1)
    return (
        f"{path}: damaged or changed by hand: its content has SHA-256 {digest[:shown]}, expected "
        f"{expected[:shown]}: {remedy}"
    )
