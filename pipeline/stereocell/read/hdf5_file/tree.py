"""Open HDF5 files so that no link or external file leads out of the source's folder.

HDF5 looks for the file of an external link, of external storage and of a virtual dataset in
several places, including the working folder. Therefore this module follows links itself, one by
one, and refuses a dataset whose voxels lie in other files.

A child process reads variable-length texts of attributes (texts.py). HDF5's own filters run in
this process. The filters of hdf5plugin decode in many C libraries that trust their input, so they
run in a child process (windows.py).
"""

import os
import re
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import islice
from typing import Any

import h5py
import numpy as np

from stereocell.model.errors import SourceError
from stereocell.read.hdf5_file.chunks import ChunkIndex
from stereocell.read.hdf5_file.texts import HeapTexts, lies_in_heap
from stereocell.read.hdf5_file.types import require_standard
from stereocell.read.hdf5_file.windows import PluginWindows, has_plugins
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location, require_own

_MAX_STEPS = 200  # names along a path, including followed links; a longer path is refused
_MAX_NODES = 20_000  # groups and datasets that a search visits at most
_LISTED = 12  # names that a message lists at most
_NUMBERS = "biuf"  # values of dtype.kind for numbers
# HDF5's message for a truncated file
_CUT = re.compile(r"truncated file: eof = (\d+),.* stored_eof = (\d+)")
_FIRST_PLUGIN = 256  # filter number; HDF5's own filters have smaller ones
_EXTRA = 'pip install "stereocell[hdf5]"'


class Hdf5Tree:
    """An open file. Call `close` at the end.

    where  name of the file, for messages
    """

    def __init__(self, location: Location, expected: str) -> None:
        self.where = location.path
        self._folder = location.folder
        self._stack = ExitStack()
        self._texts = HeapTexts()
        self._files: list[str] = []
        with one_line(self.where, expected):
            self.root = self._open(os.path.realpath(location.path))["/"]

    @property
    def files(self) -> tuple[str, ...]:
        """The paths of the open files: the source and the files that links led to."""
        return tuple(self._files)

    def close(self) -> None:
        """Close the file and the files that its links led to."""
        self._texts.close()
        self._stack.close()

    def end_texts(self) -> None:
        """End the child processes that read attributes; the files stay open for their voxels."""
        self._texts.close()

    def _open(self, path: str) -> h5py.File:
        self._files.append(path)
        try:
            return self._stack.enter_context(h5py.File(path, "r", locking="best-effort"))
        except OSError as error:
            if (cut := _CUT.search(str(error))) is None:
                raise
            raise ValueError(f"cut short at byte {cut[1]} of {cut[2]}") from None

    def find(self, path: str, *, start: h5py.Group | None = None) -> h5py.Group | h5py.Dataset:
        """Return a group or a dataset by its path. Raises SourceError where there is none."""
        at: Any = start if start is not None else self.root
        steps = deque(_steps(path))
        for _ in range(_MAX_STEPS):
            if not steps:
                return at
            name = steps.popleft()
            link = at.get(name, getlink=True) if isinstance(at, h5py.Group) else None
            if link is None:
                beside = sorted(at)[:_LISTED] if isinstance(at, h5py.Group) else []
                raise SourceError(
                    f"{self.where}: {path!r:.200}: {name!r:.80} not found, expected one of "
                    f"{', '.join(beside) or 'nothing: the path leads through a dataset'}"
                )
            if isinstance(link, h5py.SoftLink):
                steps.extendleft(reversed(_steps(link.path)))
                at = at.file["/"] if link.path.startswith("/") else at
            elif isinstance(link, h5py.ExternalLink):
                named = f"{self.where}: link {name!r:.200}"
                file = os.path.join(os.path.dirname(at.file.filename), link.filename)
                require_own(file, [self._folder], named=named)
                with one_line(named, "a complete HDF5 file"):
                    at = self._open(os.path.realpath(file))["/"]
                steps.extendleft(reversed(_steps(link.path)))
            else:
                with one_line(f"{self.where}: {path!r:.200}", "a group or a dataset"):
                    at = at[name]
        raise SourceError(f"{self.where}: {path!r:.200}: links form a circle, expected a dataset")

    def attribute(self, node: h5py.Group | h5py.Dataset, name: str) -> Any:
        """Return an attribute: a text as str, several texts as a tuple; None: absent.

        An array of one text (netCDF's NC_STRING) or of characters (Imaris) counts as a text.
        """
        value = self._attribute(node, name)
        if isinstance(value, bytes):
            return value.decode("utf-8", "replace")
        kind = value.dtype if isinstance(value, np.ndarray) else np.dtype(float)
        if kind == np.dtype("S1"):
            return b"".join(value.ravel().tolist()).decode("utf-8", "replace")
        if kind.kind not in "SUO":
            return value
        texts = _texts(value)
        return texts[0] if len(texts) == 1 else texts

    def texts(self, node: h5py.Group | h5py.Dataset, name: str) -> tuple[str, ...]:
        """Return the texts of an attribute, one for each element; empty: it is absent."""
        value = self._attribute(node, name)
        return () if value is None else _texts(value)

    def _attribute(self, node: h5py.Group | h5py.Dataset, name: str) -> Any:
        if name not in node.attrs:
            return None
        where = f"{node.file.filename}: attribute {name!r} of {node.name}"
        with one_line(where, "a readable attribute"):
            stored = node.attrs.get_id(name).get_type()
            require_standard(stored, where)
            return self._texts.read(node, name) if lies_in_heap(stored) else node.attrs[name]

    def scales(self, dataset: h5py.Dataset) -> list[list[h5py.Dataset]]:
        """Return the dimension scales of a dataset, one list per dimension; empty: it has none.

        Raises SourceError where they can't be read.
        """
        if "DIMENSION_LIST" not in dataset.attrs:
            return []
        where = f"{dataset.file.filename}: dimension scales of {dataset.name}"
        with one_line(where, "readable scales"):
            paths = self._texts.scales(dataset)
        root = dataset.file["/"]
        found = [[self.find(path, start=root) for path in named if path] for named in paths]
        return [[one for one in nodes if isinstance(one, h5py.Dataset)] for nodes in found]

    def volumes(self, start: h5py.Group) -> Iterator[h5py.Dataset]:
        """Yield the datasets of numbers with three axes longer than 1, below a group, by name."""
        return (dataset for dataset in self._all(start) if is_volume(dataset))

    def datasets(self, start: h5py.Group, most: int) -> list[h5py.Dataset]:
        """Return up to `most` datasets below a group, of any content."""
        return list(islice(self._all(start), most))

    def _all(self, start: h5py.Group) -> Iterator[h5py.Dataset]:
        """Yield the datasets below a group, by name.

        Links are not followed: their targets are found under their own names, or lie elsewhere.
        """
        waiting: deque[h5py.Group] = deque([start])
        seen = {hash(start.id)}
        for _ in range(_MAX_NODES):
            if not waiting:
                return
            group = waiting.popleft()
            for name in sorted(group):
                if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                    continue
                node = group[name]
                if isinstance(node, h5py.Group) and hash(node.id) not in seen:
                    seen.add(hash(node.id))
                    waiting.append(node)
                elif isinstance(node, h5py.Dataset):
                    yield node


