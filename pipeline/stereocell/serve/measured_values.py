"""Answer with the measured value of a voxel: `GET /values/<tile>/<channel>?at=x,y,z`.

A bundle stores intensities in 8 bits; the stage beside it in OUT has the source's values. The list
volumes.json names, by its hash, the file of the stage that belongs to a volume. If the stage's list
has another file there, as after a new build, the server gives no value. `at` is in um, in the
volume's own space (before its matrix). The answer is {"value": ...} for the voxel that contains the
place, and null if the stage stores no value there.
"""

import math
from collections import OrderedDict
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

import anyio.to_thread
import numpy as np
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response

from stereocell.model.errors import StereoCellError
from stereocell.serve.brick_library import BrickLibrary
from stereocell.serve.headers import policy
from stereocell.serve.tree_files import Volume
from stereocell.storage.file_list import find_faults, read_list

if TYPE_CHECKING:
    from stereocell.formats.vdb_read import VdbValues

VALUES_HEADER = {"Stereocell-Values": "version=1"}  # announces /values to a page
_LIST = "files.json"  # the stage's list of files
_OPEN_FILES = 32  # most files that stay open
_LONGEST = 200  # characters of `at` that are read at most
_HEADERS = {"Cache-Control": "no-store", **policy("application/json")}


class MeasuredValues:
    """The measured values of one bundle's volumes. Its methods are thread-safe."""

    def __init__(self, library: BrickLibrary, stage: Path) -> None:
        self._library, self._stage = library, stage
        self._files: OrderedDict[tuple[str, str], tuple[str, VdbValues]] = OrderedDict()
        self._lock = Lock()

    async def answer(self, request: Request) -> Response:
        """Answer a GET."""
        at = parse_place(request.query_params.get("at", ""))
        if at is None:
            return PlainTextResponse("at: expected three numbers x,y,z in um", 400, _HEADERS)
        tile, channel = (str(request.path_params[name]) for name in ("tile", "channel"))
        value = await anyio.to_thread.run_sync(self.find, tile, channel, at)
        return JSONResponse({"value": value}, headers=_HEADERS)

    def find(self, tile: str, channel: str, at: tuple[float, float, float]) -> float | None:
        """Return the value of the voxel at a place (x, y, z) in um; None if none is stored."""
        try:
            volume = self._library.volumes().get((tile, channel))
            if volume is None or not _holds(volume, at):
                return None
            with self._lock:
                values = self._open(volume)
                found = None if values is None else values.box(at, (1, 1, 1))[0, 0, 0]
        except StereoCellError:
            return None
        # Converting through text gives the shortest number that rounds to this float32.
        return None if found is None or not np.isfinite(found) else float(str(found))

    def _open(self, volume: Volume) -> "VdbValues | None":
        """Return the voxels from which a volume was made; None if the stage has them no longer."""
        named = volume.entry.get("measured")
        if named is None:
            return None
        key = volume.tile, volume.channel
        if key in self._files and self._files[key][0] == named["sha256"]:
            self._files.move_to_end(key)
            return self._files[key][1]
        path = f"tiles/{volume.tile}/{volume.channel}.vdb"
        listed = read_list(self._stage / _LIST, "").get(path)
        if listed != named or find_faults(self._stage, {path: named}, since=self._stage / _LIST):
            return None
        # These modules are slow to import, and few pages ask for values.
        from stereocell.formats.vdb import MEASURED_NAME
        from stereocell.formats.vdb_read import VdbValues

        values = VdbValues(self._stage / path, MEASURED_NAME)
        self._files[key] = named["sha256"], values
        if len(self._files) > _OPEN_FILES:
            self._files.popitem(last=False)
        return values


def parse_place(text: str) -> tuple[float, float, float] | None:
    """Return the numbers of a text `x,y,z`; None unless they are three finite numbers."""
    try:
        x, y, z = (float(part) for part in text[:_LONGEST].split(","))
    except ValueError:
        return None
    return (x, y, z) if all(map(math.isfinite, (x, y, z))) else None


def _holds(volume: Volume, at: tuple[float, float, float]) -> bool:
    """Return whether a place is in a volume's box, or within half a voxel of it."""
    entry = volume.entry
    low, high = (np.array(entry["bounds_um"][end]) for end in ("min", "max"))
    cells = np.maximum(np.array(entry["size"]) - 2 * entry["apron"] - 1, 1)
    half = (high - low) / cells / 2
    return bool(((low - half <= at) & (at <= high + half)).all())
