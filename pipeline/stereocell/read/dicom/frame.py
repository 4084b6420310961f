"""What is known of one plane of pixels before it is decoded: how it is stored, where it lies."""

from dataclasses import dataclass

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Encoding:
    """How a stored value becomes a grey value: bits, sign, then slope * value + intercept.

    bits, high_bit  of the value inside its container of `allocated` bits; 0 bits: floats
    is_inverted     MONOCHROME1: the lowest value is the brightest
    padding         lowest and highest stored value that are no part of the image, before the
                    inversion; None: there are none
    """

    allocated: int
    bits: int
    high_bit: int
    is_signed: bool
    is_inverted: bool
    slope: float = 1.0
    intercept: float = 0.0
    padding: tuple[int, int] | None = None

    @property
    def stored_range(self) -> tuple[int, int]:
        """The lowest and highest stored value that these bits can hold."""
        half = 1 << (self.bits - 1)
        return (-half, half - 1) if self.is_signed else (0, 2 * half - 1)


@dataclass(frozen=True, slots=True)
class Frame:
    """One plane of pixels and where it lies in the patient (LPS, mm).

    file, index        which file in the order of names, which frame in it, both from 0
    series, instance   digests that tell series, and copies of one image, apart
    reference          digest of the frame of reference
    stack              digest of the stack that an enhanced image puts the frame in
    position           centre of the first pixel
    along_row          unit vector of growing column index; `along_column` of growing row index
    spacing            mm between (rows, columns)
    """

    file: int
    index: int
    series: bytes
    instance: bytes
    reference: bytes
    stack: bytes
    number: int
    modality: str
    rows: int
    columns: int
    position: Vector
    along_row: Vector
    along_column: Vector
    spacing: tuple[float, float]
    encoding: Encoding
