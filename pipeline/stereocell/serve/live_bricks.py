"""Bricks of the views of a source: their trees are made from the source, tile by tile, on request.

All views share one folder of trees, which lies beside them and has a limited size.
"""

from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stereocell.isosurface.holder import Holder
from stereocell.live.build_state import WatchedBuild
from stereocell.live.fine_tiles import ReadFine
from stereocell.serve.brick_library import BrickLibrary
from stereocell.serve.tree_files import TreeFiles, Volume

MOST_BYTES = 2 << 30  # bytes of all trees of a source together
_FOLDER = "bricks"


class LiveBricks:
    """The brick libraries of a source's views."""

    def __init__(self, fine: ReadFine, scratch: Path, build: WatchedBuild | None) -> None:
        """Describe the libraries; nothing is read yet.

        scratch  the folder of the views; the trees get a folder of their own in it
        build    the build that rests while a tree is made; None if no build runs
        """
        self._fine, self._build = fine, build
        self._trees = TreeFiles(scratch / _FOLDER, MOST_BYTES)
        self._libraries: dict[Path, BrickLibrary] = {}

    def library(self, view: Path, holders: Mapping[str, Holder]) -> BrickLibrary:
        """Return the library of a view.

        holders  table, pads and cables of a CT that its volumes leave out, by the channel's ID
        """

        def read(volume: Volume) -> NDArray[np.uint8]:
            holder = holders.get(volume.channel)
            return self._fine.read(volume.tile, volume.channel, volume.window, holder)

        rest = nullcontext if self._build is None else self._build.while_someone_waits
        return self._libraries.setdefault(view, BrickLibrary(view, self._trees, read, rest))
