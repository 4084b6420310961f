"""Read the needed part of a DICOM file's header: geometry, modality, storage of the pixels.

Privacy begins here. pydicom reads only the tags in `_TAGS` and skips the values of all others.
UIDs, which identify series and copies, become digests. Logs, warnings and texts of exceptions of
pydicom may quote values, so they are discarded. Messages name a file by its number in the order of
names, never by its name.
"""

import hashlib
import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np
import pydicom
from pydicom.tag import Tag
from pydicom.uid import DeflatedExplicitVRLittleEndian

from stereocell.model.modality import MODALITIES
from stereocell.read.formats.dicom.encoding import encoding_of
from stereocell.read.formats.dicom.frame import Frame, Vector
from stereocell.read.formats.dicom.frame_kind import KIND_TAGS, FrameKind, kind_of
from stereocell.read.formats.dicom.frame_offsets import (
    frame_offsets,
    has_offsets,
    place_first,
)
from stereocell.read.formats.dicom.header_values import find_number, find_value, first_item
from stereocell.read.formats.dicom.known_headers import KnownHeaders, digest_of
from stereocell.read.formats.dicom.modality_table import TABLE_TAGS
from stereocell.read.formats.dicom.mosaic import Mosaic, MosaicError, Tile, find_mosaic
from stereocell.read.formats.dicom.no_plane import NoPlaneError
from stereocell.read.formats.dicom.origin import ORIGIN_TAGS, origin_of
from stereocell.read.formats.dicom.remedies import class_name, remedy_for
from stereocell.read.formats.dicom.segmentation import (
    LABELMAP,
    Segmentation,
    segmentation_of,
)
from stereocell.read.formats.dicom.silence_logs import DICOM_FAULTS, quiet
from stereocell.read.formats.dicom.stated import STATED_TAGS, count_frames, stated_of
from stereocell.read.formats.dicom.stored_values import PLUGINS, is_compressed
from stereocell.read.formats.dicom.value_scale import SCALE_TAGS, ValueScale, scale_of

T = TypeVar("T")

_NAMED: list[Any] = [
    "SOPClassUID",
    "Modality",
    "SeriesInstanceUID",
    "SOPInstanceUID",
    "FrameOfReferenceUID",
    "InstanceNumber",
    "NumberOfFrames",
    "ConcatenationUID",
    "InConcatenationTotalNumber",
    "Rows",
    "Columns",
    "SamplesPerPixel",
    "PhotometricInterpretation",
    "BitsAllocated",
    "BitsStored",
    "HighBit",
    "PixelRepresentation",
    "PixelPaddingValue",
    "PixelPaddingRangeLimit",
    "PixelSpacing",
    "ImagePositionPatient",
    "ImageOrientationPatient",
    "AnatomicalOrientationType",
    "RescaleSlope",
    "RescaleIntercept",
    "SegmentSequence",
    "SegmentationType",
    "SegmentsOverlap",
    "MaximumFractionalValue",
    "DetectorInformationSequence",
    "SliceVector",
    "GridFrameOffsetVector",
    "DoseGridScaling",
    "SharedFunctionalGroupsSequence",
    "PerFrameFunctionalGroupsSequence",
    *KIND_TAGS,
    *ORIGIN_TAGS,
    *STATED_TAGS,
    *SCALE_TAGS,
    *TABLE_TAGS,
]
# converted once, because pydicom would look them up for each file
_TAGS = [Tag(name) for name in _NAMED]
SEGMENTATION = "holding a segmentation"  # first words of the reason for leaving out such a file
_NO_PLACE = "without a place in the patient"
_NO_SPACING = "without a PixelSpacing above 0"
_UNDEFINED = 0xFFFFFFFF  # length of an element that ends with a delimiter
_LONG_VRS = (b"OB", b"OW", b"OF", b"OD", b"UN")  # VRs whose elements state a length of four bytes
# attributes that pydicom needs to decode pixels
_ASKED = (
    "Rows",
    "Columns",
    "SamplesPerPixel",
    "PhotometricInterpretation",
    "BitsAllocated",
    "BitsStored",
    "PixelRepresentation",
)
# mm; smallest and largest pixel spacing. Beyond them distances in pixels are meaningless.
_SPACINGS = (1e-6, 100.0)


