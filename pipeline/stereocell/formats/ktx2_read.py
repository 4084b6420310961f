"""Read the finest level of the KTX 2.0 textures that write/ktx2.py writes: 8-bit UNORM, zstd.

Followed: KTX 2.0 specification (Khronos, revision 2.0.4), sections 3.1 to 3.9. Sizes are checked
before memory is taken.
"""

import struct

import numpy as np
import zstandard
from numpy.typing import NDArray

from stereocell.model.errors import SourceError

_IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"
_HEADER = struct.Struct("<9I4I2Q")
_LEVEL = struct.Struct("<3Q")
_COMPONENTS = {9: 1, 16: 2, 37: 4}  # VK_FORMAT_R8_UNORM, R8G8_UNORM, R8G8B8A8_UNORM
_ZSTD = 2
_MAX_BYTES = 1 << 31


def decode_finest(data: bytes) -> NDArray[np.uint8]:
    """Return level 0, uint8 (z, y, x, components); z is 1 in a 2D texture.

    Raises SourceError, without the file's name, for what is no such texture.
    """
    if len(data) < len(_IDENTIFIER) + _HEADER.size + _LEVEL.size or data[:12] != _IDENTIFIER:
        raise SourceError("no KTX 2.0 texture")
    header = _HEADER.unpack_from(data, len(_IDENTIFIER))
    vk_format, _, width, height, depth, layers, faces, _, scheme = header[:9]
    components = _COMPONENTS.get(vk_format)
    if components is None or scheme != _ZSTD or layers or faces != 1:
        raise SourceError(
            f"VK_FORMAT {vk_format}, scheme {scheme}, {layers} layers, {faces} faces; "
            "expected 8-bit UNORM, zstd, one layer, one face"
        )
    shape = (max(depth, 1), height, width, components)
    size = shape[0] * shape[1] * shape[2] * components
    offset, length, plain = _LEVEL.unpack_from(data, len(_IDENTIFIER) + _HEADER.size)
    if plain != size or not 0 < size <= _MAX_BYTES or offset + length > len(data):
        raise SourceError(f"level 0 of {plain} bytes at byte {offset}, expected {size} bytes")
    frame = data[offset : offset + length]
    try:
        if zstandard.get_frame_parameters(frame).content_size != size:
            raise SourceError(f"level 0 does not unpack to {size} bytes")
        return np.frombuffer(zstandard.decompress(frame), dtype=np.uint8).reshape(shape)
    except zstandard.ZstdError as error:
        raise SourceError(f"level 0 is no zstd frame: {error}") from None
