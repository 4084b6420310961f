"""A label map: voxels that hold the number of their object, as integers or whole floats."""

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.model.object_notes import ObjectNotes
from stereocell.model.settings import MAX_COUNT
from stereocell.model.tiling import Box
from stereocell.read.dataset import Dataset

_MAX_EXACT = 2.0**53  # whole numbers below this limit are exact in float64


@dataclass(frozen=True, eq=False)
class LabelMap:
    """One channel of a dataset at its finest level, since coarser levels may average the numbers.

    background  a number that marks no object, beside 0, -1 and NaN; it may be negative
    """

    dataset: Dataset
    channel: int
    background: int = 0

    @property
    def shape(self) -> tuple[int, int, int]:
        """The number of voxels (z, y, x)."""
        return self.dataset.levels[0].shape

    @property
    def notes(self) -> ObjectNotes:
        """The file's notes on the objects."""
        return self.dataset.objects

    def read(self, box: Box) -> NDArray[np.unsignedinteger]:
        """Return the object numbers of a box, (z, y, x), unsigned; 0: no object.

        -1, NaN and `background` mean no object too; some programs write -1 or NaN. Raises
        SourceError for other numbers below 0, for fractions, and where a chunk can't be decoded.
        """
        stored = self._without_background(self._integers(box))
        if stored.dtype.kind == "i":
            least = int(stored.min(initial=0))
            if least < -1:
                way = f"give --background {least} if it marks the background, else renumber"
                if least < -MAX_COUNT:
                    way = "renumber it"
                raise SourceError(
                    f"{self._where}: found {least}, expected labels of 0 or more: {way}"
                )
            if least < 0:
                stored = np.where(stored < 0, 0, stored)
            stored = stored.view(f"u{stored.itemsize}")
        return cast("NDArray[np.unsignedinteger]", stored)

    def _integers(self, box: Box) -> NDArray[np.integer]:
        stored = self.dataset.read_stored(self.channel, box)
        if stored.dtype.kind == "b":
            return stored.astype(np.uint8)
        return self._whole(stored) if stored.dtype.kind == "f" else stored

    def _without_background(self, stored: NDArray[np.integer]) -> NDArray[np.integer]:
        """Return the numbers with 0 in place of `background`."""
        limits = np.iinfo(stored.dtype)
        # No voxel holds a number outside the range of its type.
        if not self.background or not limits.min <= self.background <= limits.max:
            return stored
        kind = stored.dtype.type
        return np.where(stored == kind(self.background), kind(0), stored)

    def _whole(self, stored: NDArray[np.floating]) -> NDArray[np.int64]:
        numbers = np.where(np.isnan(stored), 0, stored)
        if numbers.dtype == np.float16:  # float16 can't represent _MAX_EXACT
            numbers = numbers.astype(np.float32)
        is_whole = (np.abs(numbers) < _MAX_EXACT) & (np.floor(numbers) == numbers)
        if not is_whole.all():
            raise SourceError(f"{self._where}: {_not_whole(numbers[~is_whole], stored.dtype)}")
        return numbers.astype(np.int64)

    @property
    def _where(self) -> str:
        name = self.dataset.channels[self.channel].name
        return f"{self.dataset.shown}: channel {name!r}"


def _not_whole(numbers: NDArray[np.floating], stored: np.dtype[np.floating]) -> str:
    """Return the message on invalid labels: fractions, infinite numbers or too large ones."""
    large = numbers[np.isfinite(numbers) & (np.abs(numbers) >= _MAX_EXACT)]
    if not len(large):
        return f"found {float(numbers[0]):g}, expected whole numbers in labels"
    return (
        f"found {float(large[0]):.0f} in {stored.name}, which rounds whole numbers beyond "
        f"{int(_MAX_EXACT):,}, so objects with neighbouring numbers would merge, expected labels "
        "saved as int64 or uint64"
    )
