"""The hash that a record of a build holds of itself, in messages."""

from pathlib import Path

_DIGITS = 12  # that are shown where they differ


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