def is_volume(dataset: h5py.Dataset) -> bool:
    """Return whether a dataset holds numbers along at least three axes longer than 1."""
    return dataset.dtype.kind in _NUMBERS and sum(n > 1 for n in dataset.shape or ()) >= 3


def _texts(value: Any) -> tuple[str, ...]:
    return tuple(
        one.decode("utf-8", "replace") if isinstance(one, bytes) else str(one)
        for one in np.ravel(np.asarray(value, dtype=object)).tolist()
    )


def _steps(path: str) -> list[str]:
    return [step for step in path.split("/") if step not in ("", ".")]


class Hdf5Array:
    """A dataset's voxels; h5py reads one window at a time.

    Raises SourceError where the voxels lie in other files, have no standard type, or need a filter
    that is not installed. Reading a window raises it where the index of the chunks is damaged.
    """

    def __init__(self, dataset: h5py.Dataset, where: str) -> None:
        self.dataset = dataset
        self._where = where
        self._index: ChunkIndex | None = None
        self._windows: Any = dataset
        if require_readable(dataset, where):
            self._windows = PluginWindows(dataset)
        self.shape: tuple[int, ...] = dataset.shape
        self.dtype = dataset.dtype
        self.chunks: tuple[int, ...] = dataset.chunks or (
            *(1 for _ in dataset.shape[:-2]),
            *dataset.shape[-2:],
        )

    def __getitem__(self, key: Any) -> Any:
        if self._index is None:
            self._index = ChunkIndex(self.dataset, self._where)
        self._index.require_found(key)
        return self._windows[key]


def require_readable(dataset: h5py.Dataset, where: str) -> bool:
    """Return whether a plugin filter, not one of HDF5's own, compresses a dataset's voxels.

    Raises SourceError where they can't be read from the file itself, or have no standard type.
    """
    is_plugin = False
    if dataset.external or dataset.is_virtual:
        raise SourceError(
            f"{where}: the voxels lie in other files (external or virtual storage), expected them "
            "in the file itself: copy the dataset with h5repack or h5py"
        )
    creation = dataset.id.get_create_plist()
    filters = {creation.get_filter(index)[0] for index in range(creation.get_nfilters())}
    if h5py.h5z.FILTER_NBIT not in filters:  # the NBIT filter packs numbers of any width
        require_standard(dataset.id.get_type(), where)
    for index in range(creation.get_nfilters()):
        code, _, _, name = creation.get_filter(index)
        is_plugin = is_plugin or (code >= _FIRST_PLUGIN and code != h5py.h5z.FILTER_LZF)
        if not (h5py.h5z.filter_avail(code) or (has_plugins() and h5py.h5z.filter_avail(code))):
            shown = name.decode("ascii", "replace").strip().split(";")[0]
            title = shown if shown.isprintable() and shown else "unknown"
            raise SourceError(
                f"{where}: filter {title:.40} (number {code}): not installed, "
                f"expected gzip, LZF or szip, or {_EXTRA}"
            )
    return is_plugin
