"""The size that a compressed image states about itself, before a decoder takes memory for it.

JPEG and JPEG-LS: the frame header SOFn (ITU-T T.81 B.2.2, T.87 C.2.2). JPEG 2000: the marker SIZ
(ITU-T T.800 A.5.1), bare or inside JP2 boxes. RLE states none.
"""

import struct

_J2K = b"\xff\x4f\xff\x51"  # SOC, then SIZ
# SOF0 to SOF15 without DHT, JPG and DAC, which lie among them; SOF55 is JPEG-LS
_FRAMES = {*range(0xC0, 0xD0), 0xF7} - {0xC4, 0xC8, 0xCC}


def plane_size(stream: bytes) -> tuple[int, int] | None:
    """Return (rows, columns) of a stream; None: it states none. Raises struct.error if cut."""
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
        if code == 0xFF:  # a fill byte
            place += 1
            continue
        if code in _FRAMES:
            rows, columns = struct.unpack_from(">2H", stream, place + 5)
            return rows, columns
        place += 2 + struct.unpack_from(">H", stream, place + 2)[0]
    return None
