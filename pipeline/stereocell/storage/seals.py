"""The hash that a record of a build holds of its own content.

Records of JSON and records of text hold it in different places: see json_files.py, sealed_text.py.
Both are read and held against it here.
"""

from pathlib import Path

from stereocell.model.errors import OutputError
from stereocell.storage.workspace import fetch

_DIGITS = 12  # digits of two hashes that are shown where they differ


def read_record(path: Path, remedy: str) -> bytes:
    """Return the bytes of a record.

    remedy  the user's next step where the file is missing or damaged, for messages

    Raises OutputError where it is missing or can't be read.
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

    stated  the hash that the record states; None: it has none
    digest  the hash of its content
    place   where the hash is expected, for messages
    """
    if stated is None:
        raise OutputError(
            f"{path}: has no hash of its content, expected {place}: it is of an earlier version, "
            f"or was written or changed by hand: {remedy}"
        )
    if stated != digest:
        raise OutputError(damaged(path, digest, stated, remedy))


def damaged(path: Path, digest: str, expected: str, remedy: str) -> str:
    """Return the line on a record whose content has another hash than the record states.

    Both hashes are shown up to the first digit that differs, so that they never look equal.
    """
    pairs = enumerate(zip(digest, expected, strict=False))
    differs = next((place for place, (a, b) in pairs if a != b), len(expected))
    shown = max(_DIGITS, differs + 1)
    return (
        f"{path}: damaged or changed by hand: its content has SHA-256 {digest[:shown]}, expected "
        f"{expected[:shown]}: {remedy}"
    )
