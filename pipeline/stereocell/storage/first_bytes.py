"""What a file is by its first bytes, in words: for messages about files that are something else."""

import re
import zlib
from dataclasses import dataclass

_AGAIN = "copy or download it again"
_POINTERS = (
    (b"version https://git-lfs", "a pointer of Git LFS (`git lfs pull` gets the file)"),
    (b"/annex/objects", "a pointer of git-annex (`git annex get` gets the file)"),
)
_CDF = (b"\x01", b"\x02", b"\x05")  # versions of netCDF-3
_MAGIC = (
    *_POINTERS,
    (b"MATLAB 5.0", "a MATLAB file before 7.3 (save it in MATLAB with -v7.3)"),
    *((b"CDF" + mark, "a netCDF-3 file (`nccopy -k nc4 IN OUT` makes netCDF-4)") for mark in _CDF),
    (b"\x93NUMPY", "a NumPy array (tifffile.imwrite makes a TIFF of it)"),
    (b"PK\x03\x04", "a zip archive (unzip it, and name the file or folder in it)"),
    (b"PK\x05\x06", "an empty zip archive"),
    (b"\x89PNG\r\n", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"%PDF", "a PDF document"),
    (b"Rar!", "a rar archive (unpack it)"),
    (b"7z\xbc\xaf", "a 7z archive (unpack it)"),
    (b"BZh", "a bzip2 file (unpack it)"),
    (b"\xfd7zXZ", "an xz file (unpack it)"),
    (b"\xd0\xcf\x11\xe0", "an OLE file (Olympus OIB, older Microsoft Office)"),
    (b"# === DATA DESCRIPTION", "the header of Philips PAR/REC (dcm2niix makes NIfTI of it)"),
    (b"GIF8", "a GIF image"),
    (b"BM", "a BMP image"),
)
# where a format's mark lies, the mark -> the format (readers.READERS), and words for it
_READ = (
    (128, b"DICM", "dicom", "a DICOM file"),  # goes first: its preamble may begin a TIFF
    *((0, mark, "tiff", "a TIFF file") for mark in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")),
    (0, b"\x89HDF\r\n\x1a\n", "hdf5", "an HDF5 file"),
    (0, b"MATLAB 7.3", "hdf5", "a MATLAB 7.3 file"),  # HDF5 behind a block of 512 bytes
    (0, b"NRRD0", "nrrd", "an NRRD file"),
    (0, b"ZISRAWFILE", "czi", "a CZI file of Zeiss"),
    (0, b"\xda\xce\xbe\x0a", "nd2", "an ND2 file of Nikon"),
    *((344, mark, "nifti", "a NIfTI file") for mark in (b"n+1\0", b"ni1\0")),
    *((4, mark, "nifti", "a NIfTI-2 file") for mark in (b"n+2\0\r\n", b"ni2\0\r\n")),
    (208, b"MAP ", "mrc", "an MRC file"),
)
_LIF = re.compile(rb"\x70\0\0\0....\x2a", re.DOTALL)
_METAIMAGE = re.compile(rb"\s*(ObjectType|Comment|NDims|ObjectSubType|TransformType)\s*=")
_GZIP = b"\x1f\x8b"
HEAD_BYTES = 512  # bytes that `identify` needs
TIFF_MAGIC = tuple(mark for _, mark, name, _ in _READ if name == "tiff")


@dataclass(frozen=True, slots=True)
class Content:
    """What a file is.

    words     as `a zip archive (unzip it)`, with the way out where there is one
    format    one that is read (readers.READERS); empty: none is known
    is_known  False: the words only say how it begins
    """

    words: str
    format: str = ""
    is_known: bool = True


def describe(head: bytes) -> str:
    """Return what a file is that begins with these bytes, as `a zip archive (unzip it)`.

    >>> describe(b"<!DOCTYPE html>")
    'an HTML page (a download that failed, or asked for a login: download it again)'
    """
    return identify(head).words


def identify(head: bytes) -> Content:
    """Return what a file is that begins with these bytes."""
    if not head:
        return Content(f"an empty file ({_AGAIN})")
    for place, mark, name, words in _READ:
        if head[place : place + len(mark)] == mark:
            return Content(words, name)
    if _LIF.match(head):
        return Content("a LIF file of Leica", "lif")
    if head.startswith(_GZIP):
        return _packed(head)
    if head[257:262] == b"ustar":
        return Content("a tar archive (unpack it)")
    for magic, words in _MAGIC:
        if head.startswith(magic):
            return Content(words)
    if not any(head):
        return Content(f"zeros (a copy or a download that did not finish: {_AGAIN})")
    return _text(head)


def pointer_words(head: bytes) -> str:
    """Return what a file is that stands for another one, in words; empty: it is its own content."""
    return next((words for magic, words in _POINTERS if head.startswith(magic)), "")


def _text(head: bytes) -> Content:
    text = head.lstrip(b"\xef\xbb\xbf \t\r\n").lower()
    if text.startswith((b"<!doctype html", b"<html")):
        return Content(
            "an HTML page (a download that failed, or asked for a login: download it again)"
        )
    if text.startswith((b"<?xml", b"<ome", b"<error")):
        is_error = b"<error" in text
        return Content(
            f"an XML error of a server (a download that failed: {_AGAIN})"
            if is_error
            else "an XML file"
        )
    if _METAIMAGE.match(head):
        return Content("the header of a MetaImage", "metaimage")
    if head.isascii() and all(byte >= 32 or byte in b"\t\r\n\f" for byte in head):
        if text.startswith((b"{", b"[")):
            return Content(f"JSON (a server's error, if it was downloaded: {_AGAIN})")
        return Content("a text file")
    return Content(f"other content (it begins with the bytes {head[:4].hex(' ')})", is_known=False)


def _packed(head: bytes) -> Content:
    """Return what a gzip file is, by the first bytes of what is packed in it."""
    inside = unpacked(head)
    if inside is None:
        return Content(f"a gzip file that is damaged ({_AGAIN})")
    if not inside:
        return Content(f"a gzip file of nothing, or one that is cut short ({_AGAIN})")
    within = identify(inside) if not inside.startswith(_GZIP) else Content("a gzip file")
    if not within.is_known:
        return Content("a gzip file (gunzip it)")
    if within.format:
        return Content(f"a gzip file of {within.words} (gunzip it)", f"{within.format}.gz")
    return Content(f"a gzip file of {within.words}")


def unpacked(head: bytes) -> bytes | None:
    """Return the first bytes of what a gzip file begins to hold; None: it is damaged."""
    try:
        return zlib.decompressobj(16 + zlib.MAX_WBITS).decompress(head, HEAD_BYTES)
    except zlib.error:
        return None
