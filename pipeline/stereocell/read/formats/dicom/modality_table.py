"""The lookup table from stored values to grey values, in files without a rescale.

pydicom's `apply_modality_lut` accepts no table of 12 bits, for example, so the values are looked up
here.

References: DICOM PS3.3 C.11.1 (Modality LUT module).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.formats.dicom.header_values import first_item
from stereocell.read.formats.dicom.silence_logs import DICOM_FAULTS

TABLE_TAGS: list[Any] = ["ModalityLUTSequence"]
_KEPT = 64  # tables in memory; the slices of a series mostly share one


class ModalityTableError(Exception):
    """A table can't be read; the text gives the reason without the file's values."""


@dataclass(frozen=True, slots=True)
class ModalityTable:
    """A table of grey values.

    first    stored value of the first entry; lower values get the first entry too, and values
             beyond the last entry get the last one
    depth    bits of a grey value
    entries  grey values, uint16 in the byte order of this machine
    """

    first: int
    depth: int
    entries: bytes

    @property
    def values(self) -> NDArray[np.uint16]:
        """The grey values."""
        return np.frombuffer(self.entries, np.uint16)

    def grey_range(self, *, is_inverted: bool) -> tuple[float, float]:
        """Return the lowest and the highest grey value."""
        ends = float(self.values.min()), float(self.values.max())
        most = (1 << self.depth) - 1
        return (most - ends[1], most - ends[0]) if is_inverted else ends

    def apply(self, stored: NDArray[Any], *, is_inverted: bool) -> NDArray[np.uint16]:
        """Return the grey values of stored ones, inverted if the lowest is the brightest."""
        places = np.clip(stored.astype(np.int64) - self.first, 0, len(self.values) - 1)
        grey = self.values[places]
        return np.uint16((1 << self.depth) - 1) - grey if is_inverted else grey


def table_of(header: Any) -> ModalityTable | None:
    """Return the file's table; None: it has none. Raises ModalityTableError."""
    tables = header.get("ModalityLUTSequence")
    if not tables:
        return None
    try:
        return _read(header, first_item(tables))
    except DICOM_FAULTS:
        raise ModalityTableError("with a modality table that is damaged") from None


def _read(header: Any, item: Any) -> ModalityTable:
    little = bool(header.original_encoding[1])
    is_signed = bool(header.get("PixelRepresentation") or 0)
    count, first, depth = (int(n) for n in _words(item.LUTDescriptor, little))
    count = count % (1 << 16) or 1 << 16
    first = first % (1 << 16)
    if is_signed and first >= 1 << 15:
        first -= 1 << 16
    data = item.LUTData
    if isinstance(data, bytes) and depth <= 8 and len(data) in (count, count + 1):
        values = np.frombuffer(data, np.uint8)[:count].astype(np.uint16)  # one byte per entry
    else:
        values = np.asarray(_words(data, little), np.int64).astype(np.uint16)
    if len(values) != count or not 1 <= depth <= 16 or int(values.max()) >= 1 << depth:
        raise ValueError
    return _shared(first, depth, values.tobytes())


def _words(value: Any, little: bool) -> Sequence[int] | NDArray[np.uint16]:
    """Return whole numbers, decoded from bytes if their VR is unknown."""
    if isinstance(value, bytes):
        return np.frombuffer(value, "<u2" if little else ">u2")
    return [int(number) for number in value] if hasattr(value, "__len__") else [int(value)]


@lru_cache(_KEPT)
def _shared(first: int, depth: int, entries: bytes) -> ModalityTable:
    return ModalityTable(first, depth, entries)
