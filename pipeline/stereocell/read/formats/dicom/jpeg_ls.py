"""Decode JPEG-LS in DICOM with the CharLS library in imagecodecs.

pydicom's own plugin needs pyjpegls, which has no wheels for Python 3.14. GDCM refuses precisions of
6 and 7 bits.
"""

import imagecodecs
from pydicom.pixels.decoders.base import (
    DecodeRunner,
    JPEGLSLosslessDecoder,
    JPEGLSNearLosslessDecoder,
)
from pydicom.uid import JPEGLSTransferSyntaxes

PLUGIN = "imagecodecs"


def is_available(uid: str) -> bool:
    """Return whether the syntax is JPEG-LS. pydicom calls this for each plugin."""
    return uid in JPEGLSTransferSyntaxes


def decode_frame(stream: bytes, runner: DecodeRunner) -> bytearray:
    """Return the values of one grey plane. Raises ValueError for colours, and CharLS's errors."""
    plane = imagecodecs.jpegls_decode(stream)
    if plane.ndim != 2:
        raise ValueError(f"found a stream of {plane.shape}, expected one component")
    runner.set_option("bits_allocated", 8 * plane.dtype.itemsize)
    # pydicom extends signs in place, so it needs a writable array
    return bytearray(plane.tobytes())


for _decoder in (JPEGLSLosslessDecoder, JPEGLSNearLosslessDecoder):
    if PLUGIN not in _decoder.available_plugins:
        _decoder.add_plugin(PLUGIN, (__name__, decode_frame.__name__))
