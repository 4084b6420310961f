"""Describe a file by its first bytes, for messages about files of an unexpected kind.

This module knows containers, and formats that StereoCell does not read. Callers add the marks of
formats that it reads.

Two modules of `storage` need it. One, contents.py, names a foreign file that a command would
replace, or that was given in place of a build. The other, library_errors.py, names a file that a
library can't read.
"""

import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

_AGAIN = "copy or download it again"
_POINTERS = (
    (b"version https://git-lfs", "a pointer of Git LFS (`git lfs pull` gets the file)"),
    (b"/annex/objects", "a pointer of git-annex (`git annex get` gets the file)"),
)
_AS_TIFF = "convert it to TIFF or PNG"
BIOFORMATS = "Fiji opens it by Bio-Formats: save it there as OME-TIFF"
_OLE, XML, TEXT = (
    "an OLE file (Olympus OIB, older Microsoft Office)",
    "an XML file",
    "a text file",
)
_ZIP = "a zip archive (unzip it, and name the file or folder in it)"
_GUNZIP = "a gzip file (gunzip it)"
SHARED = (_OLE, XML, TEXT, _ZIP, _GUNZIP)  # containers of many formats; the file's name decides
# Words for a page that holds a bundle, which `stereocell check` accepts
SCENE = "a scene in one file, written by `stereocell export` (name the OUT that it was made from)"
_FRAMES = "extract its frames as PNG, as `ffmpeg -i FILE %05d.png` does"
_TO_TIFF = "tifffile.imwrite makes a TIFF of the array"
_CDF = (b"\x01", b"\x02", b"\x05")  # versions of netCDF-3
# First bytes of formats that are not read, and words for them, with a remedy if there is one
_MAGIC = (
    *_POINTERS,
    (b"\0\x05\x16\x07", "a record of macOS beside a file (the file's own name has no `._`)"),
    (b"MATLAB 5.0", "a MATLAB file before 7.3 (save it in MATLAB with -v7.3)"),
    *((b"CDF" + mark, "a netCDF-3 file (`nccopy -k nc4 IN OUT` makes netCDF-4)") for mark in _CDF),
    (b"PK\x05\x06", "an empty zip archive"),
    (b"\x89PNG\r\n", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"\0\0\0\x0cjP  ", f"a JPEG 2000 image ({BIOFORMATS})"),
    (b"\xff\x4f\xff\x51", f"a JPEG 2000 image ({BIOFORMATS})"),
    (b"GIF8", f"a GIF image ({_AS_TIFF})"),
    (b"%PDF", "a PDF document"),
    (b"Rar!", "a rar archive (unpack it)"),
    (b"7z\xbc\xaf", "a 7z archive (unpack it)"),
    (b"BZh", "a bzip2 file (unpack it)"),
    (b"\xfd7zXZ", "an xz file (unpack it)"),
    (b"\x28\xb5\x2f\xfd", "a Zstandard file (unpack it by zstd -d)"),
    (b"\xd0\xcf\x11\xe0", _OLE),
    (b"# === DATA DESCRIPTION", "the header of Philips PAR/REC (dcm2niix makes NIfTI of it)"),
    (b"OLYMPUSRAWFORMAT", f"an OIR file of Olympus ({BIOFORMATS})"),
    (b"SIMPLE  =", f"a FITS file ({BIOFORMATS})"),
    (b"MATRIX7", "an ECAT 7 file (nibabel reads it, and writes NIfTI)"),
    (b"# AmiraMesh", f"an Amira mesh ({BIOFORMATS})"),
    (b"# Avizo", "an Avizo file (save it there as TIFF)"),
    (b"# vtk DataFile", "a VTK file (ParaView or SimpleITK writes it as MetaImage or NRRD)"),
    (b"PAR1", "a Parquet table"),
    (b"SQLite format 3", "an SQLite database"),
    (b"\x1a\x45\xdf\xa3", f"a video ({_FRAMES})"),
)
# Patterns of first bytes for formats whose mark has gaps or alternatives, and words for them
_PATTERNS = (
    (rb"BM.{4}\x00{4}", "a BMP image"),
    (rb"RIFF.{4}AVI ", f"a video ({_FRAMES})"),
    (rb"RIFF.{4}WEBP", f"a WebP image ({_AS_TIFF})"),
    (rb".{4}ftyp(hei|mif|avi)", f"an HEIF image ({_AS_TIFF})"),
    (rb".{4}ftyp", f"a video ({_FRAMES})"),
    (rb"\x00{3}\x03.{4}\x00{3}[\x00\x01]", f"a DM3 file of Gatan ({BIOFORMATS})"),
    (rb"\x00{3}\x04.{8}\x00{3}[\x00\x01]", f"a DM4 file of Gatan ({BIOFORMATS})"),
    (rb"\x80[\x02-\x05][\x95}\](c]", f"a Python pickle, which is never opened ({_TO_TIFF})"),
    (rb"\s*ics_version\s", f"the header of an ICS image ({BIOFORMATS})"),
    (rb"PK\x03\x04.{26}mimetypeapplication/vnd\.oasis", "a document of OpenOffice"),
    (rb"PK\x03\x04.{26}\[Content_Types\]", "a document of Microsoft Office"),
    (rb"PK\x03\x04.{26}[^\x00]{1,80}\.npy", f"a NumPy archive of arrays ({_TO_TIFF}, one by one)"),
    (rb"PK\x03\x04", _ZIP),
    (
        rb"<!doctype html>.{0,100}<title>StereoCell</title>",  # written by bundle/blob_page.py
        SCENE,
    ),
)
_COMPILED = tuple((re.compile(mark, re.DOTALL), words) for mark, words in _PATTERNS)
_JSON = re.compile(rb"\{\s*[\"}]|\[\s*([\"{\[\d\]-]|true|false|null)")
_SECTION = re.compile(rb"\[[^\]\r\n]+\]\s*\r?\n")
_GZIP = b"\x1f\x8b"
HEAD_BYTES = 512  # bytes that `identify` needs


