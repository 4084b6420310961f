"""The brick trees of a bundle's volumes: built on first request, and stored in a folder.

The trees of a built bundle are made from its own files and stored in OUT/bricks. A second start
builds nothing, and a new bundle gets new trees. The view of a source that is still being built has
trees finer than its files. They are read from the source (live/fine_tiles.py) and stored in a
scratch folder (serve/live_bricks.py).

A tree omits intensities up to a threshold: the largest one that the channel's transfer function
leaves invisible. The function is the one selected in the stage, with which a viewer opens. The
lowest threshold of all functions would mostly come from an unused one. A viewer that switches to
a function that shows more fetches the volume's KTX2 file instead.
"""

import hashlib
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.bundle.manifest import MANIFEST, REMEDY, read_manifest
from stereocell.formats.brick_stream import HASH_BYTES, encode_tree
from stereocell.formats.ktx2 import decode_finest
from stereocell.formats.voxel_bvh import build
from stereocell.model.errors import OutputError, SourceError, StereoCellError
from stereocell.serve.tree_files import BrickFile, TreeFiles, Volume
from stereocell.storage.json_files import read_json
from stereocell.transfer.opacity import invisible_below

Texels = Callable[[Volume], NDArray[np.uint8]]  # returns a volume's texels (z, y, x)


class UnknownVolumeError(OutputError):
    """The bundle lacks this volume."""


class BrickLibrary:
    """The trees of one bundle. Its methods are thread-safe and may take seconds."""

    def __init__(
        self,
        bundle: Path,
        trees: Path | TreeFiles,
        read: Texels | None = None,
        while_made: Callable[[], AbstractContextManager[None]] = nullcontext,
    ) -> None:
        """Describe a library; nothing is read yet.

        bundle      the folder of manifest.json
        trees       the folder of the trees, or the `TreeFiles` that several bundles share
        read        returns the texels of a volume whose tree is finer than its file; None if the
                    bundle has no such volumes
        while_made  returns a context that is entered while a tree is made
        """
        self._bundle, self._read, self._while_made = bundle, read, while_made
        self._trees = trees if isinstance(trees, TreeFiles) else TreeFiles(trees)
        self._stamp: tuple[int, int] | None = None
        self._volumes: dict[tuple[str, str], Volume] = {}
        self._listing = Lock()

    @property
    def built(self) -> int:
        """Number of trees that were built since the start."""
        return self._trees.built

    def volumes(self) -> dict[tuple[str, str], Volume]:
        """Return the volumes by (tile, channel); read them again if the bundle was replaced.

        Raises OutputError if the bundle is missing, SourceError if it is damaged.
        """
        with self._listing:
            path = self._bundle / MANIFEST
            try:
                status = path.stat()
            except OSError as error:
                raise OutputError(f"{path.name}: {error.strerror}: {REMEDY}") from None
            stamp = (status.st_mtime_ns, status.st_ino)
            if stamp != self._stamp:
                self._volumes = _read_volumes(self._bundle)
                self._stamp = stamp
            return self._volumes

    def has_finer(self) -> bool:
        """Return whether any tree has finer texels than its volume's file."""
        try:
            return any("finer_size" in volume.entry for volume in self.volumes().values())
        except StereoCellError:  # open() raises it again for the client that requests a tree
            return False

    def open(self, tile: str, channel: str) -> BrickFile:
        """Return a volume's tree; build it if necessary.

        Raises UnknownVolumeError; OutputError and SourceError if the bundle or the source is
        damaged; FullError if the folder has no room.
        """
        volume = self._volume(tile, channel)
        file = self._trees.find(volume)
        if file is not None:
            return file
        return self._trees.make(
            volume,
            lambda: self._build(volume),
            lambda: {one.file_name for one in self.volumes().values()},
        )

    def open_built(self, tile: str, channel: str) -> BrickFile | None:
        """Return a volume's tree if it exists and is whole; never waits for a build.

        Raises the errors of open().
        """
        return self._trees.find(self._volume(tile, channel))

    def hold(self, owner: object, names: Iterable[tuple[str, str]]) -> None:
        """Keep the trees of these (tile, channel) in the folder until `owner` releases them."""
        volumes = self.volumes()
        self._trees.hold(owner, [volumes[name] for name in names if name in volumes])

    def release(self, owner: object) -> None:
        """Allow the removal of the trees that `owner` held."""
        self._trees.release(owner)

    def _volume(self, tile: str, channel: str) -> Volume:
        volume = self.volumes().get((tile, channel))
        if volume is None:
            raise UnknownVolumeError(f"the bundle has no volume of tile {tile}, channel {channel}")
        return volume

    def _build(self, volume: Volume) -> bytes:
        source = bytes.fromhex(volume.source)[:HASH_BYTES]
        with self._while_made():
            if self._read is not None and "finer_size" in volume.entry:
                texels = self._read(volume)
            else:
                texels = _read_file(self._bundle, volume)
            return encode_tree(build(texels, volume.threshold), source)


def _read_file(bundle: Path, volume: Volume) -> NDArray[np.uint8]:
    """Return the texels of a volume's KTX2 file."""
    name = volume.entry["file"]["path"]
    data = _read(bundle, volume.entry["file"])
    try:
        texture = decode_finest(data)
    except SourceError as error:
        raise SourceError(f"{name}: {error}: {REMEDY}") from None
    if list(texture.shape[2::-1]) != volume.entry["size"] or texture.shape[3] != 1:
        raise SourceError(f"{name}: {texture.shape[2::-1]} texels: {REMEDY}")
    return np.asarray(texture[..., 0])


def _read_volumes(bundle: Path) -> dict[tuple[str, str], Volume]:
    manifest = read_manifest(bundle)
    found = {}
    for channel in manifest["channels"]:
        listed = read_json(bundle / channel["volumes"]["path"], "volumes.schema.json", REMEDY)
        name = channel["lut"]["path"]
        try:
            lut = decode_finest(_read(bundle, channel["lut"]))[0]
        except SourceError as error:
            raise SourceError(f"{name}: {error}: {REMEDY}") from None
        names = channel["transfer_functions"]
        if lut.shape != (len(names), 256, 4):
            wanted = f"{len(names)} rows of 256 RGBA"
            raise SourceError(f"{name}: {lut.shape} texels, expected {wanted}: {REMEDY}")
        if channel["transfer_function"] not in names:
            chosen = channel["transfer_function"]
            raise SourceError(f"{MANIFEST}: {chosen} is none of {', '.join(names)}: {REMEDY}")
        threshold = invisible_below(lut[names.index(channel["transfer_function"])][:, 3])
        low, high = channel["window"]
        for entry in listed["volumes"]:
            found[entry["tile"], channel["id"]] = Volume(
                entry["tile"], channel["id"], entry, threshold, (low, high)
            )
    return found


def _read(bundle: Path, ref: dict[str, Any]) -> bytes:
    """Return a file of the bundle. Raises SourceError if it doesn't match its FileRef."""
    try:
        data = (bundle / ref["path"]).read_bytes()
    except OSError as error:
        raise SourceError(f"{ref['path']}: {error.strerror}: {REMEDY}") from None
    if hashlib.sha256(data).hexdigest() != ref["sha256"]:
        raise SourceError(f"{ref['path']}: its SHA-256 is not the manifest's: {REMEDY}")
    return data