def is_dicom(path: Path) -> bool:
    """Return whether a file is a regular one that begins like DICOM, with or without preamble."""
    try:
        if not path.is_file():
            return False
        with path.open("rb") as file:
            head = file.read(132)
    except OSError:
        return False
    return head[128:] == b"DICM" or _lacks_preamble(head)


def _lacks_preamble(head: bytes) -> bool:
    """Return whether a file may be DICOM without preamble.

    It then begins with an element of group 2 or 8, little-endian, with a low number.
    """
    if len(head) < 8:
        return False
    group, element = struct.unpack_from("<HH", head)
    return group in (0x0002, 0x0008) and element <= 0x0018


@dataclass(frozen=True, slots=True)
class _File:
    """A file whose header is read.

    number  index in the order of names
    known   values of the headers read before it
    key     key of its header among them; None: it is not compared with others
    """

    path: Path
    number: int
    known: KnownHeaders
    key: bytes | None

    def once(self, name: str, find: Callable[[], T]) -> T:
        """Return a value that all files with the same header share; see `KnownHeaders.once`."""
        return self.known.once(self.key, name, find)


def read_frames(path: Path, file: int, known: KnownHeaders | None = None) -> list[Frame]:
    """Return the planes of a file, from its header alone.

    file   index of the file in the order of names
    known  values of headers in the same folder that were read before

    Raises NoPlaneError, whose text contains no value of the file.
    """
    try:
        with quiet(), path.open("rb") as opened:
            head = opened.read(132)
            if head[128:] == b"DICM":
                _refuse_deflated(path)
            elif not _lacks_preamble(head):
                raise NoPlaneError("not DICOM")
            opened.seek(0)
            header = pydicom.dcmread(
                opened, stop_before_pixels=True, force=True, specific_tags=_TAGS
            )
            # Digest the header before any value is accessed and so converted.
            own = _File(path, file, known or KnownHeaders(), digest_of(header))
            segmentation = segmentation_of(header)
            try:
                return _frames(header, opened, own, segmentation)
            except NoPlaneError as error:
                raise _explained(error, header, segmentation) from None
    except DICOM_FAULTS:
        raise NoPlaneError("with a damaged header") from None


def _explained(error: NoPlaneError, header: Any, segmentation: Segmentation | None) -> NoPlaneError:
    """Return the error with the kind of the file, and a remedy."""
    if segmentation is not None:
        return NoPlaneError(f"{SEGMENTATION} of {segmentation.words}, {error}")
    found = NoPlaneError(f"{_NO_PLACE}{_kind(header)}") if str(error) == _NO_PLACE else error
    found.remedy = remedy_for(header, kind_of(header, ()), str(found))
    return found


def _refuse_deflated(path: Path) -> None:
    """Raise NoPlaneError for a deflated file: it would be unpacked as a whole, to any size."""
    meta = pydicom.filereader.read_file_meta_info(path)
    if meta.get("TransferSyntaxUID") == DeflatedExplicitVRLittleEndian:
        raise NoPlaneError("deflated as a whole, which is not supported")