@dataclass(frozen=True, slots=True)
class Mark:
    """Bytes by which files of a format are recognised.

    words    words for the file, with an article
    pattern  regular expression that matches the file's content from byte `at`
    """

    words: str
    pattern: bytes
    at: int = 0

    def is_in(self, head: bytes) -> bool:
        """Return whether a file that begins with these bytes has the mark."""
        return re.compile(self.pattern, re.DOTALL).match(head, self.at) is not None


Marks = Sequence[tuple[str, Mark]]  # names of formats with their marks, in order of preference


@dataclass(frozen=True, slots=True)
class Content:
    """The content of a file.

    words     words such as `a zip archive (unzip it)`, with a remedy if there is one
    format    format whose mark the file has; empty: it has none of the given marks
    is_known  whether the content was recognised; False: the words only quote the first bytes
    """

    words: str
    format: str = ""
    is_known: bool = True


def identify(head: bytes, marks: Marks = ()) -> Content:
    """Return the content of a file that begins with these bytes.

    marks  marks that take precedence over those of this module

    >>> identify(b"GIF89a").words.partition(" (")[0]
    'a GIF image'
    """
    if not head:
        return Content(f"an empty file ({_AGAIN})")
    for name, mark in marks:
        if mark.is_in(head):
            return Content(mark.words, name)
    if head.startswith(_GZIP):
        return _packed(head, marks)
    if head[257:262] == b"ustar":
        return Content("a tar archive (unpack it)")
    for magic, words in _MAGIC:
        if head.startswith(magic):
            return Content(words)
    for pattern, words in _COMPILED:
        if pattern.match(head):
            return Content(words)
    if not any(head):
        return Content(f"zeros (a copy or a download that did not finish: {_AGAIN})")
    return _text(head)


def pointer_words(head: bytes) -> str:
    """Return words for a pointer of Git LFS or git-annex; empty: the file is no pointer."""
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
            f"an XML error of a server (a download that failed: {_AGAIN})" if is_error else XML
        )
    if _SECTION.match(text):
        return Content("a text file of settings ([section] and key=value lines)")
    if head.isascii() and all(byte >= 32 or byte in b"\t\r\n\f" for byte in head):
        if _JSON.match(text):
            return Content(f"JSON (a server's error, if it was downloaded: {_AGAIN})")
        return Content(TEXT)
    return Content(f"other content (it begins with the bytes {head[:4].hex(' ')})", is_known=False)


def _packed(head: bytes, marks: Marks) -> Content:
    """Return the content of a gzip file, recognised by its first unpacked bytes."""
    inside = unpacked(head)
    if inside is None:
        return Content(f"a gzip file that is damaged ({_AGAIN})")
    if not inside:
        return Content(f"a gzip file of nothing, or one that is cut short ({_AGAIN})")
    within = identify(inside, marks) if not inside.startswith(_GZIP) else Content("a gzip file")
    if not within.is_known:
        return Content(_GUNZIP)
    if within.format:
        return Content(f"a gzip file of {within.words} (gunzip it)", f"{within.format}.gz")
    return Content(f"a gzip file of {within.words}")


def unpacked(head: bytes) -> bytes | None:
    """Return the first unpacked bytes of a gzip file; None: it is damaged."""
    try:
        return zlib.decompressobj(16 + zlib.MAX_WBITS).decompress(head, HEAD_BYTES)
    except zlib.error:
        return None
