"""A viewer of a few files that stands in for the built one."""

import gzip
from pathlib import Path

import pytest

from stereocell.bundle import blob_page

_FILES = {
    "index.html": b"<!doctype html>",
    "assets/index-1.css": b"style",
    "assets/viewer-1.js": b"plain",
    "assets/viewer-1.js.gz": gzip.compress(b"plain", mtime=0),
    "environments/sky.hdr": b"light",
}


def write_small_viewer(folder: Path) -> Path:
    """Write the small viewer's files into a folder; return the folder."""
    for name, content in _FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def use_small_viewer(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Make exports of single-file pages use a small viewer, written into this folder."""
    write_small_viewer(folder)
    monkeypatch.setattr(blob_page, "viewer_dist", lambda: folder)
    blob_page.files.cache_clear()