def _frames(
    header: Any, opened: BinaryIO, file: _File, segmentation: Segmentation | None
) -> list[Frame]:
    rows, columns = int(header.get("Rows") or 0), int(header.get("Columns") or 0)
    size = file.path.stat().st_size
    if opened.tell() >= size or rows < 1 or columns < 1:
        raise NoPlaneError(f"without pixels{_kind(header)}")
    grey = ["MONOCHROME1", "MONOCHROME2"]
    if segmentation is not None and segmentation.kind == LABELMAP:
        grey.append("PALETTE COLOR")  # the palette gives colours to object numbers
    colours = str(header.get("PhotometricInterpretation") or "MONOCHROME2").strip()
    if int(header.get("SamplesPerPixel") or 1) != 1 or colours not in grey:
        raise NoPlaneError(f"in colour, not in grey values{_kind(header)}")
    shared = first_item(header.get("SharedFunctionalGroupsSequence"))
    own: Sequence[Any] = header.get("PerFrameFunctionalGroupsSequence") or ()
    is_mask = segmentation is not None
    is_float, held, begin = _check_pixels(header, opened, size, rows * columns, is_mask=is_mask)
    count, count_notes = count_frames(int(header.get("NumberOfFrames") or 1), len(own), held)
    if held is not None and held < count:
        raise NoPlaneError("cut short")
    frame_bytes = rows * columns * int(header.get("BitsAllocated") or 0) // 8
    place_first(header)
    uids = "SeriesInstanceUID", "SOPInstanceUID", "FrameOfReferenceUID", "ConcatenationUID"
    series, instance, reference, whole = (
        hashlib.sha256(str(header.get(key, "")).encode()).digest() for key in uids
    )
    parts = int(header.get("InConcatenationTotalNumber") or 0)
    if "SOPInstanceUID" not in header:  # the file's number stands for it, so no copies are found
        instance = f"{file.number}".encode()
    modality = str(header.get("Modality", "")).strip()
    is_quadruped = str(header.get("AnatomicalOrientationType", "")).strip() == "QUADRUPED"
    origin = file.once("origin", lambda: origin_of(header))
    offsets = None
    if (own or count > 1) and len(own) != count:
        if has_offsets(header):
            normal = np.cross(*np.array(_axes(header, [None])[0]))
            offsets = frame_offsets(header, count, normal)
        if offsets is None:
            raise NoPlaneError(f"with several frames but no place for each{_kind(header)}")
    frames = []
    for index in range(count):
        groups = [own[index] if own else None, shared]
        stack = find_value({}, groups, "FrameContentSequence", "StackID")
        segment = find_value({}, groups, "SegmentIdentificationSequence", "ReferencedSegmentNumber")
        kind = FrameKind() if is_mask else file.once("kind", partial(kind_of, header, groups))
        stated = replace(
            file.once("stated", partial(stated_of, header, groups)),
            location_mm=find_number(header, groups, "", "SliceLocation"),
            count_notes=count_notes,
        )
        scale = ValueScale() if is_mask else file.once("scale", partial(scale_of, header, groups))
        directions, spacing = file.once("axes", partial(_axes, header, groups))
        mosaic = _mosaic(header, file.path, groups, (rows, columns), directions, spacing)
        if offsets is not None:
            mosaic = _shifted(mosaic, offsets[index], directions)
        encoding = file.once(
            f"encoding, {is_float=}",
            partial(encoding_of, header, groups, colours == "MONOCHROME1", is_float, scale),
        )
        is_whole = (mosaic.rows, mosaic.columns) == (rows, columns)
        start = begin + index * frame_bytes if begin is not None and is_whole else None
        frames += [
            Frame(
                file.number,
                index,
                series,
                instance,
                reference,
                hashlib.sha256(str(stack).encode()).digest(),
                int(header.get("InstanceNumber") or 0),
                modality if modality in MODALITIES else "",
                mosaic.rows,
                mosaic.columns,
                tile.position,
                *directions,
                spacing,
                encoding,
                number,
                tile.corner,
                int(segment or 0) if is_mask else 0,
                segmentation,
                is_quadruped,
                (whole, parts),
                kind,
                stated,
                scale,
                origin,
                start,
            )
            for number, tile in enumerate(mosaic.tiles)
        ]
    return frames


def _mosaic(
    header: Any,
    path: Path,
    groups: Sequence[Any],
    shape: tuple[int, int],
    directions: tuple[Vector, Vector],
    spacing: tuple[float, float],
) -> Mosaic:
    """Return the slices of an image with pixels (rows, columns); most images hold one."""
    stated = find_value(header, groups, "PlanePositionSequence", "ImagePositionPatient")
    position = None if stated is None else _vector(stated)
    try:
        found = find_mosaic(
            path, header.get("ImageType") or (), shape, directions, spacing, position
        )
    except MosaicError as error:
        raise NoPlaneError(str(error)) from None
    if found is not None:
        return found
    if position is None:
        raise NoPlaneError(_NO_PLACE)
    return Mosaic(*shape, (Tile((0, 0), position),))


