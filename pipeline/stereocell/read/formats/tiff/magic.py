"""The first bytes of TIFF and of BigTIFF, in either byte order."""

MAGIC = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
