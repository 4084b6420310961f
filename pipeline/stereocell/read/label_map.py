"""A label map: voxels that hold their object's number, of any integer type, or whole floats."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.model.object_notes import ObjectNotes
from stereocell.model.tiling import Box
from stereocell.read.dataset import Dataset

_MAX_EXACT = 2.0**53  # whole numbers below are exact as float64


@dataclass(frozen=True, eq=False)
class LabelMap:
    """One channel of a dataset, at its finest level: coarser ones may be averages of numbers.

    background  the number of the voxels that are no object, beside 0, -1 and NaN
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
        """What the file says of the objects."""
        return self.dataset.objects

    def read(self, box: Box) -> NDArray[np.unsignedinteger]:
        """Return the numbers of a box, (z, y, x), unsigned; 0: no object.

        -1 and NaN are no object either, as some programs write it, nor is `background`. Raises
        SourceError for other numbers below 0, for fractions, and where a chunk can't be decoded.
        """
        numbers = self._numbers(box)
        # larger ones than the type holds are in no voxel
        if not 0 < self.background <= np.iinfo(numbers.dtype).max:
            return numbers
        return np.where(numbers == self.background, numbers.dtype.type(0), numbers)

    def _numbers(self, box: Box) -> NDArray[np.unsignedinteger]:
        stored = self.dataset.read_stored(self.channel, box)
        if stored.dtype.kind == "b":
            return stored.astype(np.uint8)
        if stored.dtype.kind == "f":
            stored = self._whole(stored)
        if stored.dtype.kind == "i":
            least = int(stored.min(initial=0))
            if least < -1:
                raise SourceError(f"{self._where}: found {least}, expected 0 or more in labels")
            if least < 0:
                stored = np.where(stored < 0, 0, stored)
            stored = stored.view(f"u{stored.itemsize}")
        return stored

    def _whole(self, stored: NDArray[np.floating]) -> NDArray[np.int64]:
        numbers = np.where(np.isnan(stored), 0, stored)
        if numbers.dtype == np.float16:  # it has no number as large as the limit
            numbers = numbers.astype(np.float32)
        is_whole = (np.abs(numbers) < _MAX_EXACT) & (np.floor(numbers) == numbers)
        if not is_whole.all():
            found = float(numbers[~is_whole][0])
            raise SourceError(f"{self._where}: found {found:g}, expected whole numbers in labels")
        return numbers.astype(np.int64)

    @property
    def _where(self) -> str:
        name = self.dataset.channels[self.channel].name
        return f"{self.dataset.shown}: channel {name!r}"
