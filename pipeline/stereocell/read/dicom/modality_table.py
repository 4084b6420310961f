"""Grey values by a table of the header, ModalityLUTSequence, in the place of a rescale.

References: DICOM PS3.3 C.11.1 (Modality LUT)
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.dicom.header_values import first_item
from stereocell.read.dicom.no_plane import NoPlaneError
from stereocell.read.dicom.silence_logs import DICOM_FAULTS

_MOST = 1 << 16  # entries; 0 in the descriptor stands for as many


@dataclass(frozen=True, slots=True)
class ModalityTable:
    """The grey value of each stored value.

    first    stored value of the first entry; lower ones have its value, and higher ones than the
             last that of the last
    entries  16-bit numbers without a sign, little-endian
    """

    first: int
    entries: bytes

    @property
    def values(self) -> NDArray[np.uint16]:
        """The entries."""
        return np.frombuffer(self.entries, "<u2")

    @property
    def ends(self) -> tuple[float, float]:
        """The lowest and the highest grey value."""
        return float(self.values.min()), float(self.values.max())

    def apply(self, stored: NDArray[Any]) -> NDArray[np.uint16]:
        """Return the grey values of stored values."""
        values = self.values
        return values[np.clip(stored.astype(np.int64) - self.first, 0, len(values) - 1)]


def table_of(header: Any) -> ModalityTable | None:
    """Return the table of an image; None: it has none. Raises NoPlaneError for a damaged one."""
    item = first_item(header.get("ModalityLUTSequence"))
    if item is None:
        return None
    try:
        count, first, bits = (int(value) for value in item.LUTDescriptor)
        data = item["LUTData"].value
        little = header.original_encoding[1]
        if isinstance(data, bytes):
            entries = np.frombuffer(data, "<u2" if little else ">u2")
        else:
            entries = np.atleast_1d(np.asarray(data, np.int64) & 0xFFFF)
        if len(entries) != (count or _MOST) or not 8 <= bits <= 16:
            raise NoPlaneError("of values by a damaged modality table")
    except DICOM_FAULTS:
        raise NoPlaneError("of values by a damaged modality table") from None
    if header.get("PixelRepresentation"):  # the VR may have given another sign
        first = ((first + 0x8000) & 0xFFFF) - 0x8000
    else:
        first &= 0xFFFF
    return ModalityTable(first, _shared(entries.astype("<u2").tobytes()))


@lru_cache(maxsize=16)
def _shared(entries: bytes) -> bytes:
    """Return one object for equal entries, of which each image of a series has its own copy."""
    return entries
