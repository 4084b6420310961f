"""Which decoder unpacks which compressed DICOM pixels (transfer syntaxes of PS3.5 annex A.4).

Named one by one: pydicom would take whatever is installed, and one that may be, pylibjpeg-libjpeg,
is under the GPL. GDCM decodes JPEG (baseline, extended, lossless), CharLS JPEG-LS, OpenJPEG JPEG
2000 in both of its forms, and pydicom itself RLE: 1 ms for 384 x 274 x 16 bits, .3 ms by
pylibjpeg-rle, which panics, with a backtrace that nothing stops, on a stream that is too long.
"""

from pydicom import uid

PLUGINS: dict[str, str] = {
    uid.JPEGBaseline8Bit: "gdcm",
    uid.JPEGExtended12Bit: "gdcm",
    uid.JPEGLossless: "gdcm",
    uid.JPEGLosslessSV1: "gdcm",
    uid.JPEGLSLossless: "pyjpegls",
    uid.JPEGLSNearLossless: "pyjpegls",
    uid.JPEG2000Lossless: "pylibjpeg",
    uid.JPEG2000: "pylibjpeg",
    uid.HTJ2KLossless: "pylibjpeg",
    uid.HTJ2KLosslessRPCL: "pylibjpeg",
    uid.HTJ2K: "pylibjpeg",
    uid.RLELossless: "pydicom",
}
_NATIVE = (uid.ImplicitVRLittleEndian, uid.ExplicitVRLittleEndian, uid.ExplicitVRBigEndian)


def is_compressed(syntax: str | None) -> bool:
    """Return whether pixels in this transfer syntax must be unpacked; None: it is not stated."""
    return syntax is not None and syntax not in _NATIVE
