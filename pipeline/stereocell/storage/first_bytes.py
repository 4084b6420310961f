"""What a file is by its first bytes, in words: for messages about files that are something else."""

_MAGIC = (
    (b"version https://git-lfs", "a pointer of Git LFS (`git lfs pull` gets the file)"),
    (b"/annex/objects", "a pointer of git-annex (`git annex get` gets the file)"),
    (b"PK\x03\x04", "a zip archive (unzip it, and name the file or folder in it)"),
    (b"PK\x05\x06", "an empty zip archive"),
    (b"\x1f\x8b", "a gzip file (gunzip it)"),
    (b"\x89HDF\r\n", "an HDF5 file"),
    (b"\x89PNG\r\n", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"%PDF", "a PDF document"),
    (b"Rar!", "a rar archive (unpack it)"),
    (b"7z\xbc\xaf", "a 7z archive (unpack it)"),
    (b"BZh", "a bzip2 file (unpack it)"),
    (b"\xfd7zXZ", "an xz file (unpack it)"),
    (b"NRRD", "an NRRD file"),
    (b"ZISRAWFILE", "a CZI file of Zeiss"),
    (b"\xda\xce\xbe\x0a", "an ND2 file of Nikon"),
    (b"\xd0\xcf\x11\xe0", "an OLE file (Olympus OIB, older Microsoft Office)"),
    (b"# === DATA DESCRIPTION", "the header of Philips PAR/REC (dcm2niix makes NIfTI of it)"),
    (b"GIF8", "a GIF image"),
    (b"BM", "a BMP image"),
)
HEAD_BYTES = 512  # that `describe` needs
TIFF_MAGIC = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")


def describe(head: bytes) -> str:
    """Return what a file is that begins with these bytes, as `a zip archive (unzip it)`.

    >>> describe(b"<!DOCTYPE html>")
    'an HTML page (a download that failed, or asked for a login)'
    """
    if not head:
        return "an empty file"
    if head[128:132] == b"DICM":
        return "a DICOM file"
    if head.startswith(TIFF_MAGIC):
        return "a TIFF file"
    if head[257:262] == b"ustar":
        return "a tar archive (unpack it)"
    for magic, words in _MAGIC:
        if head.startswith(magic):
            return words
    if not any(head):
        return "zeros (a copy or a download that did not finish)"
    text = head.lstrip(b"\xef\xbb\xbf \t\r\n").lower()
    if text.startswith((b"<!doctype html", b"<html")):
        return "an HTML page (a download that failed, or asked for a login)"
    if text.startswith((b"<?xml", b"<ome")):
        return "an XML file"
    if head.isascii() and all(byte >= 32 or byte in b"\t\r\n\f" for byte in head):
        return "a text file"
    return f"other content (it begins with the bytes {head[:4].hex(' ')})"
