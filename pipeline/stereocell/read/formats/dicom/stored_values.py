"""Stored values of a DICOM file's frames, as pydicom returns them, and the decoders for them.

PLUGINS assigns a decoder to every compressed transfer syntax, since pydicom would use any that is
installed, and one of these, pylibjpeg-libjpeg, is under the GPL. GDCM decodes JPEG (baseline,
extended, lossless), CharLS JPEG-LS, and OpenJPEG both forms of JPEG 2000. RLE is decoded by pydicom
itself, in 1 ms for 384 x 274 x 16 bits. The package pylibjpeg-rle takes 0.3 ms, but panics on a
stream that is too long, with a backtrace that can't be suppressed.

A compressed image states its own size, which is checked before a decoder allocates memory for it:
JPEG and JPEG-LS in the frame header SOFn, JPEG 2000 in the marker SIZ, bare or inside JP2 boxes.
RLE states no size.

References: DICOM PS3.5 A.4 (transfer syntaxes of encapsulated pixels); ITU-T T.81 B.2.2 (JPEG);
ITU-T T.87 C.2.2 (JPEG-LS); ITU-T T.800 A.5.1 (JPEG 2000).
"""

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pydicom
from numpy.typing import NDArray
from pydicom import uid
from pydicom.encaps import generate_frames
from pydicom.pixels.utils import iter_pixels

from stereocell.read.formats.dicom import jpeg_ls

_TAGS: list[Any] = [
    "Rows",
    "Columns",
    "SamplesPerPixel",
    "PhotometricInterpretation",
    "PlanarConfiguration",
    "NumberOfFrames",
    "BitsAllocated",
    "BitsStored",
    "HighBit",
    "PixelRepresentation",
    "ExtendedOffsetTable",
    "ExtendedOffsetTableLengths",
    "PixelData",
    "FloatPixelData",
    "DoubleFloatPixelData",
]


def open_pixels(path: Path) -> tuple[Any, str]:
    """Return a file's dataset with its pixels, and the decoder's name; empty: none is needed.

    Raises DICOM_FAULTS where the file can't be read.
    """
    dataset = pydicom.dcmread(path, force=True, specific_tags=_TAGS)
    syntax = dataset.file_meta.get("TransferSyntaxUID") if dataset.file_meta else None
    if syntax is None:  # without a file meta group: use the syntax that the reader detected
        implicit, little = dataset.original_encoding
        syntax = (
            pydicom.uid.ImplicitVRLittleEndian
            if implicit
            else pydicom.uid.ExplicitVRLittleEndian
            if little
            else pydicom.uid.ExplicitVRBigEndian
        )
        dataset.file_meta = pydicom.dataset.FileMetaDataset()
        dataset.file_meta.TransferSyntaxUID = syntax
    if is_compressed(syntax):
        return dataset, PLUGINS[syntax]
    _count_held(dataset)
    return dataset, ""


def _count_held(dataset: Any) -> None:
    """Lower a NumberOfFrames that exceeds the frames in the pixels, since pydicom would refuse it.

    header.py has already compared the header with the pixels.
    """
    bits = int(dataset.Rows) * int(dataset.Columns) * int(dataset.BitsAllocated)
    held = 8 * len(dataset.get("PixelData") or b"") // bits
    if 0 < held < int(dataset.get("NumberOfFrames") or 1):
        dataset.NumberOfFrames = held


def stored_values(dataset: Any, plugin: str, indices: Sequence[int]) -> Iterator[NDArray[Any]]:
    """Yield the values (rows, columns) of frames, in their containers. Raises DICOM_FAULTS."""
    if plugin:
        _check_streams(dataset)
    elif dataset.BitsAllocated == 1:
        return _of_bits(dataset, indices)
    # Keep all bits of the container: padding may use bits above the stored ones.
    return iter_pixels(
        dataset, indices=indices, raw=True, decoding_plugin=plugin, correct_unused_bits=False
    )


def _of_bits(dataset: Any, indices: Sequence[int]) -> Iterator[NDArray[Any]]:
    """Yield frames of one bit per pixel. pydicom 3.0 fails if a frame begins inside a byte.

    References: DICOM PS3.5 8.1.1: the first pixel is the lowest bit, and frames follow unpadded.
    """
    rows, columns = int(dataset.Rows), int(dataset.Columns)
    packed = np.frombuffer(dataset.PixelData, np.uint8)
    for index in indices:
        begin, end = index * rows * columns, (index + 1) * rows * columns
        bits = np.unpackbits(packed[begin // 8 : -(-end // 8)], bitorder="little")
        yield bits[begin % 8 :][: end - begin].reshape(rows, columns)


def _check_streams(dataset: Any) -> None:
    """Raise ValueError if a stream states another size than the header: decoders trust streams."""
    count = int(dataset.get("NumberOfFrames") or 1)
    offsets = None
    if "ExtendedOffsetTable" in dataset:
        offsets = (dataset.ExtendedOffsetTable, dataset.ExtendedOffsetTableLengths)
    for stream in generate_frames(
        dataset.PixelData, number_of_frames=count, extended_offsets=offsets
    ):
        size = plane_size(stream)
        if size is not None and size != (dataset.Rows, dataset.Columns):
            raise ValueError


PLUGINS: dict[str, str] = {
    uid.JPEGBaseline8Bit: "gdcm",
    uid.JPEGExtended12Bit: "gdcm",
    uid.JPEGLossless: "gdcm",
    uid.JPEGLosslessSV1: "gdcm",
    uid.JPEGLSLossless: jpeg_ls.PLUGIN,
    uid.JPEGLSNearLossless: jpeg_ls.PLUGIN,
    uid.JPEG2000Lossless: "pylibjpeg",
    uid.JPEG2000: "pylibjpeg",
    uid.HTJ2KLossless: "pylibjpeg",
    uid.HTJ2KLosslessRPCL: "pylibjpeg",
    uid.HTJ2K: "pylibjpeg",
    uid.RLELossless: "pydicom",
}
_NATIVE = (uid.ImplicitVRLittleEndian, uid.ExplicitVRLittleEndian, uid.ExplicitVRBigEndian)


def is_compressed(syntax: str | None) -> bool:
    """Return whether pixels in this transfer syntax must be decoded. None means not stated."""
    return syntax is not None and syntax not in _NATIVE


_J2K = b"\xff\x4f\xff\x51"  # markers SOC and SIZ
# markers SOF0 to SOF15 without DHT, JPG and DAC, which are between them; SOF55 is JPEG-LS
_FRAMES = {*range(0xC0, 0xD0), 0xF7} - {0xC4, 0xC8, 0xCC}


def plane_size(stream: bytes) -> tuple[int, int] | None:
    """Return (rows, columns) of a stream; None: not stated. Raises struct.error if cut short."""
    start = stream.find(_J2K, 0, 4096)
    if start >= 0:
        right, bottom, left, top = struct.unpack_from(">4I", stream, start + 8)
        return bottom - top, right - left
    if stream[:2] != b"\xff\xd8":
        return None
    place = 2
    while place < len(stream):
        if stream[place] != 0xFF:
            return None
        code = stream[place + 1]
        if code == 0xFF:  # fill bytes may precede a marker
            place += 1
            continue
        if code in _FRAMES:
            rows, columns = struct.unpack_from(">2H", stream, place + 5)
            return rows, columns
        place += 2 + struct.unpack_from(">H", stream, place + 2)[0]
    return None
