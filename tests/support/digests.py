"""Hashes of all files in a folder, to compare folders by."""

import hashlib
from pathlib import Path


def digests_of(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of every file below a folder by its path from there, in order."""
    return {
        file.relative_to(folder).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(folder.rglob("*"))
        if file.is_file()
    }
