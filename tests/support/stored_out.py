"""An OUT on object storage whose files leave this machine as soon as they are stored.

Objects lie in the memory of this process, so a test needs no server. Small files are removed after
an upload as large ones are. So a file that nobody fetched is missing, as it is for another process.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import fsspec
import pytest

from stereocell.storage import object_store


@contextmanager
def emptied() -> Iterator[str]:
    """Yield the address of a folder that holds nothing yet."""
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
