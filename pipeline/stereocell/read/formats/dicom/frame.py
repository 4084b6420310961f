"""The header of one plane of pixels, before decoding: how it is stored and where it lies."""

from dataclasses import dataclass

from stereocell.read.formats.dicom.frame_kind import FrameKind
from stereocell.read.formats.dicom.modality_table import ModalityTable
from stereocell.read.formats.dicom.origin import Origin
from stereocell.read.formats.dicom.segmentation import Segmentation
from stereocell.read.formats.dicom.stated import Stated
from stereocell.read.formats.dicom.value_scale import ValueScale

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Encoding:
    """The map from a stored to a grey value: bits, sign, then slope * value + intercept or a table.

    bits, high_bit  bits of the value inside its container of `allocated` bits; 0 bits: floats
    is_inverted     MONOCHROME1: the lowest value is the brightest
    padding         lowest and highest stored value outside the image, before the inversion;
                    None: not stated
    table           table of grey values that replaces slope and intercept; None: there is none

    References: DICOM PS3.3 C.7.6.3 (Image Pixel module).
    """

    allocated: int
    bits: int
    high_bit: int
    is_signed: bool
    is_inverted: bool
    slope: float = 1.0
    intercept: float = 0.0
    padding: tuple[int, int] | None = None
    table: ModalityTable | None = None

    @property
    def grey_ends(self) -> tuple[float, float]:
        """The smallest and largest grey value that this many bits can give."""
        if self.table is not None:
            return self.table.grey_range(is_inverted=self.is_inverted)
        low, high = (self.slope * value + self.intercept for value in self.stored_range)
        return low, high

    @property
    def stored_range(self) -> tuple[int, int]:
        """The lowest and highest stored value of this many bits."""
        half = 1 << (self.bits - 1)
        return (-half, half - 1) if self.is_signed else (0, 2 * half - 1)


@dataclass(frozen=True, slots=True)
class Frame:
    """One plane of pixels and its place in the patient (LPS, mm).

    file, index        index of the file in the order of names, and of the frame in the file; from 0
    series, instance   digests of the UIDs of the series and of the image
    reference          digest of the frame of reference
    stack              digest of the stack ID in an enhanced image
    position           centre of the first pixel
    along_row          unit vector along a row, towards larger column indices
    along_column       unit vector along a column, towards larger row indices
    rows, columns      pixels of the plane
    spacing            mm between (rows, columns)
    tile, corner       index of the slice in a mosaic, and its first pixel (row, column) there
    segment            number of the segment that it shows, in a segmentation; 0: none or all
    segmentation       the file's segmentation; None: it is an image
    is_quadruped       whether the axes of the place are those of an animal on four legs
    parts              for an image that is stored in several files: a digest of its UID, and the
                       number of files; 0: it is stored in one file, or the number isn't stated
    kind               magnitude, projection, echo and so on; empty for a segmentation
    stated             values that repeat the geometry
    scale              statements on the values
    origin             digest of the study and of the series' number and descriptions
    start              byte of the file at which its values begin, little-endian, row by row; None:
                       they must be decoded, or are a part of an image

    References: DICOM PS3.3 C.7.6.2 (Image Plane module).
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
    tile: int = 0
    corner: tuple[int, int] = (0, 0)
    segment: int = 0
    segmentation: Segmentation | None = None
    is_quadruped: bool = False
    parts: tuple[bytes, int] = (b"", 0)
    kind: FrameKind = FrameKind()  # noqa: RUF009  (frozen)
    stated: Stated = Stated()  # noqa: RUF009  (frozen)
    scale: ValueScale = ValueScale()  # noqa: RUF009  (frozen)
    origin: Origin = Origin()  # noqa: RUF009  (frozen)
    start: int | None = None
