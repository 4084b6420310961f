"""An OUT on object storage whose local files are removed as soon as they are stored.

Objects lie in the memory of this process, so a test needs no server. Small files are removed after
an upload, too, which usually happens only to large ones. A file that is not fetched again is
therefore missing, as it would be for another process.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import fsspec
import pytest

from stereocell.storage import object_store


@contextmanager
def emptied() -> Iterator[str]:
    """Yield the address of an empty folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(object_store, "_SMALL_BYTES", -1)
        try:
            yield "memory://stored/out"
        finally:
            fsspec.filesystem("memory").rm("/stored", recursive=True)


def objects_in(address: str) -> dict[str, bytes]:
    """Return the objects below an address, by their paths from there."""
    files, root = fsspec.filesystem("memory"), "/" + address.partition("://")[2]
    return {name.removeprefix(f"{root}/"): files.cat_file(name) for name in files.find(root)}