def _shifted(mosaic: Mosaic, mm: float, directions: tuple[Vector, Vector]) -> Mosaic:
    """Return an image's slices, moved along their normal."""
    step = mm * np.cross(*np.array(directions))
    tiles = tuple(
        replace(tile, position=_vector(np.array(tile.position) + step)) for tile in mosaic.tiles
    )
    return replace(mosaic, tiles=tiles)


def _vector(values: Any) -> Vector:
    x, y, z = _numbers(values, 3)
    return x, y, z


def _kind(header: Any) -> str:
    """Return the standard's name of the kind of a file without pixels, as " (...)", or nothing."""
    name = class_name(header)
    return f" ({name})" if name else ""


def _check_pixels(
    header: Any, opened: BinaryIO, size: int, pixels: int, *, is_mask: bool
) -> tuple[bool, int | None, int | None]:
    """Return whether the pixels are floats, the number of complete frames, and where they begin.

    opened   file at the element of the pixels: tag, (VR, 2 bytes,) length
    size     size of the file in bytes
    pixels   number of pixels of a frame
    is_mask  whether a pixel may be one bit

    The number of compressed frames is None, because it needs a decoder. The first byte of the
    frames is None if their values aren't stored one after the other in this machine's form. Raises
    NoPlaneError where the pixels can't be read.
    """
    implicit, little = header.original_encoding
    order = "<" if little else ">"
    head = opened.read(12)
    _, element = struct.unpack_from(f"{order}HH", head)
    length = struct.unpack_from(f"{order}I", head, 4 if implicit else 8)[0]
    bits = int(header.get("BitsAllocated") or 0)
    is_float = element in (0x0008, 0x0009)
    if bits not in (32, 64) if is_float else bits not in (1, 8, 16, 32)[not is_mask :]:
        raise NoPlaneError(f"with {bits} bits per pixel, not 8, 16 or 32")
    syntax = header.file_meta.get("TransferSyntaxUID") if header.file_meta else None
    if is_compressed(syntax):
        if syntax not in PLUGINS:
            raise NoPlaneError("compressed in a way that is not supported")
        return is_float, None, None
    begin = opened.tell() - (4 if implicit else 0)
    is_plain = (
        little and bits > 1 and length != _UNDEFINED and all(map(header.__contains__, _ASKED))
    )
    if not implicit:
        is_plain = is_plain and head[4:6] in _LONG_VRS
    held = 8 * min(length, size - begin) // (bits * pixels)
    return is_float, held, begin if is_plain else None


def _numbers(value: Any, count: int, lacking: str = _NO_PLACE) -> tuple[float, ...]:
    try:
        numbers = tuple(float(v) for v in value)
    except DICOM_FAULTS:
        numbers = ()
    if len(numbers) != count or not all(math.isfinite(v) for v in numbers):
        raise NoPlaneError(lacking)
    return numbers


def _axes(header: Any, groups: Sequence[Any]) -> tuple[tuple[Vector, Vector], tuple[float, float]]:
    """Return unit vectors along a row and along a column, and mm between (rows, columns)."""
    orientation = find_value(header, groups, "PlaneOrientationSequence", "ImageOrientationPatient")
    spacing = find_value(header, groups, "PixelMeasuresSequence", "PixelSpacing")
    cosines = np.array(_numbers(orientation, 6)).reshape(2, 3)
    lengths = np.linalg.norm(cosines, axis=1)
    is_frame = np.allclose(lengths, 1, atol=0.01) and abs(cosines[0] @ cosines[1]) < 0.01
    if not is_frame:
        raise NoPlaneError(_NO_PLACE)
    between = _numbers(spacing, 2, _NO_SPACING)
    if min(between) <= 0:
        raise NoPlaneError(_NO_SPACING)
    if not _SPACINGS[0] <= min(between) <= max(between) <= _SPACINGS[1]:
        shown = " and ".join(f"{value:g}" for value in between)
        raise NoPlaneError(f"with an implausible PixelSpacing ({shown} mm)")
    along_row, along_column = ((a, b, c) for a, b, c in (cosines / lengths[:, None]).tolist())
    return (along_row, along_column), (between[0], between[1])
