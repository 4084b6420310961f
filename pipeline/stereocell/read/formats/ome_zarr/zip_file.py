"""Read OME-Zarr in a zip file (`.ozx` of RFC-9, `.zarr.zip`) without unpacking it.

The group lies at the root of the archive, or in its only folder.

References: https://ngff.openmicroscopy.org/rfc/9
"""

import zipfile
from collections.abc import AsyncIterator
from typing import Any

from zarr.abc.buffer import Buffer
from zarr.abc.store import ByteRequest
from zarr.core.buffer import BufferPrototype
from zarr.storage import WrapperStore, ZipStore

from stereocell.model.errors import SourceError
from stereocell.read.formats.ome_zarr.archive import zarr_root_in
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location


def is_zipped(location: Location) -> bool:
    """Return whether a source is a zip file on this machine, or a group in one."""
    return location.is_local and zipfile.is_zipfile(location.path)


class ZippedStore(WrapperStore[ZipStore]):
    """The members of a zip file below one folder.

    sizes  unpacked size of each member in bytes, by its name below the folder
    """

    def __init__(self, store: ZipStore, root: str, sizes: dict[str, int]) -> None:
        super().__init__(store)
        self._root, self.sizes = root, sizes

    def _with_store(self, store: ZipStore) -> "ZippedStore":
        return type(self)(store, self._root, self.sizes)

    async def get(
        self, key: str, prototype: BufferPrototype, byte_range: ByteRequest | None = None
    ) -> Buffer | None:
        """Return the bytes of a member; None: there is no such member."""
        if key not in self.sizes:
            return None
        return await self._store.get(self._root + key, prototype, byte_range)

    async def exists(self, key: str) -> bool:
        """Return whether there is a member of this name."""
        return key in self.sizes

    async def list(self) -> AsyncIterator[str]:
        """Yield the names of all members."""
        for key in self.sizes:
            yield key

    async def list_prefix(self, prefix: str) -> AsyncIterator[str]:
        """Yield the names of the members that begin with a text."""
        for key in self.sizes:
            if key.startswith(prefix):
                yield key

    async def list_dir(self, prefix: str) -> AsyncIterator[str]:
        """Yield the names of the entries of a folder."""
        folder = f"{prefix.rstrip('/')}/" if prefix else ""
        below = (key.removeprefix(folder) for key in self.sizes if key.startswith(folder))
        for name in dict.fromkeys(key.split("/", 1)[0] for key in below):
            yield name


def open_zipped(location: Location) -> ZippedStore:
    """Return the store of a zip file, or of a group in it. Raises SourceError."""
    where = location.shown
    with one_line(where, "a complete zip file of OME-Zarr"):
        with zipfile.ZipFile(location.path) as archive:
            members = {info.filename: info for info in archive.infolist() if not info.is_dir()}
        root = zarr_root_in(members)
        if root is None:
            raise SourceError(
                f"{where}: found a zip archive without a Zarr group, expected OME-Zarr: unzip it, "
                "and name the file or folder in it"
            )
        inner = location.source[len(location.path) :].strip("/")
        root += f"{inner}/" if inner else ""
        sizes = {
            name.removeprefix(root): info.file_size
            for name, info in members.items()
            if name.startswith(root)
        }
        if any(info.flag_bits & 1 for info in members.values()):
            raise SourceError(f"{where}: found password-protected members, expected none")
        store: Any = ZipStore(location.path, mode="r")
        return ZippedStore(store, root, sizes)
