"""Hashes of all files in a folder, to compare folders by."""

import hashlib
from pathlib import Path

PARTS = ("units", "stage", "bundle")


def digests_of(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of every file below a folder by its path from there, in order."""
    return {
        file.relative_to(folder).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(folder.rglob("*"))
        if file.is_file()
    }


def digests_of_build(out: Path) -> dict[str, str]:
    """Return those of a build's units, stage and bundle, without files that hold seconds."""
    return {
        f"{part}/{path}": digest
        for part in PARTS
        for path, digest in digests_of(out / part).items()
        if not path.endswith("seconds.json")
    }
